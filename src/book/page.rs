//! What is a page before it is set?

/// A page as mdBook takes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompiledPage {
    /// Path below book/text, or of the generated page.
    pub path: String,
    /// Title of a generated page; empty for those of the summary.
    pub title: String,
    /// Markdown and HTML.
    pub content: String,
}

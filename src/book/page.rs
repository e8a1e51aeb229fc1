//! What is a page before it is set?

/// A page whose placeholders are resolved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompiledPage {
    /// Path below book/text, or of the generated page; ends with `.md`.
    pub path: String,
    /// Title in the contents.
    pub title: String,
    /// Number of the chapter.
    pub number: Option<u32>,
    /// Whether it stands below another page in the contents.
    pub below: bool,
    /// Markdown and HTML.
    pub content: String,
}

impl CompiledPage {
    /// Its file in the book.
    pub fn file(&self) -> String {
        format!("{}.html", self.stem())
    }

    /// The name of its file without the ending.
    pub fn stem(&self) -> &str {
        self.path.strip_suffix(".md").unwrap_or(&self.path)
    }
}

//! What is the book made from? Pages in the order of book/text/SUMMARY.md, references, evidence, and the
//! folder of the code.

use super::contradictions::{self, Contradiction};
use super::evidence::Evidence;
use super::finding::Finding;
use super::items::{self, Item};
use super::references::{self, Reference};
use super::summary;
use calibench_harness::project::Project;
use calibench_harness::published::{self, Entry};

/// Folder of the pages, relative to the project.
pub(super) const TEXT: &str = "book/text";

/// The works that may be cited, relative to the project.
pub(super) const REFERENCES: &str = "book/references.toml";

/// Where the chapter is contradicted, relative to the project.
pub(super) const CONTRADICTIONS: &str = "book/contradictions.toml";

/// Every item of the chapter, relative to the project.
pub(super) const ITEMS: &str = "book/items.toml";

/// A page as it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// Path below book/text.
    pub path: String,
    /// Title in the contents.
    pub title: String,
    /// Number of the chapter; `None` for pages before and after.
    pub number: Option<u32>,
    /// Markdown with placeholders.
    pub text: String,
}

/// Everything that goes into the book.
#[derive(Debug, Clone)]
pub struct Sources {
    /// Pages in reading order.
    pub pages: Vec<Page>,
    /// Works that may be cited.
    pub references: Vec<Reference>,
    /// Where the chapter is contradicted.
    pub contradictions: Vec<Contradiction>,
    /// Every item of the chapter, and what became of it.
    pub items: Vec<Item>,
    /// The chapter's published values.
    pub published: Vec<Entry>,
    /// What the experiments say.
    pub evidence: Evidence,
    /// The project: code and figures are read from it.
    pub project: Project,
}

impl Page {
    /// File name relative to the project.
    pub fn file(&self) -> String {
        format!("{TEXT}/{}", self.path)
    }
}

impl Sources {
    /// Reads the pages and the references.
    pub fn load(project: &Project, evidence: Evidence) -> Result<Sources, Finding> {
        let order = format!("{TEXT}/SUMMARY.md");
        let mut pages = Vec::new();
        for summary::Entry { title, path, number } in read(project, &order, summary::parse)? {
            let text = read(project, &format!("{TEXT}/{path}"), |text| Ok(text.to_string()))?;
            pages.push(Page { path, title, number, text });
        }
        let references = read(project, REFERENCES, references::parse)?;
        let contradictions = read(project, CONTRADICTIONS, contradictions::parse)?;
        let items = read(project, ITEMS, items::parse)?;
        let published =
            published::chapter().map_err(|e| Finding::new("golden/published.toml", 1, e.to_string()))?;
        let published = published.to_vec();
        let project = project.clone();
        Ok(Sources { pages, references, contradictions, items, published, evidence, project })
    }
}

/// A file of the project, read by `parse`, which says on which line it fails.
fn read<T>(
    project: &Project,
    file: &str,
    parse: impl Fn(&str) -> Result<T, (usize, String)>,
) -> Result<T, Finding> {
    let text = project.read_text(file).map_err(|error| (1, error.to_string()));
    text.and_then(|text| parse(&text)).map_err(|(line, error)| Finding::new(file, line, error))
}

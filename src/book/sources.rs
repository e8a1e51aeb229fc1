//! What is the book made from? Pages in the order of book/text/SUMMARY.md, references, evidence, and the folder of the code.

use super::contradictions::{self, Contradiction};
use super::evidence::Evidence;
use super::finding::Finding;
use super::mdbook::{self, TEXT};
use super::references::{self, Reference};
use calibench_harness::project::Project;
use calibench_harness::published::{self, Entry};
use mdbook_driver::book::BookItem;
use std::fs;
use std::path::PathBuf;

/// The works that may be cited, relative to the project.
pub(super) const REFERENCES: &str = "book/references.toml";

/// Where the chapter is contradicted, relative to the project.
pub(super) const CONTRADICTIONS: &str = "book/contradictions.toml";

/// A page as it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// Path below book/text.
    pub path: String,
    /// Number of the chapter, empty for pages before and after.
    pub number: Vec<u32>,
    /// Markdown with placeholders.
    pub text: String,
}

/// Everything that goes into the book.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// Pages in reading order.
    pub pages: Vec<Page>,
    /// Works that may be cited.
    pub references: Vec<Reference>,
    /// Where the chapter is contradicted.
    pub contradictions: Vec<Contradiction>,
    /// The chapter's published values.
    pub published: Vec<Entry>,
    /// What the experiments say.
    pub evidence: Evidence,
    /// Folder of the project: code and figures are read below it.
    pub root: PathBuf,
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
        let summary = format!("{TEXT}/SUMMARY.md");
        let at_summary = |e: &dyn std::fmt::Display| Finding::new(&summary, 1, format!("{e:#}"));
        let book = mdbook::load(project).map_err(|e| at_summary(&e))?;
        let mut pages = Vec::new();
        for item in book.iter() {
            let BookItem::Chapter(chapter) = item else { continue };
            let Some(path) = &chapter.source_path else { continue };
            pages.push(Page {
                path: path.to_string_lossy().into_owned(),
                number: chapter.number.as_ref().map(|n| n.to_vec()).unwrap_or_default(),
                text: chapter.content.clone(),
            });
        }
        let text = fs::read_to_string(project.root().join(REFERENCES));
        let references = text.map_err(|e| (1, e.to_string())).and_then(|text| references::parse(&text));
        let references = references.map_err(|(line, e)| Finding::new(REFERENCES, line, e))?;
        let text = fs::read_to_string(project.root().join(CONTRADICTIONS));
        let contradictions =
            text.map_err(|e| (1, e.to_string())).and_then(|text| contradictions::parse(&text));
        let contradictions = contradictions.map_err(|(line, e)| Finding::new(CONTRADICTIONS, line, e))?;
        let published =
            published::chapter().map_err(|e| Finding::new("golden/published.toml", 1, e.to_string()))?;
        let published = published.to_vec();
        let root = project.root().to_path_buf();
        Ok(Sources { pages, references, contradictions, published, evidence, root })
    }
}

//! How is mdBook told what to set? Its configuration, and the pages of the summary as it reads them.

use calibench_harness::project::Project;
use mdbook_driver::MDBook;
use mdbook_driver::config::{Config, HtmlConfig};
use std::io;
use std::path::{Path, PathBuf};

/// Folder of the pages, relative to the project.
pub(super) const TEXT: &str = "book/text";

/// Why the book cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BookError {
    /// mdBook gave up.
    #[error("mdBook: {0}")]
    MdBook(String),
    /// A file cannot be read or written.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// The pages of the summary, unresolved.
pub(super) fn load(project: &Project) -> Result<MDBook, BookError> {
    let root = project.root().join("book");
    let told = |e: mdbook_driver::errors::Error| BookError::MdBook(format!("{e:#}"));
    MDBook::load_with_config(root, configuration(Path::new("out")).map_err(told)?).map_err(told)
}

/// The looks: light and dark by the reader's system, no search, no playground, no outside address.
pub(super) fn configuration(folder: &Path) -> Result<Config, mdbook_driver::errors::Error> {
    let mut config = Config::default();
    config.book.title = Some("Camera calibration, checked against truth".to_string());
    config.book.language = Some("en".to_string());
    config.book.src = PathBuf::from(TEXT.trim_start_matches("book/"));
    config.build.build_dir = folder.to_path_buf();
    config.build.create_missing = false;
    config.build.use_default_preprocessors = false;
    let mut html = HtmlConfig::default();
    html.default_theme = Some("light".to_string());
    html.preferred_dark_theme = Some("navy".to_string());
    html.smart_punctuation = false;
    html.hash_files = false;
    html.playground.copyable = false;
    html.playground.runnable = false;
    html.additional_css = vec![PathBuf::from("style/book.css")];
    config.set("output.html", html)?;
    Ok(config)
}

//! How does the compiled book become a folder that a browser opens? mdBook sets the pages; everything stands beside them.

use super::compile::Compiled;
use super::mdbook::{BookError, configuration};
use super::page::CompiledPage;
use calibench_harness::project::Project;
use mdbook_driver::MDBook;
use mdbook_driver::book::{BookItem, Chapter};
use std::fs;
use std::path::{Path, PathBuf};

/// The generated pages stand below this page of the summary.
const RECORDS: &str = "records.md";
/// Files of the looks that the style sheet asks for, below book/style.
const STYLE_FILES: [&str; 2] = ["CalibenchMath.woff2", "CalibenchMath-LICENSE.txt"];

/// The page to open.
pub fn index_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

/// Writes the book to `folder`, replacing what is there only once all is written.
pub fn build(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let told = |e: mdbook_driver::errors::Error| BookError::MdBook(format!("{e:#}"));
    let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let beside = folder.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let root = project.root().join("book");
    let mut book = MDBook::load_with_config(root, configuration(&beside).map_err(told)?).map_err(told)?;
    book.book.for_each_mut(|item| fill(item, compiled));
    book.build().map_err(told)?;
    write_assets(project, compiled, &beside)?;
    let failed = |source| BookError::File { path: folder.to_path_buf(), source };
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(failed)?;
    }
    fs::rename(&beside, folder).map_err(failed)
}

/// Gives a chapter its resolved content, and the page of the records its children.
fn fill(item: &mut BookItem, compiled: &Compiled) {
    let BookItem::Chapter(chapter) = item else { return };
    let path = chapter.source_path.as_ref().map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(page) = compiled.pages.iter().find(|p| p.path == path) {
        chapter.content = page.content.clone();
    }
    if path == RECORDS {
        let parents = vec![chapter.name.clone()];
        let child = |page: &CompiledPage| {
            let content = page.content.clone();
            BookItem::Chapter(Chapter::new(&page.title, content, PathBuf::from(&page.path), parents.clone()))
        };
        chapter.sub_items = compiled.records.iter().map(child).collect();
    }
}

fn write_assets(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let write = |path: PathBuf, bytes: &[u8]| {
        let made = path.parent().map_or(Ok(()), fs::create_dir_all);
        made.and_then(|()| fs::write(&path, bytes)).map_err(|source| BookError::File { path, source })
    };
    for (name, bytes) in &compiled.assets {
        write(folder.join(name), bytes)?;
    }
    for name in STYLE_FILES {
        let path = project.root().join("book/style").join(name);
        let bytes = fs::read(&path).map_err(|source| BookError::File { path, source })?;
        write(folder.join("style").join(name), &bytes)?;
    }
    Ok(())
}

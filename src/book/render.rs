//! How does the compiled book become a folder that a browser opens? mdBook sets the pages; everything stands beside them.

use super::compile::Compiled;
use super::mdbook::{BookError, configuration};
use super::page::CompiledPage;
use calibench_harness::project::Project;
use mdbook_driver::MDBook;
use mdbook_driver::book::{BookItem, Chapter};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The generated pages stand below this page of the summary.
const RECORDS: &str = "records.md";
/// Files of the looks that the style sheet asks for, below book/style.
const STYLE_FILES: [&str; 2] = ["CalibenchMath.woff2", "CalibenchMath-LICENSE.txt"];

/// The page to open.
pub fn index_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

/// Writes the book to `folder`, replacing what is there only once all is written. Of two at once one waits.
pub fn build(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let failed = |source| BookError::File { path: folder.to_path_buf(), source };
    let _lock = lock(&beside(folder, "lock")).map_err(failed)?;
    let (new, old) = (beside(folder, "new"), beside(folder, "old"));
    // What a build that was killed has left: half of a new book, or the old one beside its place.
    if old.exists() && !folder.exists() {
        fs::rename(&old, folder).map_err(failed)?;
    }
    remove(&new).and_then(|()| remove(&old)).map_err(failed)?;
    let written = write(project, compiled, &new);
    if written.is_err() {
        // The first error is the one to report.
        let _ = remove(&new);
    }
    written?;
    if folder.exists() {
        fs::rename(folder, &old).map_err(failed)?;
    }
    fs::rename(&new, folder).and_then(|()| remove(&old)).map_err(failed)
}

/// `.name.role` in the folder in which the book stands.
fn beside(folder: &Path, role: &str) -> PathBuf {
    let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    folder.with_file_name(format!(".{name}.{role}"))
}

/// A file that one process at a time holds; the system lets go of it however the process ends.
fn lock(path: &Path) -> io::Result<File> {
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    let file = OpenOptions::new().create(true).append(true).open(path)?;
    file.lock()?;
    Ok(file)
}

/// Removes a folder that may not be there.
fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes all pages and what they show.
fn write(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let told = |e: mdbook_driver::errors::Error| BookError::MdBook(format!("{e:#}"));
    let root = project.root().join("book");
    let mut book = MDBook::load_with_config(root, configuration(folder).map_err(told)?).map_err(told)?;
    book.book.for_each_mut(|item| fill(item, compiled));
    book.build().map_err(told)?;
    write_assets(project, compiled, folder)
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

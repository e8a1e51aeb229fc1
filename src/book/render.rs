//! How does the compiled book become a folder that a browser opens? Every page as HTML, and all on one; what
//! they show stands beside them.

use super::compile::Compiled;
use super::page::CompiledPage;
use super::{html, laboratory, layout, search};
use calibench::io::lock::{lock, lock_of};
use calibench_harness::project::Project;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The generated pages stand below this page of the summary.
const RECORDS: &str = "records.md";
/// Files of the looks, below book/style.
const STYLE_FILES: [&str; 4] = ["book.css", "search.js", "CalibenchMath.woff2", "CalibenchMath-LICENSE.txt"];

/// Why the book cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {cause}", path = path.display())]
pub struct BookError {
    /// The file.
    path: PathBuf,
    /// What the system said.
    cause: io::Error,
}

/// The page to open.
pub fn index_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

/// Writes the book to `folder`, replacing what is there only once all is written. Of two at once one waits.
///
/// # Errors
/// A file cannot be read or written.
pub fn build(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let failed = |cause| BookError { path: folder.to_path_buf(), cause };
    let _lock = lock(&lock_of(folder)).map_err(failed)?;
    let (new, old) = (beside(folder, "new"), beside(folder, "old"));
    // What a build that was killed has left: half of a new book, or the old one beside its place.
    if old.exists() && !folder.exists() {
        fs::rename(&old, folder).map_err(failed)?;
    }
    remove(&new).and_then(|()| remove(&old)).map_err(failed)?;
    let written = write_all(project, compiled, &new);
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

/// Removes a folder that may not be there.
fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes all pages and what they show.
fn write_all(project: &Project, compiled: &Compiled, folder: &Path) -> Result<(), BookError> {
    let pages = in_order(compiled);
    let texts: Vec<String> = pages.iter().map(|page| html::html(&page.content)).collect();
    for (i, page) in pages.iter().enumerate() {
        write(&folder.join(page.file()), layout::page(&pages, i, &texts[i]).as_bytes())?;
    }
    write(&folder.join("print.html"), layout::print(&pages, &texts).as_bytes())?;
    write(&folder.join("search.html"), layout::search(&pages, search::PAGE).as_bytes())?;
    write(&folder.join("search-index.js"), search::index(&pages, &texts).as_bytes())?;
    for (name, bytes) in &compiled.assets {
        write(&folder.join(name), bytes)?;
    }
    for name in STYLE_FILES {
        let path = format!("book/style/{name}");
        let bytes = project.read(&path).map_err(|cause| BookError { path: path.into(), cause })?;
        write(&folder.join("style").join(name), &bytes)?;
    }
    for (path, bytes) in laboratory::files(project, &texts) {
        let bytes = bytes.map_err(|cause| BookError { path: path.clone().into(), cause })?;
        write(&folder.join(path), &bytes)?;
    }
    Ok(())
}

/// All pages in the order of reading: those of the records stand behind the page that lists them.
fn in_order(compiled: &Compiled) -> Vec<&CompiledPage> {
    let mut pages = Vec::new();
    for page in &compiled.pages {
        pages.push(page);
        if page.path == RECORDS {
            pages.extend(&compiled.records);
        }
    }
    pages
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), BookError> {
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| fs::write(path, bytes)).map_err(|cause| BookError { path: path.to_path_buf(), cause })
}

//! What is written once every trial is done? Tables, figures, report, and the manifest that names them all by
//! their hashes.

use super::engine::Engine;
use super::folder::{Folder, FolderError};
use super::manifest::Manifest;
use super::summary::{Summary, summarise};
use super::{figures, report};
use calibench::io::hash::sha256_hex;

/// Writes the results of a complete part into its folder.
pub fn finish(folder: &Folder, engine: &Engine) -> Result<Summary, FolderError> {
    let summary = summarise(engine);
    let mut manifest: Manifest = folder.manifest()?;
    manifest.files.clear();
    let mut write = |name: &str, bytes: &[u8]| {
        folder.write(name, bytes)?;
        manifest.files.insert(name.to_string(), sha256_hex(bytes));
        Ok::<(), FolderError>(())
    };
    for table in summary.tables() {
        write(&format!("{}.csv", table.name), table.to_csv().as_bytes())?;
    }
    let figures = figures::draw(engine, &summary);
    for figure in &figures {
        write(&format!("figures/{}", figure.file_name()), &figure.bytes)?;
    }
    let trials = folder.put_trials(engine, &manifest)?;
    manifest.files.insert(manifest.trials.name().to_string(), trials);
    manifest.files.insert("spec.toml".to_string(), sha256_hex(folder.read("spec.toml")?.as_bytes()));
    let page = report::page(engine, &summary, &figures, &manifest, &folder.read("spec.toml")?);
    folder.write("report.html", page.as_bytes())?;
    manifest.files.insert("report.html".to_string(), sha256_hex(page.as_bytes()));
    manifest.complete = true;
    // Last: a complete manifest vouches for all that it names.
    folder.write("manifest.json", manifest.to_text().as_bytes())?;
    folder.drop_log(&manifest)?;
    Ok(summary)
}

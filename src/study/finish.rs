//! What is written once every trial is done? Tables, figures, report, and the manifest that names them all by
//! their hashes, in words of our own and in those of others.

use super::engine::Engine;
use super::folder::{Folder, INPUTS};
use super::folder_error::FolderError;
use super::manifest::Manifest;
use super::summary::{Summary, summarise};
use super::{alone, described, figures, report};
use calibench::io::hash::sha256_hex;
use calibench_harness::Figure;

/// Writes the results of a complete part into its folder.
pub fn finish(folder: &Folder, engine: &Engine) -> Result<Summary, FolderError> {
    let summary = summarise(engine);
    let mut manifest: Manifest = folder.manifest()?;
    manifest.files.clear();
    let tables = summary.tables();
    for table in &tables {
        put(folder, &mut manifest, &format!("{}.csv", table.name), table.to_csv().as_bytes())?;
    }
    let figures = figures::draw(engine, &summary);
    for figure in &figures {
        put(folder, &mut manifest, &format!("figures/{}", figure.file_name()), &figure.bytes)?;
    }
    put(folder, &mut manifest, alone::MARKS, alone::marks(engine).as_bytes())?;
    if let Some(poses) = alone::poses(engine) {
        put(folder, &mut manifest, alone::POSES, poses.as_bytes())?;
    }
    let trials = folder.put_trials(engine, &manifest)?;
    manifest.files.insert(manifest.trials.name().to_string(), trials);
    let spec = folder.read("spec.toml")?;
    manifest.files.insert("spec.toml".to_string(), sha256_hex(spec.as_bytes()));
    if !manifest.inputs.is_empty() {
        let inputs = folder.read(INPUTS)?;
        manifest.files.insert(INPUTS.to_string(), sha256_hex(inputs.as_bytes()));
    }
    let package = described::package(engine, &tables, &manifest);
    put(folder, &mut manifest, "datapackage.json", package.as_bytes())?;
    let page = report::page(engine, &summary, &figures, &manifest, &spec);
    put(folder, &mut manifest, "report.html", page.as_bytes())?;
    let run_crate = described::run_crate(engine, &manifest);
    put(folder, &mut manifest, "ro-crate-metadata.json", run_crate.as_bytes())?;
    manifest.complete = true;
    // Last: a complete manifest vouches for all that it names.
    folder.write("manifest.json", manifest.to_text().as_bytes())?;
    folder.drop_log(&manifest)?;
    Ok(summary)
}

/// Every panel of the figures that show quantities against a factor, as a figure of its own under its name,
/// such as `bias/fx`; none where a study has no such figures.
pub fn single_panels(engine: &Engine) -> Vec<(String, Figure)> {
    let panels = figures::panels(engine, &summarise(engine));
    panels.into_iter().map(|panel| (panel.name, panel.figure)).collect()
}

/// Writes a file and notes its hash.
fn put(folder: &Folder, manifest: &mut Manifest, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
    folder.write(name, bytes)?;
    manifest.files.insert(name.to_string(), sha256_hex(bytes));
    Ok(())
}

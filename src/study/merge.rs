//! How do parts become the whole? Their batches are interleaved in the order in which an undivided run does
//! them.

use super::engine::Engine;
use super::folder::Folder;
use super::folder_error::FolderError;
use super::manifest::{Difference, Manifest};
use super::reading::Reading;
use super::run_error::RunError;
use super::shard::Shard;
use super::tables;
use super::trial_file::TrialFile;
use super::whole_log::WholeLog;
use calibench::io::Commit;
use calibench::io::ShownPath;
use calibench::io::files::{Disk, Files};
use calibench_harness::Build;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Parts that do not make a whole.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A part that cannot be read, or a whole that cannot be written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Nothing to merge.
    #[error("no parts were given: name the folders of all shards")]
    Nothing,
    /// The same folder under one name or two.
    #[error("{path} is named twice: name the folder of each shard once", path = .0.shown())]
    NamedTwice(PathBuf),
    /// The whole would take the place of a part.
    #[error("{path} is one of the parts: choose another folder for the whole", path = .0.shown())]
    IntoPart(PathBuf),
    /// A part that has trials left.
    #[error("{path} (shard {shard}) is not complete: `calibench study resume {path}` first", path = path.shown())]
    Incomplete {
        /// Its folder.
        path: PathBuf,
        /// Its part.
        shard: String,
    },
    /// Not the parts of one division.
    #[error("{missing} missing, {surplus} given twice or of another division: need each of 0/{count} ... {last}/{count} once", last = count - 1)]
    Parts {
        /// Shards that no folder holds.
        missing: String,
        /// Shards that do not belong.
        surplus: String,
        /// Number of parts of the first folder's division.
        count: u64,
    },
    /// Parts of different studies or code.
    #[error("{path} differs from the first part:\n{}", differences.iter().map(|d| format!("  {d}")).collect::<Vec<_>>().join("\n"), path = path.shown())]
    Differs {
        /// The folder.
        path: PathBuf,
        /// In what.
        differences: Vec<Difference>,
    },
}

impl From<FolderError> for MergeError {
    fn from(error: FolderError) -> MergeError {
        RunError::from(error).into()
    }
}

/// Shards that an error names one by one.
const NAMED: usize = 8;

struct Part {
    folder: Folder,
    manifest: Manifest,
    shard: Shard,
}

/// Joins the runs in `parts` into a new folder `out`, which then holds what an undivided run would, byte for
/// byte. Its trials stand in the kind of file of the first part, or in that asked for: the one part of an
/// undivided run is put into another file so.
///
/// On a disk that is full the folder is left without a file: all are on the disk before one has its name.
pub fn merge(
    parts: &[PathBuf],
    out: &Path,
    trials: Option<TrialFile>,
    build: &Build,
) -> Result<(Folder, Engine), MergeError> {
    merge_on(Arc::new(Disk), parts, out, trials, build)
}

/// As [`merge`]; the files of the whole are changed by the given operations.
pub fn merge_on(
    files: Arc<dyn Files>,
    parts: &[PathBuf],
    out: &Path,
    trials: Option<TrialFile>,
    build: &Build,
) -> Result<(Folder, Engine), MergeError> {
    distinct(parts, out)?;
    let parts = parts.iter().map(|path| open(path)).collect::<Result<Vec<Part>, _>>()?;
    let first = parts.first().ok_or(MergeError::Nothing)?;
    check(&parts, first.shard.count)?;
    let trials = trials.unwrap_or(first.manifest.trials);
    trials.check().map_err(FolderError::from)?;
    let text = first.folder.read("spec.toml")?;
    let mut whole = first.folder.engine(Shard::WHOLE)?;
    let commit = commit(&parts);
    let date = first.manifest.day.clone().filter(|_| commit.is_some());
    let build = Build { commit, date, ..build.clone() };
    let manifest = Manifest::new(&whole.spec, Shard::WHOLE, &build).with_trials(trials);
    let manifest = manifest.with_solver(first.manifest.solver.clone());
    // Bounds and statistics of the whole come from this code, its trials from that of the parts: the manifest
    // names one.
    first.folder.check(&manifest)?;
    let shards: Vec<Shard> = parts.iter().map(|part| part.shard).collect();
    let mut readings = parts
        .into_iter()
        .map(|part| Reading::begin(part.folder, whole.for_shard(part.shard)))
        .collect::<Result<Vec<Reading>, _>>()?;
    let folder = Folder::claim(files, out)?;
    let mut log = WholeLog::begin(&folder, &tables::header(&whole.quantities))?;
    while let Some((cell, batch)) = whole.next() {
        let whole_cells = whole.spec.trials.precision.is_some();
        let at = shards.iter().position(|s| s.holds(cell, batch, whole.cells.len(), whole_cells));
        let reading = &mut readings[at.expect("the parts were checked to hold every batch")];
        let Some((_, trials)) = reading.next()? else {
            return Err(MergeError::Incomplete {
                path: reading.folder.path().to_path_buf(),
                shard: reading.engine.shard.to_string(),
            });
        };
        whole.absorb((cell, batch), &trials);
        log.append(tables::rows(&trials).as_bytes())?;
    }
    // Every trial was taken, and the checkpoint of each part must say so.
    for reading in &mut readings {
        reading.next()?;
    }
    log.place(&text, &manifest, whole.batches)?;
    Ok((folder, whole))
}

/// Each part once, and none of them the whole: its trials would count twice, or be replaced by what is made
/// of them.
fn distinct(parts: &[PathBuf], out: &Path) -> Result<(), MergeError> {
    // A folder that is not there is reported when it is opened.
    let place = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let places: Vec<PathBuf> = parts.iter().map(|path| place(path)).collect();
    if let Some((i, _)) = places.iter().enumerate().find(|(i, at)| places[..*i].contains(at)) {
        return Err(MergeError::NamedTwice(parts[i].clone()));
    }
    if places.contains(&place(out)) {
        return Err(MergeError::IntoPart(out.to_path_buf()));
    }
    Ok(())
}

fn open(path: &Path) -> Result<Part, MergeError> {
    let folder = Folder::open_to_read(path)?;
    let (manifest, shard) = (folder.manifest()?, folder.shard()?);
    if !manifest.complete {
        return Err(MergeError::Incomplete { path: path.to_path_buf(), shard: manifest.shard });
    }
    Ok(Part { folder, manifest, shard })
}

fn check(parts: &[Part], count: u64) -> Result<(), MergeError> {
    let first = &parts[0];
    for part in &parts[1..] {
        let differences = first.manifest.differences(&part.manifest);
        if !differences.is_empty() {
            return Err(MergeError::Differs { path: part.folder.path().to_path_buf(), differences });
        }
    }
    let named = |shards: Vec<String>| match shards.len() {
        0 => "none".to_string(),
        1..=NAMED => shards.join(", "),
        more => format!("{} and {} more", shards[..NAMED].join(", "), more - NAMED),
    };
    let held = |index: u64| parts.iter().any(|p| p.shard == Shard { index, count });
    let missing: Vec<String> = (0..count).filter(|&i| !held(i)).map(|i| format!("{i}/{count}")).collect();
    let surplus: Vec<String> = parts
        .iter()
        .enumerate()
        .filter(|(i, p)| p.shard.count != count || parts[..*i].iter().any(|q| q.shard == p.shard))
        .map(|(_, p)| p.shard.to_string())
        .collect();
    if missing.is_empty() && surplus.is_empty() {
        return Ok(());
    }
    Err(MergeError::Parts { missing: named(missing), surplus: named(surplus), count })
}

/// The commit that all parts share.
fn commit(parts: &[Part]) -> Option<Commit> {
    let hash = parts[0].manifest.commit.clone()?;
    let same = parts.iter().all(|p| p.manifest.commit.as_ref() == Some(&hash));
    same.then(|| Commit { hash, dirty: parts.iter().any(|p| p.manifest.dirty == Some(true)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Spec, finish};

    #[test]
    fn the_whole_names_the_commit_that_its_parts_share_and_no_other() {
        let at = std::env::temp_dir().join(format!("calibench-merge-{}", std::process::id()));
        let build = |hash: &str| {
            let commit = Some(Commit { hash: hash.into(), dirty: false });
            Build { commit, date: Some("2026-01-31".into()), ..Build::default() }
        };
        let part = |name: &str, index: u64, hash: &str| {
            let (path, shard) = (at.join(name), Shard { index, count: 2 });
            let manifest = Manifest::new(&Spec::parse(STUDY).unwrap(), shard, &build(hash));
            let folder = Folder::create(&path, STUDY, &manifest).unwrap();
            let mut engine = folder.engine(shard).unwrap();
            folder.run(&mut engine, &Default::default(), |_| ()).unwrap();
            finish(&folder, &engine).unwrap();
            path
        };
        let parts = [part("first", 0, "one"), part("second", 1, "one"), part("other", 1, "two")];
        let merged = |parts: [&PathBuf; 2], out: &str| {
            let (folder, engine) =
                merge(&parts.map(Clone::clone), &at.join(out), None, &build("mine")).unwrap();
            assert_eq!(engine.trials(), 6);
            let Manifest { commit, day, .. } = folder.manifest().unwrap();
            (commit, day)
        };
        let known = (Some("one".to_string()), Some("2026-01-31".to_string()));
        assert_eq!(merged([&parts[0], &parts[1]], "alike"), known);
        assert_eq!(merged([&parts[0], &parts[2]], "unlike"), (None, None));
        std::fs::remove_dir_all(at).unwrap();
    }

    #[test]
    fn parts_that_do_not_make_a_whole_are_told_one_by_one() {
        let at = std::env::temp_dir().join(format!("calibench-parts-{}", std::process::id()));
        let part = |name: &str, index: u64, count: u64| {
            let shard = Shard { index, count };
            let manifest = Manifest::new(&Spec::parse(STUDY).unwrap(), shard, &Build::default());
            let folder = Folder::create(&at.join(name), STUDY, &manifest).unwrap();
            Part { folder, manifest, shard }
        };
        let told = |parts: &[Part], count| match check(parts, count) {
            Ok(()) => ("none".to_string(), "none".to_string()),
            Err(MergeError::Parts { missing, surplus, .. }) => (missing, surplus),
            Err(other) => panic!("{other}"),
        };
        let expected = |missing: &str, surplus: &str| (missing.to_string(), surplus.to_string());
        let mut parts = vec![part("a", 0, 2), part("b", 1, 2)];
        assert_eq!(told(&parts, 2), expected("none", "none"));
        assert_eq!(told(&parts[1..], 2), expected("0/2", "none"));
        parts.push(part("c", 1, 2));
        assert_eq!(told(&parts, 2), expected("none", "1/2"));
        parts.push(part("d", 1, 3));
        assert_eq!(told(&parts, 2), expected("none", "1/2, 1/3"));
        assert_eq!(told(&parts[3..], 3), expected("0/3, 2/3", "none"));
        drop(parts);
        std::fs::remove_dir_all(at).unwrap();
    }
}

//! From which sources is this program built? Asked once, of git and Cargo.lock, while it is built: a program
//! that is older than the sources beside it still names its own. What does the command carry with it? And are
//! there data, programs and rights for the tests that need some?

#[path = "src/calibench/io/data.rs"]
mod data;

use std::path::{Path, PathBuf};
use std::process::Command;

/// What the program is made of, relative to the package: its code, and what is compiled in that a number
/// stands on. Snapshots and figures are what numbers are compared with.
const SOURCES: [&str; 16] = [
    "Cargo.toml",
    "Cargo.lock",
    "build.rs",
    "src",
    "experiments",
    "adapters",
    "golden/detector-gate",
    "golden/gate-power",
    "golden/global-minimum",
    "golden/lens-minimum",
    "golden/model-choice",
    "golden/other-solvers",
    "golden/published.toml",
    "golden/scoreboard.csv",
    "reference",
    "studies",
];

/// Crates whose arithmetic stands in the path of a number.
const NUMERIC_CRATES: [&str; 6] = ["libm", "nalgebra", "rand", "rand_chacha", "rand_distr", "statrs"];

fn main() {
    let root =
        PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("Cargo names the package's folder"));
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    let tree = Tree::at(&root);
    let (commit, changed) = tree.as_ref().and_then(Tree::state).unwrap_or_default();
    let day = tree.as_ref().and_then(Tree::day).unwrap_or_default();
    // Elsewhere than in its own tree Cargo may have chosen other versions than those of the lock file that
    // came along.
    let crates = if tree.is_some() { versions(&root.join("Cargo.lock")) } else { String::new() };
    look_for_data();
    look_for_means();
    carry(&root);
    println!("cargo::rustc-env=CALIBENCH_COMMIT={commit}");
    println!("cargo::rustc-env=CALIBENCH_CHANGED={changed}");
    println!("cargo::rustc-env=CALIBENCH_DAY={day}");
    println!("cargo::rustc-env=CALIBENCH_CRATES={crates}");
}

/// Folders that the command carries with it, so that it works outside the source tree.
const CARRIED: [&str; 4] = ["book", "figures", "golden", "reference"];
/// What of them is read there.
const CARRIED_ENDINGS: [&str; 11] =
    ["css", "js", "json", "md", "png", "py", "snap", "svg", "toml", "wasm", "woff2"];

/// Writes the list of the files that are carried, as `carried.rs`, with the code that the book quotes.
fn carry(root: &Path) {
    let mut paths = Vec::new();
    for folder in CARRIED {
        println!("cargo::rerun-if-changed={folder}");
        files_below(&root.join(folder), &mut paths);
    }
    let carried = |path: &PathBuf| {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        CARRIED_ENDINGS.contains(&ending)
            || path.ends_with("SHA256SUMS")
            || path.ends_with("CalibenchMath-LICENSE.txt")
    };
    paths.retain(carried);
    let pages: Vec<String> = paths.iter().filter_map(|path| std::fs::read_to_string(path).ok()).collect();
    paths.extend(pages.iter().flat_map(|page| quoted_code(page)).map(|file| root.join(file)));
    paths.retain(|path| path.is_file());
    paths.sort();
    paths.dedup();
    let list: String = paths.iter().map(|path| line_of_list(root, path)).collect();
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("Cargo names a folder")).join("carried.rs");
    std::fs::write(&out, format!("&[\n{list}]\n"))
        .unwrap_or_else(|error| panic!("{}: {error}", out.display()));
}

/// Name and bytes; the name has `/` on every system.
fn line_of_list(root: &Path, path: &Path) -> String {
    let name = path.strip_prefix(root).expect("it lies below").to_string_lossy().replace('\\', "/");
    format!("    ({name:?}, include_bytes!({:?})),\n", path.display().to_string())
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { files_below(&path, found) } else { found.push(path) }
    }
}

/// The files of `{{code FILE item}}` and `{{shell FILE command}}`.
fn quoted_code(page: &str) -> Vec<&str> {
    let of =
        |verb: &str| page.split(verb).skip(1).filter_map(|rest| rest.split(' ').next()).collect::<Vec<_>>();
    [of("{{code "), of("{{shell ")].concat()
}

/// Tests that need the measurements of others are ignored, and counted so, where these are absent or
/// CALIBENCH_DATA is `none`.
fn look_for_data() {
    println!("cargo::rustc-check-cfg=cfg(calibench_data)");
    println!("cargo::rerun-if-env-changed={}", data::VARIABLE);
    // A folder that is named and missing is a mistake: the tests run, and say so.
    if data::data_folder() != Ok(None) {
        println!("cargo::rustc-cfg=calibench_data");
    }
}

/// Tests that need a program or a right of this machine are ignored, and counted so, where it is missing.
/// What comes or goes later is seen when a source changes, or the path.
fn look_for_means() {
    println!("cargo::rerun-if-env-changed=PATH");
    let runs = |command: &[&str]| {
        let run = Command::new(command[0]).args(&command[1..]).output();
        run.is_ok_and(|output| output.status.success())
    };
    let means = [
        ("calibench_numpy", runs(&["python3", "-c", "import numpy"])),
        ("calibench_octave", runs(&["octave-cli", "--version"])),
        ("calibench_cc", runs(&["cc", "--version"])),
        ("calibench_cxx", runs(&["c++", "--version"])),
        ("calibench_mounts", may_mount()),
    ];
    for (name, is_there) in means {
        println!("cargo::rustc-check-cfg=cfg({name})");
        if is_there {
            println!("cargo::rustc-cfg={name}");
        }
    }
}

/// Whether a process of this user may mount file systems on Linux (capabilities(7): CAP_SYS_ADMIN).
fn may_mount() -> bool {
    const SYS_ADMIN: u64 = 1 << 21;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    effective.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).is_some_and(|set| set & SYS_ADMIN != 0)
}

/// A working tree of git whose top is the package.
struct Tree<'a>(&'a Path);

impl Tree<'_> {
    /// `None` without git, outside of a repository, and inside one that is another project's.
    fn at(root: &Path) -> Option<Tree<'_>> {
        let tree = Tree(root);
        let top = tree.git(&["rev-parse", "--show-toplevel"])?;
        let same = std::fs::canonicalize(top).ok()? == std::fs::canonicalize(root).ok()?;
        same.then_some(tree)
    }

    /// The commit's hash, and whether a source differs from it or is unknown to it. Looked at anew after
    /// every commit and checkout.
    fn state(&self) -> Option<(String, bool)> {
        for name in ["HEAD", "logs/HEAD"] {
            let path = self.0.join(self.git(&["rev-parse", "--git-path", name])?);
            if path.exists() {
                println!("cargo::rerun-if-changed={}", path.display());
            }
        }
        let status = [&["status", "--porcelain", "--untracked-files=all", "--"], &SOURCES[..]].concat();
        Some((self.git(&["rev-parse", "HEAD"])?, !self.git(&status)?.is_empty()))
    }

    /// The day of the commit, `2026-01-31`: it belongs to the commit, and is the same wherever that is built.
    fn day(&self) -> Option<String> {
        self.git(&["show", "-s", "--format=%cs", "HEAD"])
    }

    fn git(&self, arguments: &[&str]) -> Option<String> {
        let output = Command::new("git").arg("-C").arg(self.0).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
    }
}

/// `name version` of the numeric crates, separated by commas.
fn versions(lock: &Path) -> String {
    let lock = std::fs::read_to_string(lock).unwrap_or_default();
    let field = |line: Option<&str>, key: &str| {
        line.and_then(|l| l.strip_prefix(key)).map(|value| value.trim_matches('"').to_string())
    };
    let mut found = Vec::new();
    let mut lines = lock.lines();
    while let Some(line) = lines.next() {
        let Some(name) = field(Some(line), "name = ") else { continue };
        if NUMERIC_CRATES.contains(&name.as_str())
            && let Some(version) = field(lines.next(), "version = ")
        {
            found.push(format!("{name} {version}"));
        }
    }
    found.join(",")
}

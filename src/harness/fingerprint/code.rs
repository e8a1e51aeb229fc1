//! Which lines of a source text are code? All but comments, blank lines and the tests below them. The build
//! script compiles this file as well: it uses nothing but the standard library.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The code lines of a source text, trimmed, one a line. Tests stand below the code: `mod tests {` ends it.
pub fn lines(source: &str) -> String {
    source
        .lines()
        .map(str::trim)
        .take_while(|line| *line != "mod tests {")
        .filter(|line| !line.is_empty() && !line.starts_with("//") && *line != "#[cfg(test)]")
        .fold(String::new(), |text, line| text + line + "\n")
}

/// The code lines of these files of `root`, and of every `.rs` file but `tests.rs` in these folders and
/// below, in the order of their paths, each file under its path; but for the files `without` and what lies
/// in such folders.
///
/// # Errors
/// A folder or file that cannot be read.
pub fn of_paths(root: &Path, paths: &[&str], without: &[&str]) -> io::Result<String> {
    let mut text = String::new();
    for start in paths {
        let is_left_out = |path: &PathBuf| without.iter().any(|folder| path.starts_with(root.join(folder)));
        for path in rust_files(&root.join(start))?.into_iter().filter(|path| !is_left_out(path)) {
            let inside = path.strip_prefix(root).unwrap_or(&path);
            let name: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
            let source = fs::read_to_string(&path)?;
            text += &format!("{}\n{}", name.join("/"), lines(&source));
        }
    }
    Ok(text)
}

fn rust_files(start: &Path) -> io::Result<Vec<PathBuf>> {
    if start.is_file() {
        return Ok(vec![start.to_path_buf()]);
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(start)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(rust_files(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Crates whose arithmetic stands in the path of a number.
pub const NUMERIC_CRATES: &[&str] = &["libm", "nalgebra", "rand", "rand_chacha", "rand_distr", "statrs"];

/// `name version` of some crates, a line each, of a lock file.
pub fn versions_of(lock: &str, crates: &[&str]) -> String {
    let field =
        |line: &str, key: &str| line.strip_prefix(key).map(|value| value.trim_matches('"').to_string());
    let mut found = String::new();
    let mut lines = lock.lines();
    while let Some(line) = lines.next() {
        let Some(name) = field(line, "name = ").filter(|name| crates.contains(&name.as_str())) else {
            continue;
        };
        if let Some(version) = lines.next().and_then(|line| field(line, "version = ")) {
            found += &format!("{name} {version}\n");
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_are_no_code_change_nothing() {
        let plain = "fn one() -> u8 {\n1\n}\n";
        let told =
            "//! What?\n\n/// One.\nfn one() -> u8 {\n    // why\n    1\n}\n\n#[cfg(test)]\nmod tests {\n}\n";
        assert_eq!(lines(told), plain);
        assert_ne!(lines("fn one() -> u8 { 2 }"), lines("fn one() -> u8 { 1 }"));
    }

    #[test]
    fn every_file_below_counts_with_its_path() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = of_paths(root, &["figure/axis.rs", "fingerprint"], &[]).unwrap();
        let place = |name: &str| text.find(&format!("{name}\n")).unwrap();
        assert!(place("figure/axis.rs") < place("fingerprint/code.rs"));
        let without = of_paths(root, &["figure", "fingerprint"], &["figure"]).unwrap();
        assert!(!without.contains("figure/axis.rs\n") && without.contains("fingerprint/code.rs\n"));
        assert!(of_paths(root, &["nowhere"], &[]).is_err());
    }

    #[test]
    fn versions_are_those_of_the_crates_that_are_asked() {
        let lock = "name = \"image\"\nversion = \"0.25.9\"\n\nname = \"libm\"\nversion = \"0.2.15\"\n";
        assert_eq!(versions_of(lock, &["image"]), "image 0.25.9\n");
        assert_eq!(versions_of(lock, NUMERIC_CRATES), "libm 0.2.15\n");
    }
}

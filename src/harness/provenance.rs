//! With which arithmetic was a record computed? The versions of the numeric crates.
//!
//! Only what belongs to the result is locked in golden/ (seed and inputs); commit and versions stand in out/.

/// Crates whose arithmetic stands in the path of a number.
const NUMERIC_CRATES: [&str; 6] = ["libm", "nalgebra", "rand", "rand_chacha", "rand_distr", "statrs"];

/// Name and version of the crates whose arithmetic stands in the path of a number, from the committed lock file.
pub fn crate_versions() -> Vec<(String, String)> {
    versions_in(include_str!("../../Cargo.lock"))
}

fn versions_in(lock: &str) -> Vec<(String, String)> {
    let field = |line: Option<&str>, key: &str| {
        line.and_then(|l| l.strip_prefix(key)).map(|v| v.trim_matches('"').to_string())
    };
    let mut found = Vec::new();
    let mut lines = lock.lines();
    while let Some(line) = lines.next() {
        let Some(name) = field(Some(line), "name = ") else { continue };
        if NUMERIC_CRATES.contains(&name.as_str())
            && let Some(version) = field(lines.next(), "version = ")
        {
            found.push((name, version));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_versions_of_all_numeric_crates_are_known() {
        let versions = crate_versions();
        for name in NUMERIC_CRATES {
            assert_eq!(versions.iter().filter(|v| v.0 == name).count(), 1, "{name}: {versions:?}");
        }
    }
}

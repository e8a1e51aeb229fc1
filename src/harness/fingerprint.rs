//! Were committed measurements made by the code that runs now? A measurement that takes minutes is not repeated by every check: it carries
//! the fingerprint of the code it depends on, and is stale as soon as a line of that code changes.

#[cfg(test)]
mod code;

use super::hash::sha256_hex;
use super::provenance::crate_versions;

/// Digits that are kept: 64 bits.
const DIGITS: usize = 16;

/// SHA-256 of code lines and of the versions of the numeric crates, its first 16 hexadecimal digits. The build script gathers the lines of
/// the solver and of what measures it, without comments, blank lines and tests:
/// `include_str!(concat!(env!("OUT_DIR"), "/global-minimum.code"))`.
pub fn fingerprint(code_lines: &str) -> String {
    let crates: Vec<String> =
        crate_versions().into_iter().map(|(name, version)| format!("{name} {version}\n")).collect();
    sha256_hex(format!("{code_lines}{}", crates.concat()).as_bytes())[..DIGITS].to_string()
}

/// The fingerprint of the gate and of the solver it tries its planted faults on.
pub fn of_gate_power() -> String {
    fingerprint(include_str!(concat!(env!("OUT_DIR"), "/gate-power.code")))
}

/// The first line of a committed table: the command that wrote it, and the fingerprint.
pub fn head(command: &str, fingerprint: &str) -> String {
    format!("# {command}; fingerprint {fingerprint}")
}

/// The fingerprint in the first line of a committed table; `None` where it has none.
pub fn in_head(table: &str) -> Option<&str> {
    let (_, rest) = table.lines().next()?.rsplit_once("; fingerprint ")?;
    rest.split([' ', ';']).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_line_gives_another_fingerprint() {
        assert_eq!(fingerprint("fn a() {}\n").len(), DIGITS);
        assert_ne!(fingerprint("fn a() {}\n"), fingerprint("fn b() {}\n"));
    }

    #[test]
    fn a_table_tells_its_fingerprint() {
        let table = format!("{}\na,b\n1,2\n", head("calibench x", "0123"));
        assert_eq!(in_head(&table), Some("0123"));
        assert_eq!(in_head("a,b\n"), None);
    }
}

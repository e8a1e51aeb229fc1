//! Were committed measurements made by the code that runs now? A measurement that takes minutes is not
//! repeated by every check: it carries the fingerprint of the code it depends on, and is stale as soon as a
//! line of that code changes, unless the changed code has made a part of its rows again, bit for bit, and the
//! table says so.

pub mod code;

use calibench::io::sha256_hex;

/// Digits that are kept: 64 bits.
const DIGITS: usize = 16;

/// The code that a measurement depends on: SHA-256 of its lines without comments, blank lines and tests, and
/// of the versions of the numeric crates; the first 16 hexadecimal digits. None where the program was built
/// outside the source tree: there nothing can have changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fingerprint(Option<String>);

impl Fingerprint {
    /// The photographs of the experiment detector-gate, how they are judged, and this library's detectors.
    pub fn of_detector_gate() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/detector-gate.code")))
    }

    /// Those photographs and that judgement alone.
    pub fn of_detector_gate_scenes() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/detector-gate-scenes.code")))
    }

    /// The photographs in which wrong boards are looked for, how they are judged, and this library's
    /// detectors.
    pub fn of_wrong_boards() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/wrong-boards.code")))
    }

    /// The gate, and the solver that its planted faults are tried on.
    pub fn of_gate_power() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/gate-power.code")))
    }

    /// The solver, and the scenes and reference of the experiment global-minimum.
    pub fn of_global_minimum() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/global-minimum.code")))
    }

    /// Those scenes and that reference alone.
    pub fn of_global_minimum_scenes() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/global-minimum-scenes.code")))
    }

    /// The solver, and the scenes and reference of the experiment lens-minimum.
    pub fn of_lens_minimum() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/lens-minimum.code")))
    }

    /// The trials of the experiment model-choice, the solver, and the difference over the frame.
    pub fn of_model_choice() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/model-choice.code")))
    }

    /// The trials of the experiment other-solvers, and this library's solver.
    pub fn of_other_solvers() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/other-solvers.code")))
    }

    /// Those trials alone.
    pub fn of_other_solvers_scenes() -> Fingerprint {
        Fingerprint::of(include_str!(concat!(env!("OUT_DIR"), "/other-solvers-scenes.code")))
    }

    fn of(code_lines: &str) -> Fingerprint {
        let hash = || sha256_hex(code_lines.as_bytes())[..DIGITS].to_string();
        Fingerprint((!code_lines.is_empty()).then(hash))
    }

    /// The first line of a table that `command` writes.
    pub fn head(&self, command: &str) -> String {
        format!("# {command}; fingerprint {}", self.0.as_deref().unwrap_or("unknown"))
    }

    /// The first line of a table of which this code has made `again` of `all` rows again, bit for bit: the
    /// line it had, with that in place of what it said of earlier code that did so.
    pub fn head_again(&self, head: &str, again: usize, all: usize) -> String {
        let before = head
            .split_once(CONFIRMED)
            .map_or(head, |(before, _)| before.rsplit_once("; ").map_or(before, |(before, _counts)| before));
        let present = self.0.as_deref().unwrap_or("unknown");
        format!("{before}; {again} of {all}{CONFIRMED}{present}")
    }

    /// Whether the table that `command` writes was written with this fingerprint or confirmed with it.
    pub fn vouches_for(&self, table: &str, command: &str) -> bool {
        let is_of_it = table.starts_with(&format!("# {command}; fingerprint "));
        is_of_it && self.0.as_deref().is_some_and(|present| vouching(table) == Some(present))
    }

    /// A number below `count` that another code has another of.
    pub fn pick(&self, count: usize) -> usize {
        let digits = self.0.as_deref().and_then(|digits| usize::from_str_radix(&digits[..8], 16).ok());
        digits.unwrap_or(0) % count
    }

    /// A case for a claim: whether `table`, committed as `name`, was written with this fingerprint or
    /// confirmed with it, and what to do if not.
    pub fn case(&self, name: &str, table: &str, command: &str) -> (String, bool) {
        let written = vouching(table).unwrap_or("none");
        let Some(present) = &self.0 else { return (format!("{name}: {written}"), true) };
        let what =
            format!("{name} is stale: it has fingerprint {written}, the code {present}; run `{command}`");
        (what, written == present)
    }
}

/// What a first line says between the count of the rows that later code made again and its fingerprint.
const CONFIRMED: &str = " rows made again, the same, with fingerprint ";

/// The fingerprint of the code that has confirmed a table.
fn confirmed(table: &str) -> Option<&str> {
    Some(table.lines().next()?.split_once(CONFIRMED)?.1)
}

/// The fingerprint of the last code that wrote or confirmed a table.
fn vouching(table: &str) -> Option<&str> {
    confirmed(table).or_else(|| written(table))
}

/// The fingerprint in the first line of a table.
fn written(table: &str) -> Option<&str> {
    let (_, rest) = table.lines().next()?.rsplit_once("; fingerprint ")?;
    rest.split([' ', ';']).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_line_makes_a_table_stale() {
        let (before, after) = (Fingerprint::of("fn a() {}\n"), Fingerprint::of("fn b() {}\n"));
        let table = format!("{}\na,b\n1,2\n", before.head("calibench x"));
        assert!(before.case("t.csv", &table, "calibench x").1);
        let (what, held) = after.case("t.csv", &table, "calibench x");
        assert!(!held && what.contains("run `calibench x`"), "{what}");
        assert!(!before.case("t.csv", "a,b\n1,2\n", "calibench x").1);
    }

    #[test]
    fn code_that_made_rows_again_vouches_for_a_table_until_it_changes_too() {
        let [first, second, third] = ["a\n", "b\n", "c\n"].map(Fingerprint::of);
        let head = first.head("calibench x");
        let again = second.head_again(&head, 2, 16);
        assert!(again.starts_with(&format!("{head}; 2 of 16 rows made again, the same, with")), "{again}");
        assert_eq!(written(&again), written(&head));
        let held = |code: &Fingerprint, head: &str| code.case("t.csv", &format!("{head}\na\n1\n"), "x").1;
        assert_eq!([&first, &second, &third].map(|code| held(code, &again)), [false, true, false]);
        assert_eq!([&first, &second].map(|code| code.vouches_for(&again, "calibench x")), [false, true]);
        assert!(first.vouches_for(&head, "calibench x") && !first.vouches_for(&head, "calibench y"));
        let later = third.head_again(&again, 3, 16);
        assert_eq!(later, third.head_again(&head, 3, 16));
        assert_eq!([&second, &third].map(|code| held(code, &later)), [false, true]);
    }

    #[test]
    fn outside_the_source_tree_nothing_is_stale() {
        assert!(Fingerprint::of("").case("t.csv", "# x; fingerprint 01\n", "x").1);
    }

    #[test]
    fn every_measurement_has_its_own_code() {
        let all = [
            Fingerprint::of_detector_gate(),
            Fingerprint::of_detector_gate_scenes(),
            Fingerprint::of_wrong_boards(),
            Fingerprint::of_gate_power(),
            Fingerprint::of_global_minimum(),
            Fingerprint::of_global_minimum_scenes(),
            Fingerprint::of_lens_minimum(),
            Fingerprint::of_model_choice(),
            Fingerprint::of_other_solvers(),
            Fingerprint::of_other_solvers_scenes(),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(a.0.is_some() && all[i + 1..].iter().all(|b| a != b));
        }
    }
}

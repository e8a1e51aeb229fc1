//! What moved? Two snapshots compared line by line; the golden one's bands decide.

use crate::Band;
use std::collections::BTreeMap;

/// The outcome of a comparison.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Comparison {
    /// What left its band, appeared, vanished or was reworded: a failure.
    pub deviations: Vec<String>,
    /// What changed in its bits but stayed in its band: a failure only where bits are promised.
    pub drift: Vec<String>,
    /// Numbers in the golden snapshot.
    pub numbers: usize,
    /// Those of them that lie in their bands.
    pub numbers_held: usize,
}

impl Comparison {
    /// Whether everything lies in its band.
    pub fn held(&self) -> bool {
        self.deviations.is_empty()
    }
}

/// Lines of a snapshot by kind and name.
type Lines<'a> = BTreeMap<(&'a str, &'a str), Vec<&'a str>>;

/// Compares `ours` with `golden`, both as [`super::snapshot`] writes them.
pub fn compare(golden: &str, ours: &str) -> Comparison {
    let (golden, ours) = (read(golden), read(ours));
    let same_bits = golden.get(&("bits", "")) == ours.get(&("bits", ""));
    let mut comparison = Comparison::default();
    for (&(kind, name), fields) in &golden {
        match (kind, ours.get(&(kind, name))) {
            ("bits", _) => {}
            (_, None) => comparison.deviations.push(format!("{kind} {name}: no longer in the record")),
            ("number", Some(now)) => compare_number(&mut comparison, name, fields, now),
            ("table" | "figure", Some(now)) => {
                compare_file(&mut comparison, (kind, name), fields, now, same_bits)
            }
            (_, Some(now)) => {
                if let Some(change) = first_change(fields, now) {
                    comparison.deviations.push(format!("{kind} {name}: {change}"));
                }
            }
        }
        comparison.numbers += usize::from(kind == "number");
    }
    for (kind, name) in ours.keys().filter(|key| !golden.contains_key(*key)) {
        comparison.deviations.push(format!("{kind} {name}: not in the golden snapshot"));
    }
    comparison
}

fn read(text: &str) -> Lines<'_> {
    let mut lines = Lines::new();
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        let mut fields = line.split(" | ").map(str::trim);
        let kind = fields.next().unwrap_or("");
        // These stand once and have no name.
        let name =
            if matches!(kind, "experiment" | "seed" | "bits") { "" } else { fields.next().unwrap_or("") };
        lines.insert((kind, name), fields.collect());
    }
    lines
}

/// Fields: value, unit, width of the band, reason.
fn compare_number(comparison: &mut Comparison, name: &str, golden: &[&str], ours: &[&str]) {
    let parsed = |fields: &[&str]| fields.first().and_then(|f| f.parse::<f64>().ok());
    let band = golden.get(2).and_then(|width| Band::from_width(width));
    let (Some(was), Some(is), Some(band)) = (parsed(golden), parsed(ours), band) else {
        comparison
            .deviations
            .push(format!("number {name}: the snapshot's line cannot be read; bless it anew"));
        return;
    };
    if golden[1..] != ours[1..] {
        let (was, is) = (golden[1..].join(" | "), ours[1..].join(" | "));
        comparison.deviations.push(format!("number {name}: unit or band was `{was}`, is `{is}`"));
    } else if !band.holds(was, is) {
        let (unit, width) = (golden[1], band.width());
        let moved = is - was;
        comparison
            .deviations
            .push(format!("number {name}: {was:?} became {is:?} {unit}, moved by {moved:.3e}, band {width}"));
    } else {
        comparison.numbers_held += 1;
        if was.to_bits() != is.to_bits() {
            comparison.drift.push(format!("number {name}: {was:?} became {is:?}, within its band"));
        }
    }
}

/// With the same bits in every number, the data behind a file may not have changed; when numbers moved inside
/// their bands, the files must have moved with them.
fn compare_file(
    comparison: &mut Comparison,
    (kind, name): (&str, &str),
    golden: &[&str],
    ours: &[&str],
    same_bits: bool,
) {
    if golden != ours {
        let message = format!("{kind} {name}: was `{}`, is `{}`", golden.join(", "), ours.join(", "));
        let list = if same_bits { &mut comparison.deviations } else { &mut comparison.drift };
        list.push(message);
    }
}

/// The ends of intervals are computed: they may differ in the digits that a rounding could reach.
const INTERVAL_TOLERANCE: f64 = 1e-4;

/// The first field that differs, numbers compared as such.
fn first_change(golden: &[&str], ours: &[&str]) -> Option<String> {
    if golden.len() != ours.len() {
        return Some("the line has another form".to_string());
    }
    golden
        .iter()
        .zip(ours)
        .enumerate()
        .find(|&(index, (was, is))| !same_field(index, was, is))
        .map(|(_, (was, is))| format!("was `{was}`, is `{is}`"))
}

/// The first two fields of claims and published values are the ends of an interval.
fn same_field(index: usize, was: &str, is: &str) -> bool {
    let number = |text: &str| text.parse::<f64>().ok().filter(|v| v.is_finite());
    match (number(was), number(is)) {
        (Some(a), Some(b)) if index < 2 => (a - b).abs() <= INTERVAL_TOLERANCE * a.abs(),
        _ => was == is,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLDEN: &str = "experiment | e\nseed | 0\nbits | aa\n\
        number | n | 4.0 | px | absolute 0.5 | why\n\
        claim | c | 0.00000 | 1.00000 | px | nothing drawn | it is small | theory\n\
        table | t | 3 rows | sha256 01\n";

    fn changed(from: &str, to: &str) -> Comparison {
        assert!(GOLDEN.contains(from));
        compare(GOLDEN, &GOLDEN.replace(from, to))
    }

    #[test]
    fn a_snapshot_equals_itself() {
        let comparison = compare(GOLDEN, GOLDEN);
        assert!(comparison.held() && comparison.drift.is_empty());
        assert_eq!((comparison.numbers, comparison.numbers_held), (1, 1));
    }

    #[test]
    fn the_golden_band_decides() {
        let drifted = changed("4.0", "4.5");
        assert!(drifted.held() && drifted.drift.len() == 1);
        assert!(!changed("4.0", "4.6").held());
        assert!(!changed("4.0", "NaN").held());
        assert!(!changed("absolute 0.5", "absolute 5.0").held(), "loosening a band needs a blessing");
    }

    #[test]
    fn what_appears_vanishes_or_is_reworded_is_named() {
        let gone = changed("number | n | 4.0 | px | absolute 0.5 | why\n", "");
        assert_eq!(gone.deviations, ["number n: no longer in the record"]);
        assert!(!changed("it is small", "it is smaller").held());
        assert!(!changed("seed | 0", "seed | 1").held());
        let interval = changed("| 1.00000 |", "| 1.00001 |");
        assert!(interval.held());
        assert!(!changed("| 1.00000 |", "| 1.10000 |").held());
        assert!(!compare("", GOLDEN).held());
    }

    #[test]
    fn a_table_may_move_only_with_the_numbers() {
        assert!(!changed("sha256 01", "sha256 02").held());
        let both =
            compare(GOLDEN, &GOLDEN.replace("sha256 01", "sha256 02").replace("bits | aa", "bits | bb"));
        assert!(both.held() && both.drift.len() == 1);
    }
}

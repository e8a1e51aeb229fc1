//! What became of every scene? A line each, as it is committed in golden/global-minimum/.

use super::judged::{Class, Judged};
use calibench::io::sha256_hex;

/// The columns of a line.
pub const HEADER: &str = "index,views,tilt_deg,bound,class,warnings,excess,note,z,bits";

/// A bound on sd(fx)/fx below which the data determine the camera.
pub const DETERMINED: f64 = 0.02;
/// Hexadecimal digits of the estimate's fingerprint.
const BITS: usize = 8;

/// A scene in short.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its number in the family.
    pub index: u64,
    /// Number of views.
    pub views: usize,
    /// Largest tilt, degrees.
    pub tilt_deg: f64,
    /// Cramer-Rao bound of sd(fx) over fx; infinite where the scene determines nothing.
    pub bound: f64,
    /// How it ended.
    pub class: Class,
    /// A letter a kind of warning, see [`letter`].
    pub warnings: String,
    /// Cost above the reference's over the noise variance; 0 where it is the reference's or none was given.
    pub excess: f64,
    /// The termination, the error, or fx where it is wrong.
    pub note: String,
    /// Error over stated standard deviation of every free parameter of the scene's model, in order.
    pub z: Vec<f64>,
    /// Fingerprint of the bits of the estimate, of its cost and of the reference.
    pub bits: String,
}

/// The letter of a warning that questions the standard deviations; a correlation does not.
fn letter(warning: &str) -> Option<char> {
    match warning {
        "Correlated" => None,
        "AboveFloor" => Some('a'),
        "FocalLengthUncertain" => Some('f'),
        "NotLinear" => Some('l'),
        "Ambiguous" => Some('m'),
        "FoldsInsideImage" => Some('b'),
        "NoDegreesOfFreedom" => Some('d'),
        "FewDegreesOfFreedom" => Some('s'),
        "NotCertified" => Some('c'),
        "TwinPose" => Some('t'),
        "NotConverged" => Some('n'),
        _ => Some('o'),
    }
}

impl Line {
    /// What is committed of a scene.
    pub fn of(judged: &Judged) -> Line {
        let found = judged.found.as_ref();
        let mut warnings: Vec<char> =
            found.map_or(Vec::new(), |f| f.warnings.iter().filter_map(|w| letter(w)).collect());
        warnings.sort_unstable();
        warnings.dedup();
        let excess = found.filter(|_| judged.class != Class::Right).map_or(0.0, |f| f.excess);
        let note = match (judged.class, found) {
            (Class::Right, _) => String::new(),
            (Class::Wrong, Some(f)) => {
                format!("fx {:.1} +- {:.1} for {:.1}", f.fx, f.fx_sd, judged.reference_fx)
            }
            _ => judged.ending.clone(),
        };
        let z = found.filter(|_| judged.class == Class::Right).map_or(Vec::new(), |f| f.z.clone());
        Line {
            index: judged.index,
            views: judged.views,
            tilt_deg: judged.tilt_deg,
            bound: judged.bound,
            class: judged.class,
            warnings: warnings.into_iter().collect(),
            excess,
            note,
            z,
            bits: sha256_hex(&judged.bits)[..BITS].to_string(),
        }
    }

    /// The line as CSV, rounded to what the claims need; `bits` keeps the rest.
    pub fn text(&self) -> String {
        let z: Vec<String> = self.z.iter().map(|z| format!("{z:.2}")).collect();
        let excess = if self.excess == 0.0 { String::new() } else { format!("{:.2e}", self.excess) };
        format!(
            "{},{},{:.1},{:.2e},{},{},{excess},{},{},{}",
            self.index,
            self.views,
            self.tilt_deg,
            self.bound,
            self.class.name(),
            self.warnings,
            self.note,
            z.join(" "),
            self.bits
        )
    }

    /// Reads [`Line::text`].
    pub fn read(text: &str) -> Option<Line> {
        let cells: Vec<&str> = text.split(',').collect();
        let [index, views, tilt, bound, class, warnings, excess, note, z, bits] = cells.as_slice() else {
            return None;
        };
        let z: Option<Vec<f64>> = z.split_whitespace().map(|z| z.parse().ok()).collect();
        Some(Line {
            index: index.parse().ok()?,
            views: views.parse().ok()?,
            tilt_deg: tilt.parse().ok()?,
            bound: bound.parse().ok()?,
            class: Class::ALL.into_iter().find(|c| c.name() == *class)?,
            warnings: warnings.to_string(),
            excess: if excess.is_empty() { 0.0 } else { excess.parse().ok()? },
            note: note.to_string(),
            z: z?,
            bits: bits.to_string(),
        })
    }

    /// Whether the data determine the camera.
    pub fn is_determined(&self) -> bool {
        self.bound < DETERMINED
    }
}

//! Which sheets of paper are there?

use std::fmt;
use std::str::FromStr;

/// A sheet of paper: one with a name lies wide, another as it was said.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Paper {
    name: String,
    pub width_mm: f64,
    pub height_mm: f64,
}

/// ISO 216 and the North American sheets (ANSI/ASME Y14.1; legal has no standard), mm.
const SHEETS: [(&str, f64, f64); 9] = [
    ("A5", 210.0, 148.0),
    ("A4", 297.0, 210.0),
    ("A3", 420.0, 297.0),
    ("A2", 594.0, 420.0),
    ("A1", 841.0, 594.0),
    ("A0", 1189.0, 841.0),
    ("letter", 279.4, 215.9),
    ("legal", 355.6, 215.9),
    ("tabloid", 431.8, 279.4),
];

/// Longest side of a sheet, mm: more than a PDF's page may have (14400 points) no program prints.
const LONGEST_MM: f64 = 5080.0;

impl FromStr for Paper {
    type Err = String;

    fn from_str(text: &str) -> Result<Paper, String> {
        if let Some((name, width_mm, height_mm)) =
            SHEETS.into_iter().find(|(name, ..)| name.eq_ignore_ascii_case(text))
        {
            return Ok(Paper { name: name.to_string(), width_mm, height_mm });
        }
        let names = SHEETS.map(|(name, ..)| name).join(", ");
        let wanted = || format!("expected {names}, or WIDTHxHEIGHT in millimetres, such as 500x400");
        let (a, b) = text.trim_end_matches("mm").split_once('x').ok_or_else(wanted)?;
        let side = |text: &str| {
            text.trim()
                .parse()
                .ok()
                .filter(|side: &f64| *side > 0.0 && *side <= LONGEST_MM)
                .ok_or_else(wanted)
        };
        Ok(Paper { name: "paper".to_string(), width_mm: side(a)?, height_mm: side(b)? })
    }
}

impl Paper {
    /// The smallest ISO sheet on which something fits.
    pub fn smallest(fits: impl Fn(&Paper) -> bool) -> Option<Paper> {
        let sheets = SHEETS.into_iter().filter(|(name, ..)| name.starts_with('A'));
        sheets
            .map(|(name, width_mm, height_mm)| Paper { name: name.to_string(), width_mm, height_mm })
            .find_map(|paper| paper.either_way().into_iter().find(|paper| fits(paper)))
    }

    /// The sheet as it lies, and turned by a quarter.
    pub fn either_way(&self) -> [Paper; 2] {
        let turned = Paper { name: self.name.clone(), width_mm: self.height_mm, height_mm: self.width_mm };
        [self.clone(), turned]
    }
}

impl fmt::Display for Paper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} x {} mm)", self.name, self.width_mm, self.height_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_known_by_name_in_any_case_and_by_size() {
        let a4: Paper = "a4".parse().unwrap();
        assert_eq!((a4.width_mm, a4.height_mm, a4.to_string().as_str()), (297.0, 210.0, "A4 (297 x 210 mm)"));
        let own: Paper = "400x500mm".parse().unwrap();
        assert_eq!((own.width_mm, own.height_mm), (400.0, 500.0));
        for wrong in ["A", "b4", "0x5", "5", "-3x4", "nanx4", "6000x10"] {
            assert!(wrong.parse::<Paper>().unwrap_err().contains("letter"), "{wrong}");
        }
        assert_eq!(Paper::smallest(|p| p.height_mm > 250.0 && p.width_mm > 250.0).unwrap().name, "A3");
        let upright = Paper::smallest(|p| p.height_mm > 250.0).unwrap();
        assert_eq!(upright.to_string(), "A4 (210 x 297 mm)");
    }
}

//! How far may a locked number move before it counts as changed? Exactly nowhere, or within a stated band.

/// The tolerance of a golden number, with its reason. It is stored in the snapshot, so loosening one shows in
/// review.
#[derive(Debug, Clone, PartialEq)]
pub enum Band {
    /// Not a bit may change.
    Exact,
    /// `|ours - golden| <= half_width`, in the number's unit.
    Absolute {
        /// Largest accepted difference.
        half_width: f64,
        /// Why this much and no more.
        reason: String,
    },
    /// `|ours - golden| <= fraction |golden|`.
    Relative {
        /// Largest accepted difference as a fraction of the golden value.
        fraction: f64,
        /// Why this much and no more.
        reason: String,
    },
}

impl Band {
    /// An absolute band, in the number's unit.
    pub fn absolute(half_width: f64, reason: impl Into<String>) -> Band {
        Band::Absolute { half_width, reason: reason.into() }
    }

    /// A relative band.
    pub fn relative(fraction: f64, reason: impl Into<String>) -> Band {
        Band::Relative { fraction, reason: reason.into() }
    }

    /// Whether `ours` lies in the band around `golden`. A number that is not finite equals only itself.
    pub fn holds(&self, golden: f64, ours: f64) -> bool {
        let same = golden.to_bits() == ours.to_bits();
        match self {
            Band::Exact => same,
            Band::Absolute { half_width, .. } => same || (ours - golden).abs() <= *half_width,
            Band::Relative { fraction, .. } => same || (ours - golden).abs() <= fraction * golden.abs(),
        }
    }

    /// Why the band is as wide as it is.
    pub fn reason(&self) -> &str {
        match self {
            Band::Exact => "the same bits on every machine",
            Band::Absolute { reason, .. } | Band::Relative { reason, .. } => reason,
        }
    }

    /// The width as it stands in a snapshot: `exact`, `absolute 1e-9`, `relative 1e-6`.
    pub fn width(&self) -> String {
        match self {
            Band::Exact => "exact".to_string(),
            Band::Absolute { half_width, .. } => format!("absolute {half_width:?}"),
            Band::Relative { fraction, .. } => format!("relative {fraction:?}"),
        }
    }

    /// Reads [`Band::width`] back; the reason stands elsewhere.
    pub(crate) fn from_width(text: &str) -> Option<Band> {
        if text == "exact" {
            return Some(Band::Exact);
        }
        let (kind, value) = text.split_once(' ')?;
        let value = value.parse().ok()?;
        match kind {
            "absolute" => Some(Band::absolute(value, "")),
            "relative" => Some(Band::relative(value, "")),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_accepts_its_edge_and_nothing_beyond() {
        let band = Band::absolute(0.5, "half");
        assert!(band.holds(10.0, 10.5) && !band.holds(10.0, 10.6));
        let band = Band::relative(0.5, "half");
        assert!(band.holds(-4.0, -2.0) && !band.holds(-4.0, -1.9));
        assert!(Band::Exact.holds(0.1, 0.1) && !Band::Exact.holds(0.1, 0.1 + 1e-17 + 2e-17));
    }

    #[test]
    fn a_number_that_is_not_finite_equals_only_itself() {
        for band in [Band::Exact, Band::absolute(1.0, ""), Band::relative(1.0, "")] {
            assert!(band.holds(f64::NAN, f64::NAN));
            assert!(!band.holds(1.0, f64::NAN) && !band.holds(f64::NAN, 1.0));
        }
    }

    #[test]
    fn a_width_is_read_as_it_is_written() {
        for band in [Band::Exact, Band::absolute(1e-9, ""), Band::relative(0.25, "")] {
            assert_eq!(Band::from_width(&band.width()), Some(band));
        }
        assert_eq!(Band::from_width("about right"), None);
    }
}

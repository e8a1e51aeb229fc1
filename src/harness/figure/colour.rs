//! How are series told apart, in colour, in grey and by readers who do not see some colours?

/// An opaque colour, red, green and blue.
pub type Rgb = (u8, u8, u8);

/// Okabe & Ito (2008), chosen to stay apart for readers with any of the common colour deficiencies. Their
/// yellow is left out: it does not show as a line on white.
const SERIES: [Rgb; 7] =
    [(0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0), (0, 0, 0)];

/// Text and axes.
pub const INK: Rgb = (32, 32, 32);
/// Grid lines.
pub const GRID: Rgb = (222, 222, 222);
/// Behind everything, so that a figure reads on a dark page too.
pub const PAPER: Rgb = (255, 255, 255);

/// Pattern of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dash {
    /// Unbroken.
    Solid,
    /// Long strokes.
    Dashed,
    /// Points.
    Dotted,
    /// Stroke, point, stroke.
    DashDot,
}

impl Dash {
    const ALL: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted];

    /// Lengths of stroke and gap in turn, px; empty for an unbroken line.
    pub(super) fn pattern(self) -> &'static [f64] {
        match self {
            Dash::Solid => &[],
            Dash::Dashed => &[7.0, 4.0],
            Dash::Dotted => &[1.5, 3.0],
            Dash::DashDot => &[7.0, 3.0, 1.5, 3.0],
        }
    }
}

/// Shape of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Filled disc.
    Disc,
    /// Open circle.
    Circle,
    /// Filled square.
    Square,
    /// Filled triangle.
    Triangle,
    /// Filled diamond.
    Diamond,
    /// Diagonal cross.
    Cross,
    /// Upright cross.
    Plus,
    /// Small disc, for clouds of many points.
    Dot,
}

impl Marker {
    const ALL: [Marker; 7] = [
        Marker::Disc,
        Marker::Square,
        Marker::Triangle,
        Marker::Diamond,
        Marker::Cross,
        Marker::Circle,
        Marker::Plus,
    ];
}

/// Appearance of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    pub(super) colour: Rgb,
    pub(super) dash: Dash,
    pub(super) marker: Marker,
    pub(super) width_px: f64,
    pub(super) size_px: f64,
}

impl Look {
    /// The `index`-th appearance: colour, dash pattern and marker all differ from its neighbours'.
    pub fn series(index: usize) -> Look {
        Look {
            colour: SERIES[index % SERIES.len()],
            dash: Dash::ALL[index % Dash::ALL.len()],
            marker: Marker::ALL[index % Marker::ALL.len()],
            width_px: 1.6,
            size_px: 3.2,
        }
    }

    /// Dark grey, unbroken: truth, targets and whatever the eye should measure others against.
    pub fn ink() -> Look {
        Look { colour: INK, dash: Dash::Solid, marker: Marker::Plus, width_px: 1.2, size_px: 4.0 }
    }

    /// The same with another dash pattern.
    pub fn dash(self, dash: Dash) -> Look {
        Look { dash, ..self }
    }

    /// The same with another marker.
    pub fn marker(self, marker: Marker) -> Look {
        Look { marker, ..self }
    }

    /// The same with another line width.
    pub fn width(self, width_px: f64) -> Look {
        Look { width_px, ..self }
    }

    /// The same with another marker size (half its width).
    pub fn size(self, size_px: f64) -> Look {
        Look { size_px, ..self }
    }
}

/// Viridis (Smith & van der Walt 2015) at nine even steps; its lightness grows evenly, so it survives
/// greyscale.
const VIRIDIS: [Rgb; 9] = [
    (68, 1, 84),
    (71, 44, 122),
    (59, 81, 139),
    (44, 113, 142),
    (33, 144, 141),
    (39, 173, 129),
    (92, 200, 99),
    (170, 220, 50),
    (253, 231, 37),
];

/// The colour of `fraction` in 0 ... 1 on the heat scale.
pub(super) fn heat(fraction: f64) -> Rgb {
    let place = fraction.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let index = (place as usize).min(VIRIDIS.len() - 2);
    let weight = place - index as f64;
    let (a, b) = (VIRIDIS[index], VIRIDIS[index + 1]);
    let mix = |a: u8, b: u8| (f64::from(a) + weight * (f64::from(b) - f64::from(a))).round() as u8;
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// Black or white, whichever is read better on `background` (Rec. 601 luma).
pub(super) fn text_on(background: Rgb) -> Rgb {
    let (r, g, b) = background;
    let luma = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
    if luma > 140.0 { INK } else { PAPER }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_series_differ_in_colour_dash_and_marker() {
        for i in 0..20 {
            let (a, b) = (Look::series(i), Look::series(i + 1));
            assert!(a.colour != b.colour && a.dash != b.dash && a.marker != b.marker);
        }
    }

    #[test]
    fn the_heat_scale_grows_lighter_all_the_way() {
        let luma = |c: Rgb| 0.299 * f64::from(c.0) + 0.587 * f64::from(c.1) + 0.114 * f64::from(c.2);
        let steps: Vec<f64> = (0..=100).map(|i| luma(heat(f64::from(i) / 100.0))).collect();
        assert!(steps.windows(2).all(|w| w[1] >= w[0] - 1.0), "{steps:?}");
        assert_eq!(heat(f64::NAN.max(0.0)), VIRIDIS[0]);
    }
}

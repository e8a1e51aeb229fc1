//! Where do the ticks of an axis stand, and what do they say?

use calibench::io::significant;

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scale {
    Linear,
    Log,
}

/// An axis: label, scale, and the range of values that is shown.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    pub label: String,
    pub scale: Scale,
    /// Set by the user; otherwise the data decide.
    pub fixed: Option<(f64, f64)>,
    /// Largest value at the start: image rows grow downwards.
    pub reversed: bool,
}

/// A tick: its value and its text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub value: f64,
    pub text: String,
}

/// An axis with its range known: values to fractions 0 ... 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub scale: Scale,
    pub low: f64,
    pub high: f64,
    pub reversed: bool,
}

impl Axis {
    pub(super) fn new(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), scale: Scale::Linear, fixed: None, reversed: false }
    }

    /// The span that shows all `values` with a margin, or the fixed range. Values that cannot be shown do not
    /// count.
    pub(super) fn span(&self, values: impl Iterator<Item = f64>) -> Span {
        let span = |low, high| Span { scale: self.scale, low, high, reversed: self.reversed };
        if let Some((low, high)) = self.fixed {
            return span(low, high);
        }
        let shown = values.filter(|v| v.is_finite() && (self.scale == Scale::Linear || *v > 0.0));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        match self.scale {
            _ if low > high => span(0.1, 1.0),
            Scale::Linear => {
                let margin = if high > low { 0.05 * (high - low) } else { 0.5 * low.abs().max(1.0) };
                span(low - margin, high + margin)
            }
            Scale::Log => span(low / 1.25, high * 1.25),
        }
    }
}

impl Span {
    /// Where `value` stands between the ends, 0 ... 1; outside or NaN beyond.
    pub(super) fn fraction(&self, value: f64) -> f64 {
        let fraction = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => {
                let decades = |v: f64| libm::log10(v / self.low);
                decades(value) / decades(self.high)
            }
        };
        if self.reversed { 1.0 - fraction } else { fraction }
    }

    /// About `wanted` ticks at round values.
    pub(super) fn ticks(&self, wanted: usize) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => linear_ticks(self.low, self.high, wanted),
            Scale::Log => log_ticks(self.low, self.high, wanted),
        }
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, up to half as many again as wanted.
fn linear_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    let raw = (high - low) / wanted.max(1) as f64;
    if !(raw > 0.0 && raw.is_finite()) {
        return Vec::new();
    }
    let decade = libm::floor(libm::log10(raw)) as i32;
    let (mantissa, decade) = [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| (m, decade))
        .chain([(1.0, decade + 1)])
        .find(|&(m, d)| m * power_of_ten(d) >= 0.7 * raw)
        .unwrap_or((1.0, decade + 1));
    let step = mantissa * power_of_ten(decade);
    let decimals = (-decade).max(0) as usize;
    let first = libm::ceil(low / step - 1e-9) as i64;
    let last = libm::floor(high / step + 1e-9) as i64;
    let text = |value: f64| {
        let large = value.abs() >= 1e6 || decimals > 5;
        let plain = if large { significant(value, 3) } else { format!("{value:.decimals$}") };
        plain.replace('-', "\u{2212}")
    };
    // Adding zero turns -0 into 0.
    (first..=last).map(|k| k as f64 * step + 0.0).map(|value| Tick { value, text: text(value) }).collect()
}

/// Fewer ticks do not tell how an axis is divided.
const FEWEST_LOG_TICKS: usize = 3;

/// Powers of ten; with few of them in view, their multiples by 2 and 5 as well, and with fewer those by 3 and
/// 7 too. All are plain digits, or all that are powers of ten are raised.
fn log_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let (first, last) = (libm::floor(libm::log10(low)) as i32, libm::ceil(libm::log10(high)) as i32);
    let decades = (last - first).max(1) as usize;
    let stride = decades.div_ceil(wanted.max(1)).max(1);
    let inside = |v: f64| v >= low * (1.0 - 1e-9) && v <= high * (1.0 + 1e-9);
    let places = |multiples: &'static [f64]| -> Vec<(f64, i32)> {
        let all = (first..=last).step_by(stride).flat_map(|d| multiples.iter().map(move |&m| (m, d)));
        all.filter(|&(m, d)| inside(m * power_of_ten(d))).collect()
    };
    let powers = (first..=last).filter(|&d| inside(power_of_ten(d))).count();
    let few = high / low <= 100.0 || powers < FEWEST_LOG_TICKS;
    let mut chosen = places(if few { &[1.0, 2.0, 5.0] } else { &[1.0] });
    if few && chosen.len() < FEWEST_LOG_TICKS {
        chosen = places(&[1.0, 2.0, 3.0, 5.0, 7.0]);
    }
    let raised = chosen.iter().any(|&(_, d)| !is_plain(d));
    chosen
        .into_iter()
        .map(|(m, d)| Tick { value: m * power_of_ten(d), text: log_text(m, d, raised) })
        .collect()
}

/// Whether `0.001 ... 5000` are written with all their digits.
fn is_plain(decade: i32) -> bool {
    (-3..4).contains(&decade)
}

/// Plain digits, or a power of ten with a raised exponent.
fn log_text(multiple: f64, decade: i32, raised: bool) -> String {
    if decade == 0 || !raised {
        let decimals = (-decade).max(0) as usize;
        return format!("{:.decimals$}", multiple * power_of_ten(decade));
    }
    let raised: String = decade.to_string().chars().map(raise).collect();
    if multiple == 1.0 { format!("10{raised}") } else { format!("{multiple}\u{b7}10{raised}") }
}

fn raise(digit: char) -> char {
    match digit {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        d => d.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(d),
    }
}

/// `10^decade`, correctly rounded: the decimal literal is read, not computed.
fn power_of_ten(decade: i32) -> f64 {
    format!("1e{decade}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|t| t.text.as_str()).collect()
    }

    #[test]
    fn linear_ticks_stand_at_round_values() {
        assert_eq!(texts(&linear_ticks(-0.24, 0.24, 5)), ["\u{2212}0.2", "\u{2212}0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(texts(&linear_ticks(20.0, 620.0, 6)), ["100", "200", "300", "400", "500", "600"]);
        assert!(linear_ticks(1.0, 1.0, 5).is_empty());
    }

    #[test]
    fn log_ticks_are_powers_of_ten_or_their_simple_multiples() {
        assert_eq!(
            texts(&log_ticks(1e-6, 1.0, 4)),
            ["10\u{207b}\u{2076}", "10\u{207b}\u{2074}", "10\u{207b}\u{b2}", "1"]
        );
        assert_eq!(texts(&log_ticks(0.12, 0.6, 4)), ["0.2", "0.3", "0.5"]);
        assert_eq!(texts(&log_ticks(0.9, 12.0, 4)), ["1", "2", "5", "10"]);
        assert!(log_ticks(0.0, 1.0, 4).is_empty());
    }

    #[test]
    fn a_span_holds_its_data_and_maps_its_ends() {
        let mut axis = Axis::new("x");
        let span = axis.span([1.0, 3.0, f64::NAN].into_iter());
        assert!(span.low < 1.0 && span.high > 3.0);
        assert_eq!((span.fraction(span.low), span.fraction(span.high)), (0.0, 1.0));
        axis.scale = Scale::Log;
        let span = axis.span([0.0, 1e-3, 10.0].into_iter());
        assert!(span.low > 0.0 && (span.fraction(0.1) - 0.5).abs() < 1e-12);
        axis.reversed = true;
        assert_eq!(axis.span([1.0, 2.0].into_iter()).fraction(1.0 / 1.25), 1.0);
    }
}

//! Which orders of four numbers could a row have, and which does a known truth refuse?

use calibench::calibrate::Covariance;
use calibench::camera::{Camera, Parameter};

/// The reader's guess of row 0 from its second entry: the order in which everybody names them.
pub(crate) const LINEAR: [Parameter; 4] = [Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy];
/// Row 1.
pub(crate) const DISTORTION: [Parameter; 4] = [Parameter::K1, Parameter::K2, Parameter::P1, Parameter::P2];

/// A layout: which parameter each of the four entries is taken for.
type Layout = [Parameter; 4];

/// All layouts of a row, judged against a truth.
pub(crate) struct Row {
    /// With whether the truth accepts it, and whether it is indistinguishable from the right one.
    judged: Vec<(Layout, bool)>,
    right: Layout,
    truth: [f64; 4],
}

impl Row {
    /// Judges every order. A layout is refused if any entry lies more than `limit` standard deviations from
    /// the truth of the parameter that it is taken for. Parameters of equal truth share the largest of their
    /// deviations: which of them an entry belongs to cannot be told, so it may carry the noise of any.
    pub(crate) fn judge(
        entries: &[f64],
        parameters: Layout,
        truth: &Camera,
        bound: &Covariance,
        limit: f64,
    ) -> Row {
        let right = right_layout(parameters);
        let sd = |p: Parameter| {
            let equal = parameters.iter().filter(|&&q| truth.get(q) == truth.get(p));
            equal.filter_map(|&q| bound.standard_deviation(q)).fold(0.0, f64::max)
        };
        let accepts = |layout: &Layout| {
            let within = |(entry, &p): (&f64, &Parameter)| (entry - truth.get(p)).abs() <= limit * sd(p);
            entries.iter().zip(layout).all(within)
        };
        let judged = orders(parameters).into_iter().map(|layout| (layout, accepts(&layout))).collect();
        Row { judged, right, truth: parameters.map(|p| truth.get(p)) }
    }

    /// Number of layouts, the right one among them.
    pub(crate) fn layouts(&self) -> usize {
        self.judged.len()
    }

    /// Wrong layouts that the truth accepts.
    pub(crate) fn hidden(&self) -> usize {
        self.judged.iter().filter(|(layout, accepted)| *accepted && *layout != self.right).count()
    }

    /// `prod m_i! - 1` over the values that occur `m_i` times.
    pub(crate) fn predicted_hidden(&self) -> usize {
        let mut sorted = self.truth;
        sorted.sort_by(f64::total_cmp);
        let factorial = |m: usize| (1..=m).product::<usize>();
        let product: usize = sorted.chunk_by(|a, b| a == b).map(|same| factorial(same.len())).product();
        product - 1
    }

    /// Whether the truth refuses a layout.
    pub(crate) fn exposes(&self, layout: &Layout) -> bool {
        self.judged.iter().any(|(known, accepted)| known == layout && !accepted)
    }

    pub(crate) fn right_is_accepted(&self) -> bool {
        self.judged.iter().any(|(layout, accepted)| *layout == self.right && *accepted)
    }
}

/// The order in which the black box really writes a row.
fn right_layout(parameters: Layout) -> Layout {
    match parameters {
        LINEAR => [Parameter::Fx, Parameter::Cx, Parameter::Fy, Parameter::Cy],
        other => other,
    }
}

/// The 24 orders of four.
fn orders(parameters: Layout) -> Vec<Layout> {
    let mut all = Vec::new();
    for code in 0..256usize {
        let pick = [code & 3, (code >> 2) & 3, (code >> 4) & 3, (code >> 6) & 3];
        let distinct = (0..4).all(|i| (0..i).all(|j| pick[i] != pick[j]));
        if distinct {
            all.push(pick.map(|i| parameters[i]));
        }
    }
    all
}

//! How are judged scenes shown to people? A line of CSV each with every number, and a line of counts a
//! family.

use super::committed::DETERMINED;
use super::families::Family;
use super::judged::{Class, Judged};
use calibench::camera::Parameter;
use calibench::io::significant;

/// The columns of [`line`].
pub const HEADER: &str = "family,index,layout,model,views,points,fx,width,noise,tilt,coverage,size_given,bound,freedom,reference,\
    reference_converged,reference_fx,class,ending,excess,fx_est,fx_sd,rmse,nees,time_us,warnings,\
    z_fx,z_fy,z_cx,z_cy,z_skew,z_k1,z_k2,z_p1,z_p2,z_k3\n";

/// A scene with every number.
pub fn line(family: &Family, row: &Judged) -> String {
    let found = row.found.as_ref();
    let z = |p| found.and_then(|f| Some(f.z[row.free.position(p)?])).unwrap_or(f64::NAN);
    let result = found.map_or([f64::NAN; 5], |f| [f.excess, f.fx, f.fx_sd, f.rmse_px, f.nees]);
    let scene = [row.fx_true, row.width_px as f64, row.noise_px, row.tilt_deg, row.coverage];
    let warnings = found.map_or(String::new(), |f| f.warnings.join(" "));
    format!(
        "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.0},{warnings},{}",
        family.name,
        row.index,
        row.layout,
        row.model,
        row.views,
        row.points,
        cells(&scene),
        u8::from(row.size_given),
        cells(&[row.bound]),
        row.freedom,
        cells(&[row.reference]),
        u8::from(row.reference_converged),
        cells(&[row.reference_fx]),
        row.class,
        row.ending,
        cells(&result),
        row.time_us,
        cells(&Parameter::ALL.map(z))
    )
}

/// Six significant digits each; empty for NaN.
fn cells(numbers: &[f64]) -> String {
    let text = |x: &f64| if x.is_nan() { String::new() } else { significant(*x, 6) };
    numbers.iter().map(text).collect::<Vec<_>>().join(",")
}

/// Over [`summary`].
pub const SUMMARY_HEADER: &str = "                                   all                          |  bound of sd(fx)/fx below 2 %\n\
    family                 scenes  right  wrong not-conv  refused |  right  wrong not-conv  refused |  us/scene  largest excess of the accepted";

/// Counts of a family.
pub fn summary(family: &Family, rows: &[Judged]) -> String {
    let counts = |most: f64| {
        let count = |class| rows.iter().filter(|r| r.class == class && r.bound < most).count();
        let all = |class| rows.iter().filter(|r| r.class == class).count();
        let [right, wrong, open, refused] =
            Class::ALL.map(|c| if most.is_finite() { count(c) } else { all(c) });
        format!("{right:>6} {wrong:>6} {open:>8} {refused:>8}")
    };
    let time = rows.iter().map(|r| r.time_us).sum::<f64>() / rows.len() as f64;
    let excess = |r: &&Judged| r.found.as_ref().map_or(0.0, |f| f.excess);
    let worst =
        rows.iter().filter(|r| r.class == Class::Wrong).max_by(|a, b| excess(a).total_cmp(&excess(b)));
    let worst = worst.and_then(|r| Some((r, r.found.as_ref()?))).map_or(String::new(), |(r, f)| {
        format!(
            "#{} fx {:.1} +- {:.1} for {:.1}, {:.2e} variances",
            r.index, f.fx, f.fx_sd, r.reference_fx, f.excess
        )
    });
    let open = rows.iter().filter(|r| !r.reference_converged).count();
    let below = rows
        .iter()
        .filter(|r| r.found.as_ref().is_some_and(|f| f.excess < -1e-3 - 1e-6 * r.reference))
        .count();
    format!(
        "{:22} {:>6} {} | {} | {time:>9.0}  {worst}\n    references that are no minimum {open}, answers below the reference {below}",
        family.name,
        rows.len(),
        counts(f64::INFINITY),
        counts(DETERMINED)
    )
}

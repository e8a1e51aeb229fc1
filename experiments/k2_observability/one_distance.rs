//! Is it the corners or the distance? The target stays at one distance and is moved, each view towards
//! another corner.

use super::*;
use calibench_harness::{Dash, Figure, Look, Plot};

/// Distances of the target's centre along the optical axis, mm.
const DISTANCES_MM: [u32; 3] = [260, 200, 160];
const TILTS_DEG: [u32; 3] = [5, 20, 45];
/// Distance and tilt that the text speaks of.
const SHOWN_MM: u32 = 200;
const SHOWN_DEG: u32 = 20;
/// Each view moves towards its own corner, along the diagonal of the target.
const CORNERS: [(f64, f64); 4] = [(4.0, 3.0), (-4.0, 3.0), (-4.0, -3.0), (4.0, -3.0)];

/// A scene of the second sweep: views of one distance.
struct Moved {
    distance_mm: u32,
    node: Node,
}

/// The scenes that exist: a target that is near already reaches farther than the least coverages.
fn sweep(context: &Context) -> Result<Vec<Moved>, ExperimentError> {
    let mut scenes = Vec::new();
    for distance_mm in DISTANCES_MM {
        for tilt_deg in TILTS_DEG {
            for tenths in COVERAGE_TENTHS {
                let poses =
                    moved_poses(f64::from(distance_mm), f64::from(tilt_deg), f64::from(tenths) / 10.0);
                scenes.extend(poses.map(|poses| (distance_mm, tilt_deg, tenths, poses)));
            }
        }
    }
    let progress = context.progress("one distance", scenes.len() * TRIALS);
    let moved = |(distance_mm, tilt_deg, tenths, poses): (u32, u32, u32, Vec<Pose>)| {
        let truth = Truth { cam_from_target: poses, ..Truth::example() };
        let scenario = format!("k2-observability/distance-{distance_mm}/coverage-{tenths}/tilt-{tilt_deg}");
        let node = Node::of(truth, (tenths, tilt_deg), (context.seed, &scenario), &progress)?;
        Ok(Moved { distance_mm, node })
    };
    scenes.into_iter().map(moved).collect()
}

/// Four poses at the distance, each moved until its outermost point has the coverage; `None` where one has
/// more before.
fn moved_poses(distance_mm: f64, tilt_deg: f64, coverage: f64) -> Option<Vec<Pose>> {
    let chapter = Truth::example();
    let views = turns(tilt_deg).into_iter().zip(CORNERS);
    views.map(|(turn, corner)| moved(&chapter, (turn, distance_mm), corner, coverage)).collect()
}

/// By bisection: moving outwards, the outermost point moves outwards.
fn moved(
    truth: &Truth,
    (turn_deg, distance_mm): ([f64; 3], f64),
    corner: (f64, f64),
    coverage: f64,
) -> Option<Pose> {
    let centred = looking_at_centre(turn_deg, distance_mm);
    let at = |steps: f64| {
        let translation = Vec3::new(steps * corner.0, steps * corner.1, distance_mm);
        Pose { translation, ..centred }
    };
    let (mut inside, mut outside) = (0.0, distance_mm);
    if reach(truth, &at(inside)) > coverage {
        return None;
    }
    loop {
        let middle = 0.5 * (inside + outside);
        if middle <= inside || middle >= outside {
            return Some(at(inside));
        }
        if reach(truth, &at(middle)) > coverage {
            outside = middle;
        } else {
            inside = middle;
        }
    }
}

pub fn report(record: &mut Record, map: &Map, context: &Context) -> Result<(), ExperimentError> {
    let scenes = sweep(context)?;
    report_numbers(record, map, &scenes);
    record.table(table(&scenes));
    claim_attained(record, &scenes);
    claim_separate(record, &scenes);
    record.figure(figure(map, &scenes, context.seed));
    Ok(())
}

/// The scenes of one distance and tilt, by coverage.
fn row(scenes: &[Moved], distance_mm: u32, tilt_deg: u32) -> Vec<&Node> {
    let of_row = |m: &&Moved| (m.distance_mm, m.node.tilt_deg) == (distance_mm, tilt_deg);
    scenes.iter().filter(of_row).map(|m| &m.node).collect()
}

fn report_numbers(record: &mut Record, map: &Map, scenes: &[Moved]) {
    for tenths in [COVERAGE_TENTHS[0], COVERAGE_TENTHS[COVERAGE_TENTHS.len() - 1]] {
        let distance = framed(&Truth::example(), [0.0; 3], f64::from(tenths) / 10.0).translation.z;
        let what =
            format!("distance of the facing view at coverage {:.1}, centred", f64::from(tenths) / 10.0);
        record.group("mm", relative()).number(format!("distance-c{tenths}"), distance, what);
    }
    let gain = |from: &Node, to: &Node, p: Parameter| from.bound_sd(p) / to.bound_sd(p);
    for (p, tilt) in [(Parameter::Fx, 5), (Parameter::Fx, 45), (Parameter::K2, 45)] {
        let ratio = gain(map.at(3, tilt), map.at(10, tilt), p);
        let what = format!("bound of {p} at coverage 0.3 over that at 1.0, tilt {tilt} deg, coming nearer");
        record.group("", relative()).number(format!("{p}-gain-nearer-t{tilt}"), ratio, what);
    }
    let shown = row(scenes, SHOWN_MM, SHOWN_DEG);
    let ends = shown.first().zip(shown.last());
    for p in [Parameter::Fx, Parameter::K2] {
        let Some((least, most)) = ends else { continue };
        for (name, node) in [("least", least), ("most", most)] {
            let what = format!("bound of {p} at {SHOWN_MM} mm, {}", node.name());
            record.group(p.unit(), relative()).number(format!("{p}-moved-{name}"), node.bound_sd(p), what);
        }
        let what = format!("bound of {p} at {SHOWN_MM} mm and {SHOWN_DEG} deg, least over most coverage");
        record.group("", relative()).number(format!("{p}-gain-moved"), gain(least, most, p), what);
        let at = |mm: u32| row(scenes, mm, SHOWN_DEG).into_iter().find(|n| n.tenths == 8);
        if let Some((far, near)) = at(DISTANCES_MM[0]).zip(at(DISTANCES_MM[2])) {
            let what = format!(
                "bound of {p} at {} mm over that at {} mm, coverage 0.8, tilt {SHOWN_DEG} deg",
                DISTANCES_MM[0], DISTANCES_MM[2]
            );
            record.group("", relative()).number(format!("{p}-gain-distance"), gain(far, near, p), what);
        }
    }
    record.exact("mm").number("moved-distance", f64::from(SHOWN_MM), "distance that the text speaks of");
    if let Some((least, _)) = ends {
        record.exact("").number("moved-least-coverage", least.coverage(), "least coverage at that distance");
    }
}

fn table(scenes: &[Moved]) -> Rows<&Moved> {
    let caption = "bound and trials with the target at one distance, each view moved towards another corner";
    Table::of("one-distance", caption, scenes)
        .column("distance", "mm", |m| f64::from(m.distance_mm))
        .column("tilt", "deg", |m| f64::from(m.node.tilt_deg))
        .column("coverage", "", |m| m.node.coverage())
        .column("k2_sd_bound", "", |m| m.node.bound_sd(Parameter::K2))
        .column("k2_sd_trials", "", |m| m.node.sampled_sd(Parameter::K2))
        .column("fx_sd_bound", "px", |m| m.node.bound_sd(Parameter::Fx))
        .column("fx_sd_trials", "px", |m| m.node.sampled_sd(Parameter::Fx))
        .column("converged", "", |m| m.node.outcome.converged())
}

fn claim_attained(record: &mut Record, scenes: &[Moved]) {
    let nodes: Vec<&Moved> = scenes.iter().filter(|m| m.node.is_identifiable()).collect();
    let ratio = Interval::of_deviation_ratio(TRIALS, each_of(2 * nodes.len(), RATE));
    let cases = nodes.iter().flat_map(|m| {
        [Parameter::K2, Parameter::Fx].map(|p| {
            let over = m.node.sd_over_bound(p);
            (format!("{p}, {} mm, {}: {over}", m.distance_mm, m.node.name()), ratio.contains(over))
        })
    });
    record
        .claim_that(
            "moved-attains-bound",
            "at one distance too the spread of k2 and of fx equals the bound, wherever the bound of fx is \
             below 3 %",
        )
        .every("spreads", cases)
        .at_rate(RATE)
        .because(format!(
            "sample deviation over {TRIALS} Gaussian values: ratio in [{:.4}, {:.4}], Bonferroni over both \
             and all scenes",
            ratio.low, ratio.high
        ));
}

/// Moving the target outwards helps k2 and not the focal length; coming nearer helps the focal length.
fn claim_separate(record: &mut Record, scenes: &[Moved]) {
    let steps = |tilts: &[u32]| -> Vec<(String, &Node, &Node)> {
        let rows = DISTANCES_MM.iter().flat_map(|&mm| tilts.iter().map(move |&t| (mm, t)));
        rows.flat_map(|(mm, t)| {
            let row = row(scenes, mm, t);
            let pairs: Vec<_> = row.windows(2).map(|w| (w[0], w[1])).collect();
            pairs.into_iter().map(move |(a, b)| (format!("{mm} mm, {} to {}", a.name(), b.name()), a, b))
        })
        .collect()
    };
    let compare = |p: Parameter, falls: bool, (name, a, b): &(String, &Node, &Node)| {
        let (before, after) = (a.bound_sd(p), b.bound_sd(p));
        (format!("{name}: {before} to {after}"), (after < before) == falls)
    };
    record
        .claim_that(
            "corners-cure-k2",
            "at one distance the bound of k2 falls with every step towards the corners, at 20 and 45 degrees",
        )
        .every("steps", steps(&[20, 45]).iter().map(|step| compare(Parameter::K2, true, step)))
        .because(
            "the radius grows; at 5 degrees the camera itself gets lost among the corners, and k2 with it",
        );
    record
        .claim_that(
            "corners-do-not-help-the-focal-length",
            "at one distance the bound of fx falls with no step towards the corners",
        )
        .every("steps", steps(&TILTS_DEG).iter().map(|step| compare(Parameter::Fx, false, step)))
        .because(
            "what tells f from Z is how much depths differ relative to the distance, and moving sideways \
             changes neither",
        );
    let nearer = TILTS_DEG.iter().flat_map(|&t| {
        DISTANCES_MM.windows(2).flat_map(move |mm| {
            let (far, near) = (row(scenes, mm[0], t), row(scenes, mm[1], t));
            let same = |n: &&Node| far.iter().find(|f| f.tenths == n.tenths).copied();
            let pairs: Vec<_> = near.iter().filter_map(|n| same(n).map(|f| (f, *n))).collect();
            pairs.into_iter().map(move |(f, n)| (format!("{} to {} mm, {}", mm[0], mm[1], n.name()), f, n))
        })
    });
    record
        .claim_that(
            "nearness-helps-the-focal-length",
            "at the same coverage and tilt the bound of fx falls as the target comes nearer",
        )
        .every("steps", nearer.collect::<Vec<_>>().iter().map(|step| compare(Parameter::Fx, true, step)))
        .because("the same tilt makes depths differ more, relative to the distance");
}

fn figure(map: &Map, scenes: &[Moved], seed: u64) -> Figure {
    let panel = |title: &str, label: &str, p: Parameter| {
        let coming = COVERAGE_TENTHS.map(|c| map.at(c, SHOWN_DEG)).map(|n| (n.coverage(), n.bound_sd(p)));
        let plot = Plot::new(title, "coverage (fraction of the way to the border)", label)
            .size(470.0, 380.0)
            .log_y()
            .line_as("centred, coming nearer", coming, Look::ink().dash(Dash::Dotted));
        DISTANCES_MM.iter().enumerate().fold(plot, |plot, (i, &mm)| {
            let nodes = row(scenes, mm, SHOWN_DEG);
            let bound = nodes.iter().map(|n| (n.coverage(), n.bound_sd(p)));
            let trials = nodes.iter().map(|n| (n.coverage(), n.sampled_sd(p)));
            let look = Look::series(i);
            plot.line_as(format!("moved at {mm} mm"), bound, look).points_as("", trials, look)
        })
    };
    let panels = [
        panel("k2", "standard deviation of k2", Parameter::K2),
        panel("Focal length", "standard deviation of fx (px)", Parameter::Fx),
    ];
    let shown = row(scenes, SHOWN_MM, SHOWN_DEG);
    let over = |from: &Node, to: &Node, p: Parameter| from.bound_sd(p) / to.bound_sd(p);
    let moved =
        |p: Parameter| shown.first().zip(shown.last()).map_or(f64::NAN, |(least, most)| over(least, most, p));
    let nearer = |p: Parameter| over(map.at(3, SHOWN_DEG), map.at(10, SHOWN_DEG), p);
    let caption = format!(
        "Standard deviation of k2 and fx at a tilt of {SHOWN_DEG}\u{b0}: bound (lines) and {TRIALS} trials \
         (points; noise {SIGMA_PX} px, seed {seed}). Dotted: coverage won by coming nearer, as in the maps. \
         Coloured: the target stays at one distance and each view is moved towards another corner. Notice \
         that at {SHOWN_MM} mm the least coverage has {:.1} times the bound of k2 of the most, and {:.2} \
         times that of fx, where coming nearer makes {:.0} and {:.1}.",
        moved(Parameter::K2),
        moved(Parameter::Fx),
        nearer(Parameter::K2),
        nearer(Parameter::Fx)
    );
    Figure::panels("one-distance", &panels, 2, caption)
}

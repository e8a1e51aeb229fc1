//! Is the mean of noise as near to zero as the standard error says?
//!
//! Expected: yes, at every number of draws. It cannot show whether the noise is normal.
//!
//! Write your question and the answer that you expect here, before you see a result.

use calibench::evaluate::Interval;
use calibench::synth::{Stream, StreamKey};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Plot, Record, Table};

/// What the command, golden/, figures/ and out/ know it by.
pub const EXPERIMENT: Experiment = Experiment {
    id: "my-name",
    title: "The mean of noise",
    question: "Is the mean of noise as near to zero as the standard error says? Expected: yes, at every number of draws.",
    // Chosen before any result was seen, and never changed because of one.
    seed: 1,
    takes_image: false,
    run,
};

/// Standard deviation of a draw, px.
const SIGMA_PX: f64 = 0.1;
/// The sweep, as data.
const DRAWS: [usize; 4] = [10, 100, 1_000, 10_000];
/// How often a correct program fails one of the claims.
const RATE: f64 = 1e-4;

/// What was found at a number of draws.
struct Node {
    draws: usize,
    mean_px: f64,
}

impl Node {
    /// Standard deviation of the mean of independent draws, px.
    fn standard_error_px(&self) -> f64 {
        SIGMA_PX / libm::sqrt(self.draws as f64)
    }
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let nodes = DRAWS.map(|draws| node(context.seed, draws));
    let mut record = context.record();
    report_means(&mut record, &nodes);
    claim_unbiased(&mut record, &nodes);
    record.table(
        Table::of("means", "means of noise", &nodes)
            .column("draws", "", |node| node.draws)
            .column("mean", "px", |node| node.mean_px)
            .column("standard_error", "px", |node| node.standard_error_px()),
    );
    record.figure(figure(context.seed, &nodes));
    Ok(record)
}

/// Every number of draws has a stream of its own, so that one more shifts nothing elsewhere.
fn node(seed: u64, draws: usize) -> Node {
    let key = StreamKey { seed, scenario: "mean-of-noise", trial: draws as u64, purpose: "noise" };
    let mut stream = Stream::open(key);
    let sum: f64 = (0..draws).map(|_| SIGMA_PX * stream.normal()).sum();
    Node { draws, mean_px: sum / draws as f64 }
}

/// Numbers are locked in golden/, each within its band.
fn report_means(record: &mut Record, nodes: &[Node]) {
    let mut numbers = record.group("px", Band::absolute(1e-15, "rounding of a sum"));
    for node in nodes {
        let (id, what) = (format!("mean-{}", node.draws), format!("mean of {} draws", node.draws));
        numbers.number(id, node.mean_px, what);
    }
}

/// A claim is a number against theory or an independent oracle. `bless` does not change it.
fn claim_unbiased(record: &mut Record, nodes: &[Node]) {
    // Each of the four may fail at a quarter of the rate.
    let rate = RATE / nodes.len() as f64;
    let holds = |node: &Node| Interval::of_mean(0.0, SIGMA_PX, node.draws, rate).contains(node.mean_px);
    let cases = nodes.iter().map(|node| (format!("{} draws: {} px", node.draws, node.mean_px), holds(node)));
    record
        .claim_that("unbiased", "the mean of noise is zero within its standard error")
        .every("numbers of draws", cases)
        .at_rate(RATE)
        .because("the mean of independent normal draws is normal; four claims share the rate");
}

/// A caption computes the numbers that it states.
fn figure(seed: u64, nodes: &[Node]) -> Figure {
    let against = |value: fn(&Node) -> f64| nodes.iter().map(move |node| (node.draws as f64, value(node)));
    let plot = Plot::new("The mean of noise", "draws", "distance from zero (px)")
        .log_x()
        .line("standard error", against(Node::standard_error_px))
        .points("mean, its size", against(|node| node.mean_px.abs()));
    let last = nodes.last().expect("the sweep is not empty");
    let caption = format!(
        "Size of the mean of noise of {SIGMA_PX} px, in pixels; seed {seed}, one mean each. Notice that after {} draws {:.4} px are left, \
         and that the standard error is {:.4} px.",
        last.draws,
        last.mean_px.abs(),
        last.standard_error_px()
    );
    Figure::plot("means", &plot, caption)
}

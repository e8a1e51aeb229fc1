//! Could the five published numbers have come from this treatment, all at once? Five intervals, one by one,
//! do not ask that.

use super::*;
use nalgebra::{SMatrix, SVector};

/// A treatment is called excluded where fewer than one draw in a thousand lies as far out as the published
/// numbers.
const EXCLUDED_BELOW: f64 = 1e-3;

/// Where the book's five numbers lie among the draws of one treatment.
struct Place {
    /// `(x - mean)^T S^-1 (x - mean)` with mean and covariance of the draws.
    distance: f64,
    /// Share of the draws that lie as far out, the book's counted among them.
    probability: f64,
}

/// The five quantities are correlated, some closely: a set of values may be impossible of which each alone is
/// ordinary. Their squared Mahalanobis distance takes the correlations in. Its distribution needs no theory:
/// one more draw takes each place among the others with the same chance, so the probability is its rank.
fn place(draws: &[Draw], treatment: usize, book: &Book) -> Result<Place, ExperimentError> {
    let mut sample = Sample::about(&draws[0][treatment]);
    draws.iter().for_each(|d| sample.add(&d[treatment]));
    let mean = SVector::<f64, 5>::from_fn(|i, _| sample.mean(i));
    let covariance = SMatrix::<f64, 5, 5>::from_fn(|i, j| sample.covariance(i, j));
    let factor = covariance
        .cholesky()
        .ok_or_else(|| ExperimentError::Input("the five quantities are not independent".to_string()))?;
    let squared = |values: [f64; 5]| {
        let from_mean = SVector::from(values) - mean;
        from_mean.dot(&factor.solve(&from_mean))
    };
    let distance = squared(std::array::from_fn(|q| book[q].value()));
    let farther = draws.iter().filter(|d| squared(d[treatment]) >= distance).count();
    Ok(Place { distance, probability: (farther + 1) as f64 / (draws.len() + 1) as f64 })
}

pub fn report_joint(record: &mut Record, draws: &[Draw], book: &Book) -> Result<(), ExperimentError> {
    let caption = "the five published numbers together against each treatment: squared Mahalanobis distance \
                   from the draws' mean, and the share of draws that lie as far out";
    let places: Vec<(Centre, Place)> = CENTRES
        .iter()
        .enumerate()
        .map(|(i, centre)| Ok((*centre, place(draws, i, book)?)))
        .collect::<Result<_, ExperimentError>>()?;
    for (centre, Place { distance, probability }) in &places {
        let what = "share of draws as far out as the five published numbers";
        record
            .group("", Band::relative(1e-6, "an inverse of a covariance of five quantities"))
            .suffix(format!("-{}", centre.name()), format!(", {}", centre.name()))
            .number("joint-distance", *distance, "squared Mahalanobis distance of the five published numbers")
            .band(Band::Exact)
            .number("joint-probability", *probability, what);
        claim(record, *centre, *probability);
    }
    let verdict = |place: &Place| if place.probability < EXCLUDED_BELOW { "excluded" } else { "possible" };
    record.table(
        Table::of("joint", caption, &places)
            .column("centre", "", |(centre, _)| centre.name())
            .column("estimated", "", |(centre, _)| centre.estimated())
            .column("distance", "", |(_, place)| place.distance)
            .column("probability", "", |(_, place)| place.probability)
            .column("verdict", "", |(_, place)| verdict(place)),
    );
    Ok(())
}

/// A radial lens whose centre is held, wherever, lacks what the published numbers show; the others do not.
fn claim(record: &mut Record, centre: Centre, probability: f64) {
    let (name, estimated) = (centre.name(), centre.estimated());
    let reason =
        "rank of the published numbers among the draws by Mahalanobis distance; excluded below 0.001";
    if centre.parameters() == 10 {
        let statement =
            format!("{name}, {estimated} estimated: the five published numbers do not occur together");
        record
            .claim_that(format!("{name}-is-excluded"), statement)
            .at_most(probability, EXCLUDED_BELOW)
            .because(reason);
    } else {
        let statement = format!(
            "{name}, {estimated} estimated: the five published numbers together are an ordinary draw"
        );
        record
            .claim_that(format!("{name}-is-possible"), statement)
            .at_least(probability, EXCLUDED_BELOW)
            .because(reason);
    }
}

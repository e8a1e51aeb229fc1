//! How are many warnings said? One line a warning, and one for all of a kind that twelve parameters would
//! repeat.

use super::Warning;
use super::report::reach;
use crate::camera::Parameter;

/// Of one kind this many stand in lines of their own; more are summed up.
const EACH: usize = 3;

/// Warnings in lines for people: each its own sentence, but those that say the same of many parameters in
/// one, at the place of the first.
///
/// ```
/// use calibench::calibrate::{Warning, in_words};
/// use calibench::camera::Parameter::{K1, K2, K3, K4, K5};
///
/// let pair = |a, b| Warning::Correlated { a, b, correlation: 0.99 };
/// let lines = in_words(&[pair(K1, K2), pair(K1, K4), Warning::NotCertified, pair(K2, K5), pair(K3, K5)]);
/// assert_eq!(lines.len(), 2);
/// assert!(lines[0].starts_with("4 pairs of parameters are correlated by up to 0.9900"));
/// ```
pub fn in_words(warnings: &[Warning]) -> Vec<String> {
    let skewed: Vec<(Parameter, [Option<f64>; 2])> = warnings.iter().filter_map(not_linear).collect();
    let pairs: Vec<(Parameter, Parameter, f64)> = warnings.iter().filter_map(correlated).collect();
    let (mut told_skewed, mut told_pairs) = (false, false);
    let mut lines = Vec::new();
    for warning in warnings {
        match warning {
            Warning::NotLinear { .. } if skewed.len() > EACH => {
                if !std::mem::replace(&mut told_skewed, true) {
                    lines.push(all_skewed(&skewed));
                }
            }
            Warning::Correlated { .. } if pairs.len() > EACH => {
                if !std::mem::replace(&mut told_pairs, true) {
                    lines.push(all_correlated(&pairs));
                }
            }
            other => lines.push(other.to_string()),
        }
    }
    lines
}

fn not_linear(warning: &Warning) -> Option<(Parameter, [Option<f64>; 2])> {
    match *warning {
        Warning::NotLinear { parameter, below, above } => Some((parameter, [below, above])),
        _ => None,
    }
}

fn correlated(warning: &Warning) -> Option<(Parameter, Parameter, f64)> {
    match *warning {
        Warning::Correlated { a, b, correlation } => Some((a, b, correlation)),
        _ => None,
    }
}

fn all_skewed(skewed: &[(Parameter, [Option<f64>; 2])]) -> String {
    let names: Vec<&str> = skewed.iter().map(|(parameter, ..)| parameter.name()).collect();
    let ratios = || skewed.iter().flat_map(|(_, ratios)| ratios.map(|ratio| ratio.unwrap_or(f64::INFINITY)));
    let (least, most) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    let far = |ratio: f64| reach(Some(ratio).filter(|ratio| ratio.is_finite()));
    let reach = if least == most { far(most) } else { format!("{} to {}", far(least), far(most)) };
    format!(
        "the standard deviations of {} mislead: intervals of two of them truly reach {reach}; state intervals by the profile of the cost where they \
         can be had, or free fewer coefficients",
        names.join(", ")
    )
}

fn all_correlated(pairs: &[(Parameter, Parameter, f64)]) -> String {
    let strength = |pair: &&(Parameter, Parameter, f64)| pair.2.abs();
    let Some((a, b, most)) = pairs.iter().max_by(|x, y| strength(x).total_cmp(&strength(y))) else {
        return String::new();
    };
    let mut names: Vec<&str> = Vec::new();
    for name in pairs.iter().flat_map(|(a, b, _)| [a.name(), b.name()]) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    format!(
        "{} pairs of parameters are correlated by up to {:.4} ({a} and {b}), of {}: the data hardly tell them apart; their \
         values mean something together only. Cover the image corners, or hold one of them",
        pairs.len(),
        most.abs(),
        names.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Parameter::{K1, K2, K3, K4, K5};

    fn pair(a: Parameter, b: Parameter, correlation: f64) -> Warning {
        Warning::Correlated { a, b, correlation }
    }

    #[test]
    fn more_than_three_pairs_are_told_in_one_line_with_the_strongest() {
        let three = [pair(K1, K2, 0.99), pair(K1, K4, -0.995), pair(K2, K5, 0.985)];
        assert_eq!(in_words(&three), three.clone().map(|warning| warning.to_string()));
        let lines = in_words(&[&three[..], &[Warning::NotCertified, pair(K3, K5, 0.99)]].concat());
        assert_eq!((lines.len(), &lines[1]), (2, &Warning::NotCertified.to_string()));
        let start =
            "4 pairs of parameters are correlated by up to 0.9950 (k1 and k4), of k1, k2, k4, k5, k3: ";
        assert!(lines[0].starts_with(start), "{}", lines[0]);
    }

    #[test]
    fn more_than_three_deviations_that_mislead_are_told_in_one_line_with_their_range() {
        let skewed =
            |parameter, below| Warning::NotLinear { parameter, below: Some(below), above: Some(0.9) };
        let three = [skewed(K1, 0.8), skewed(K2, 0.5), skewed(K3, 0.7)];
        assert_eq!(in_words(&three), three.clone().map(|warning| warning.to_string()));
        let open = Warning::NotLinear { parameter: K4, below: Some(0.8), above: None };
        let lines = in_words(&[&three[..], &[open]].concat());
        assert_eq!(lines.len(), 1);
        let start = "the standard deviations of k1, k2, k3, k4 mislead: intervals of two of them truly reach 0.50 \
                     times as far to without end;";
        assert!(lines[0].starts_with(start), "{}", lines[0]);
    }
}

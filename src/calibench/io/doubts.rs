//! Does a result doubt its own standard deviations? What first-order theory says of it is then no test of
//! anything.

/// Words of [`Warning::NotLinear`](crate::calibrate::Warning::NotLinear) and
/// [`Warning::Ambiguous`](crate::calibrate::Warning::Ambiguous), as results hold them.
const DOUBTING: [&str; 2] =
    ["misleads: an interval of two of them", "another camera explains the data nearly as well"];

/// Those of a result's warnings that say so.
pub fn doubts(warnings: Vec<String>) -> Vec<String> {
    let is_doubt = |warning: &String| DOUBTING.iter().any(|words| warning.contains(words));
    warnings.into_iter().filter(is_doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Warning;
    use crate::camera::Parameter;

    #[test]
    fn the_warnings_are_known_by_their_words() {
        let parameter = Parameter::Fx;
        let doubting = [
            Warning::NotLinear { parameter, below: Some(0.5), above: None },
            Warning::Ambiguous { parameter, value: 1.0, other: 2.0, excess: 0.1 },
        ];
        let other = Warning::Correlated { a: Parameter::Fx, b: Parameter::Fy, correlation: 0.99 };
        let told: Vec<String> = doubting.iter().chain([&other]).map(ToString::to_string).collect();
        assert_eq!(doubts(told.clone()), told[..2]);
    }
}

//! Does a result doubt its own standard deviations? What first-order theory says of it is then no test of anything.

use super::input::{InputError, MOST_TABLE_BYTES, read_regular_text};
use super::shown::ShownPath;
use serde::Deserialize;
use std::path::Path;

/// Words of [`Warning::NotLinear`](crate::calibrate::Warning::NotLinear) and
/// [`Warning::Ambiguous`](crate::calibrate::Warning::Ambiguous), as results hold them.
const DOUBTING: [&str; 2] =
    ["misleads: an interval of two of them", "another camera explains the data nearly as well"];

/// The warnings of a result file that say so, each after the name of its file; none of a file that holds no warnings.
///
/// # Errors
/// The file cannot be read.
pub fn doubts(path: &Path) -> Result<Vec<String>, InputError> {
    let text = read_regular_text(path, MOST_TABLE_BYTES)?;
    Ok(of_text(&text).into_iter().map(|warning| format!("{}: {warning}", path.shown())).collect())
}

fn of_text(text: &str) -> Vec<String> {
    #[derive(Deserialize)]
    struct Warned {
        #[serde(default)]
        warnings: Vec<String>,
    }
    let warned = serde_json::from_str(text).unwrap_or(Warned { warnings: Vec::new() });
    let is_doubt = |warning: &String| DOUBTING.iter().any(|words| warning.contains(words));
    warned.warnings.into_iter().filter(is_doubt).collect()
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
            Warning::NotLinear { parameter, below: 0.5, above: 2.0 },
            Warning::Ambiguous { parameter, value: 1.0, other: 2.0, excess: 0.1 },
        ];
        let other = Warning::Correlated { a: Parameter::Fx, b: Parameter::Fy, correlation: 0.99 };
        let told = doubting.iter().chain([&other]).map(ToString::to_string).collect::<Vec<_>>();
        let result = serde_json::json!({ "camera": {}, "warnings": told }).to_string();
        assert_eq!(of_text(&result), told[..2]);
        assert!(of_text("%YAML:1.0").is_empty() && of_text("{}").is_empty());
    }
}

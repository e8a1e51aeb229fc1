//! What does every combination of levels come to? The study with the levels in place of its own values.

use super::factor::Factor;
use super::limits;
use super::prediction::DRAWS;
use super::spec::{Estimator, SceneSpec, Spec};
use super::spec_error::SpecError;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// The part of a study that factors may change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Design {
    pub scene: SceneSpec,
    #[serde(default)]
    pub estimator: Estimator,
}

/// The design of every combination of levels; the last factor varies fastest.
pub(super) fn designs(spec: &Spec, text: &str) -> Result<Vec<(Vec<usize>, Design)>, SpecError> {
    for (i, factor) in spec.factor.iter().enumerate() {
        factor.check(text)?;
        if spec.factor[..i].iter().any(|f| f.name == factor.name) {
            return Err(SpecError::DuplicateFactor(factor.name.clone()));
        }
    }
    refuse_set_twice(&spec.factor)?;
    limits::check_trials(spec.factor.iter().map(|f| f.count()), spec.trials.per_cell, spec.trials.batch)?;
    let base = Design { scene: spec.scene.clone(), estimator: spec.estimator.clone() };
    // All else that a design holds came from TOML, whose reader takes larger numbers than its writer.
    let mut base = Table::try_from(&base).map_err(|_| SpecError::NumberTooLarge)?;
    if let Some(estimator) = base.get_mut("estimator").and_then(Value::as_table_mut)
        && !spec.estimator.is_free_named
    {
        estimator.remove("free");
    }
    let counts: Vec<usize> = spec.factor.iter().map(|f| f.count()).collect();
    let mut points = limits::Points::default();
    let mut count = |(levels, design): (Vec<usize>, Design)| {
        let scene = &design.scene;
        // The board was checked: its marks can be counted.
        let marks = scene.target.count();
        points.add(marks, scene.poses.views(), if scene.poses.redraws() { DRAWS } else { 1 })?;
        Ok((levels, design))
    };
    (0..counts.iter().product())
        .map(|index| design(spec, text, &base, digits(index, &counts)).and_then(&mut count))
        .collect()
}

/// Refuses a field whose level another one overwrites, its own or that of the table around it: cells that
/// seem to differ would be the same.
fn refuse_set_twice(factors: &[Factor]) -> Result<(), SpecError> {
    let fields: Vec<(&str, &str)> = factors
        .iter()
        .flat_map(|factor| factor.set.iter().map(|path| (factor.name.as_str(), path.as_str())))
        .collect();
    for (i, (by, path)) in fields.iter().enumerate() {
        let lost = |earlier: &str| earlier == *path || earlier.starts_with(&format!("{path}."));
        if let Some((before, field)) = fields[..i].iter().find(|(_, earlier)| lost(earlier)) {
            let [field, before, by] = [field, before, by].map(|text| text.to_string());
            return Err(SpecError::SetTwice { field, before, by });
        }
    }
    Ok(())
}

fn design(
    spec: &Spec,
    text: &str,
    base: &Table,
    levels: Vec<usize>,
) -> Result<(Vec<usize>, Design), SpecError> {
    let mut tree = base.clone();
    for (factor, &level) in spec.factor.iter().zip(&levels) {
        factor.apply(&mut tree, level, text)?;
    }
    let design: Design = Value::Table(tree).try_into().map_err(|e: toml::de::Error| {
        // The tree without factors was read: what is wrong came from a level.
        let (factor, &level) =
            spec.factor.iter().zip(&levels).next_back().expect("a tree without factors was read before");
        factor.error(text, Some(level), format!("with this level: {}", e.message().trim()))
    })?;
    let design = Design { scene: design.scene.read(&spec.inputs)?, ..design };
    design.scene.check()?;
    design.estimator.check()?;
    Ok((levels, design))
}

/// A number in mixed radix, least significant last.
fn digits(mut index: usize, counts: &[usize]) -> Vec<usize> {
    let mut digits = vec![0; counts.len()];
    for (digit, count) in digits.iter_mut().zip(counts).rev() {
        *digit = index % count;
        index /= count;
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;

    #[test]
    fn in_mixed_radix_the_last_digit_varies_fastest() {
        let mut index = 0;
        for a in 0..2 {
            for b in 0..3 {
                for c in 0..4 {
                    assert_eq!(digits(index, &[2, 3, 4]), [a, b, c], "{index}");
                    index += 1;
                }
            }
        }
        assert_eq!(digits(0, &[]), [0; 0]);
    }

    #[test]
    fn the_cells_of_a_grid_are_all_combinations_of_levels() {
        let text = STUDY.to_string()
            + "\n[[factor]]\nname = \"views\"\nset = [\"scene.poses.views\"]\nlevels = [3, 4, 5]\n";
        let found: Vec<(f64, usize)> = designs(&Spec::parse(&text).unwrap(), &text)
            .unwrap()
            .iter()
            .map(|(_, design)| (design.scene.noise_px, design.scene.poses.views()))
            .collect();
        assert_eq!(found, [(0.1, 3), (0.1, 4), (0.1, 5), (0.3, 3), (0.3, 4), (0.3, 5)]);
    }

    #[test]
    fn a_field_is_set_by_one_factor_alone() {
        let refused = |first: &str, second: &str, levels: &str| {
            let text = STUDY.replace("set = [\"scene.noise_px\"]", &format!("set = [\"{first}\"]"))
                + &format!("\n[[factor]]\nname = \"other\"\nset = [\"{second}\"]\nlevels = {levels}\n");
            let found = designs(&Spec::parse(&text).unwrap(), &text);
            matches!(found, Err(SpecError::SetTwice { .. }))
        };
        let noise = "[0.2, 0.4]";
        assert!(refused("scene.noise_px", "scene.noise_px", noise));
        assert!(!refused("scene.noise_px", "scene.outlier_share", noise));
        // A table takes its fields along, and a longer name is no field of a shorter one.
        let target = "[{ columns = 3, rows = 3, spacing_mm = 10.0 }]";
        assert!(refused("scene.target.spacing_mm", "scene.target", target));
        assert!(!refused("scene.outlier_px", "scene.outlier", noise));
    }
}

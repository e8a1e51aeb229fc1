//! Where are the marks of a measured target, where were they seen, and how is a calibration from them kept?
//! Target files `point,X,Y,Z` with `sd` or `sdX,sdY,sdZ`, corner files that name marks, and a `result.json`
//! with the marks in it.

use super::result::CalibrationFields;
use super::table::{Column, Row, TableError, columns, read_table, refuse_misspelt};
use crate::board::ViewError;
use crate::geometry::{Vec2, Vec3};
use crate::measured::{
    CorrectedMark, MeasuredCalibration, MeasuredError, MeasuredMark, MeasuredTarget, MeasuredView, Noise,
    SeenMark, SumTest, TargetError,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Why a target file does not serve.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TargetFileError {
    /// It is no table of marks.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Standard deviations are given in two ways, or in part.
    #[error(
        "{file}:1: {what}: give one column sd, or the three sdX, sdY and sdZ, or none where marks are exact"
    )]
    Deviations {
        /// The file.
        file: String,
        /// What is wrong.
        what: &'static str,
    },
    /// Its marks are no target.
    #[error("{file}: {cause}")]
    Target {
        /// The file.
        file: String,
        /// What is wrong.
        cause: TargetError,
    },
}

const PLACE: [Column; 3] = [Column::length("X"), Column::length("Y"), Column::length("Z")];

/// Reads a target file with the columns `point,X,Y,Z`, and `sd` for the standard deviation of every
/// coordinate or `sdX`, `sdY`, `sdZ` for each; without them marks are exact. Further columns are ignored,
/// unless they look like one of these;
/// `file` names the source in errors.
///
/// # Errors
/// See [`TargetFileError`].
///
/// ```
/// use calibench::io::parse_target;
///
/// let target = parse_target("target.csv", b"point,X,Y,Z,sd\nA1,0,0,0.02,0.01\nA2,20,0,-0.01,0.01\n")?;
/// assert_eq!((target.marks()[1].id.as_str(), target.marks()[1].position.z), ("A2", -0.01));
/// # Ok::<(), calibench::io::TargetFileError>(())
/// ```
pub fn parse_target(file: &str, bytes: &[u8]) -> Result<MeasuredTarget, TargetFileError> {
    let header = columns(bytes);
    refuse_misspelt(file, &header, &["point", "X", "Y", "Z", "sd", "sdX", "sdY", "sdZ"])?;
    let has = |name: &str| header.iter().any(|column| column == name);
    let wrong = |what| Err(TargetFileError::Deviations { file: file.into(), what });
    let of_axes = ["sdX", "sdY", "sdZ"].iter().filter(|name| has(name)).count();
    let [x, y, z] = PLACE;
    let rows: Vec<(u64, String, Vec3, Vec3)> = match (has("sd"), of_axes) {
        (true, 1..) => return wrong("standard deviations stand in sd and in a column for an axis"),
        (false, 1 | 2) => return wrong("standard deviations of some axes are missing"),
        (true, 0) => marks(file, bytes, [x, y, z, Column::length("sd")], |[.., sd]| Vec3::repeat(sd))?,
        (false, 0) => marks(file, bytes, [x, y, z], |_| Vec3::zeros())?,
        (false, _) => {
            let deviations = [Column::length("sdX"), Column::length("sdY"), Column::length("sdZ")];
            let [a, b, c] = deviations;
            marks(file, bytes, [x, y, z, a, b, c], |[.., a, b, c]| Vec3::new(a, b, c))?
        }
    };
    refuse_vanishing(file, &rows)?;
    let mut lines = BTreeMap::new();
    for (line, id, ..) in &rows {
        if let Some(first) = lines.insert(id, *line) {
            let (file, point) = (file.to_string(), id.clone());
            let place = "of the target".to_string();
            return Err(TableError::RepeatedPoint { file, line: *line, point, place, first }.into());
        }
    }
    let mark = |(_, id, position, standard_deviation)| MeasuredMark { id, position, standard_deviation };
    MeasuredTarget::new(rows.into_iter().map(mark).collect())
        .map_err(|cause| TargetFileError::Target { file: file.into(), cause })
}

/// The least standard deviation but 0, of an exact mark: its square is a weight's inverse.
const LEAST_DEVIATION: f64 = 1e-15;

/// Refuses deviations that are none and not 0 either.
fn refuse_vanishing(file: &str, rows: &[(u64, String, Vec3, Vec3)]) -> Result<(), TableError> {
    let vanishes = |sd: f64| sd > 0.0 && sd < LEAST_DEVIATION;
    let found =
        rows.iter().find_map(|(line, .., sd)| sd.iter().find(|sd| vanishes(**sd)).map(|sd| (*line, *sd)));
    let Some((line, sd)) = found else { return Ok(()) };
    let message = format!(
        "a standard deviation of {sd:e}, and the least is {LEAST_DEVIATION:e}: give 0 where the mark is exact"
    );
    Err(TableError::Unreadable { file: file.into(), line, message })
}

/// Line, name, place and standard deviations of each row.
fn marks<const N: usize>(
    file: &str,
    bytes: &[u8],
    wanted: [Column; N],
    deviations: impl Fn([f64; N]) -> Vec3,
) -> Result<Vec<(u64, String, Vec3, Vec3)>, TableError> {
    let rows: Vec<Row<1, N>> = read_table(file, bytes, ["point"], wanted)?;
    let mark = |Row { line, names: [id], numbers }: Row<1, N>| {
        (line, id, Vec3::new(numbers[0], numbers[1], numbers[2]), deviations(numbers))
    };
    Ok(rows.into_iter().map(mark).collect())
}

/// Which marks were seen where.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenFile {
    /// Name of each view, as it stands in the file.
    pub view_names: Vec<String>,
    /// Marks of each view, in the file's order.
    pub views: Vec<MeasuredView>,
    /// Columns X, Y or Z of the file, which were not read: where marks are stands in the target file.
    pub unread: Vec<String>,
}

/// Reads a corner file with the columns `view,point,u,v`, and `weight` or `sigma_px` as
/// [`super::parse_corners`] has them; where marks are is not read, whatever it says.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::parse_seen;
///
/// let file = parse_seen("corners.csv", b"view,point,X,Y,u,v\nleft,A1,0,0,320.5,240\nleft,A2,20,0,371.2,239.4\n")?;
/// assert_eq!((file.views[0].marks()[1].id.as_str(), file.unread.join(",").as_str()), ("A2", "X,Y"));
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_seen(file: &str, bytes: &[u8]) -> Result<SeenFile, TableError> {
    let header = columns(bytes);
    refuse_misspelt(file, &header, &["view", "point", "X", "Y", "Z", "u", "v", "weight", "sigma_px"])?;
    let has = |name: &str| header.iter().any(|column| column == name);
    let (u, v) = (Column::pixels("u"), Column::pixels("v"));
    let (view_names, views) = match (has("weight"), has("sigma_px")) {
        (true, true) => {
            let message = "columns 'weight' and 'sigma_px' say the same twice: keep one of them".to_string();
            return Err(TableError::Unreadable { file: file.into(), line: 1, message });
        }
        (true, false) => seen(file, bytes, [u, v, Column::length("weight")], |[.., weight]| weight)?,
        (false, true) => seen(file, bytes, [u, v, Column::pixels("sigma_px")], |[.., sigma]| 1.0 / sigma)?,
        (false, false) => seen(file, bytes, [u, v], |_| 1.0)?,
    };
    let unread = ["X", "Y", "Z"].iter().filter(|name| has(name)).map(|name| name.to_string()).collect();
    Ok(SeenFile { view_names, views, unread })
}

fn seen<const N: usize>(
    file: &str,
    bytes: &[u8],
    wanted: [Column; N],
    weight: impl Fn([f64; N]) -> f64,
) -> Result<(Vec<String>, Vec<MeasuredView>), TableError> {
    let rows: Vec<Row<2, N>> = read_table(file, bytes, ["view", "point"], wanted)?;
    let mut first_line = BTreeMap::new();
    let mut index_of: BTreeMap<String, usize> = BTreeMap::new();
    let mut groups: Vec<(String, Vec<SeenMark>)> = Vec::new();
    for Row { line, names: [view, point], numbers } in rows {
        if let Some(first) = first_line.insert((view.clone(), point.clone()), line) {
            let place = format!("of view '{view}'");
            return Err(TableError::RepeatedPoint { file: file.into(), line, point, place, first });
        }
        let index = *index_of.entry(view.clone()).or_insert_with(|| {
            groups.push((view, Vec::new()));
            groups.len() - 1
        });
        let mark = SeenMark { id: point, pixel: Vec2::new(numbers[0], numbers[1]), weight: weight(numbers) };
        groups[index].1.push(mark);
    }
    let of_group = |(name, marks): (String, Vec<SeenMark>)| {
        let bad = marks.iter().position(|m| !(m.weight > 0.0 && m.weight.is_finite()));
        let refused = |view: &str| {
            let index = bad.unwrap_or(0);
            let cause = ViewError::BadWeight { index, weight: marks[index].weight };
            TableError::View { file: file.into(), view: view.into(), cause }
        };
        match MeasuredView::new(marks.clone()) {
            Ok(view) => Ok((name, view)),
            Err(_) => Err(refused(&name)),
        }
    };
    Ok(groups.into_iter().map(of_group).collect::<Result<Vec<_>, _>>()?.into_iter().unzip())
}

/// A refusal with the names of views in the place of their numbers.
pub fn refusal_by_names(error: &MeasuredError, names: &[String]) -> String {
    use MeasuredError::{OnALine, RepeatedView, TooFewMarks, UnknownMark};
    let name = |view: &usize| names.get(*view).map_or(view.to_string(), |name| format!("'{name}'"));
    let said = super::message(error);
    match error {
        UnknownMark { view, .. } | TooFewMarks { view, .. } => {
            said.replacen(&format!("view {view}"), &format!("view {}", name(view)), 1)
        }
        OnALine { view } => said.replacen(&format!("view {view}"), &format!("view {}", name(view)), 1),
        RepeatedView { view, copy_of } => said
            .replacen(&format!("view {view}"), &format!("view {}", name(view)), 1)
            .replacen(&format!("of view {copy_of}"), &format!("of view {}", name(copy_of)), 1),
        _ => said,
    }
}

/// A [`CorrectedMark`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarkFields {
    /// Its name.
    pub point: String,
    /// Views that show it.
    pub views: usize,
    /// Estimated position, in the target's unit.
    pub position: [f64; 3],
    /// Standard deviations of that.
    pub standard_deviations: [f64; 3],
    /// Covariance of that, row by row.
    pub covariance: [[f64; 3]; 3],
    /// Estimated - measured position.
    pub correction: [f64; 3],
    /// Standard deviations that the correction is expected to have.
    pub expected: [f64; 3],
    /// Correction over that.
    pub normalised: [f64; 3],
    /// Probability of a correction as large by chance.
    pub p_value: f64,
    /// Whether it is beyond expectation.
    pub is_beyond_expectation: bool,
}

impl MarkFields {
    fn of(mark: &CorrectedMark) -> MarkFields {
        MarkFields {
            point: mark.id.clone(),
            views: mark.views,
            position: mark.position.into(),
            standard_deviations: mark.standard_deviation().into(),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| mark.covariance[(i, j)])),
            correction: mark.correction.into(),
            expected: mark.expected.into(),
            normalised: mark.normalised.into(),
            p_value: mark.p_value,
            is_beyond_expectation: mark.is_beyond_expectation,
        }
    }
}

/// A [`SumTest`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SumTestFields {
    /// Whether it holds at the rate `false_alarm`.
    pub holds: bool,
    /// The sum of squares.
    pub sum: f64,
    /// Its expectation.
    pub expected: f64,
    /// Degrees of freedom of the scaled chi-squared variable.
    pub degrees_of_freedom: f64,
    /// Root of sum over expectation.
    pub factor: f64,
    /// Two-sided.
    pub p_value: f64,
    /// Rate at which a test that does not hold is wrong.
    pub false_alarm: f64,
}

impl SumTestFields {
    fn of(test: &SumTest) -> SumTestFields {
        SumTestFields {
            holds: test.holds(),
            sum: test.sum,
            expected: test.expected,
            degrees_of_freedom: test.degrees_of_freedom,
            factor: test.factor(),
            p_value: test.p_value,
            false_alarm: crate::measured::FALSE_ALARM,
        }
    }
}

/// What became of the target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetFields {
    /// `estimated` with the rest, or `given`.
    pub noise: &'static str,
    /// Whether the stated standard deviations can be believed.
    pub credibility: Option<SumTestFields>,
    /// Whether a noise that was given can be.
    pub noise_test: Option<SumTestFields>,
    /// Names of marks whose correction is beyond expectation, the least probable first.
    pub beyond_expectation: Vec<String>,
    /// Marks that no view shows.
    pub unseen: Vec<String>,
    /// Every mark that was seen.
    pub marks: Vec<MarkFields>,
}

/// A calibration from a measured target: all fields of [`CalibrationFields`], and `target`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredFields {
    /// The camera and its views.
    #[serde(flatten)]
    pub calibration: CalibrationFields,
    /// The marks.
    pub target: TargetFields,
}

impl MeasuredFields {
    /// The result of views with these names.
    pub fn of(
        found: &MeasuredCalibration,
        names: &[String],
        image_size: Option<(usize, usize)>,
    ) -> MeasuredFields {
        let mut calibration = CalibrationFields::of(&found.calibration, names, image_size);
        calibration.warnings.extend(found.doubts());
        let noise = if found.noise == Noise::Estimated { "estimated" } else { "given" };
        MeasuredFields {
            calibration,
            target: TargetFields {
                noise,
                credibility: found.credibility.as_ref().map(SumTestFields::of),
                noise_test: found.noise_test.as_ref().map(SumTestFields::of),
                beyond_expectation: found.beyond_expectation().iter().map(|m| m.id.clone()).collect(),
                unseen: found.unseen.clone(),
                marks: found.marks.iter().map(MarkFields::of).collect(),
            },
        }
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        // Plain fields and string keys: nothing in them can fail to serialise.
        serde_json::to_string_pretty(self).expect("a calibration serialises") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(text: &str) -> String {
        parse_target("t.csv", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn deviations_stand_in_one_column_or_three_or_none() {
        let one = parse_target("t", b"point,X,Y,Z,sd\na,1,2,3,0.5\n").unwrap();
        let three = parse_target("t", b"sdZ,point,X,Y,Z,sdX,sdY\n0.5,a,1,2,3,0.5,0.5\n").unwrap();
        assert_eq!(one, three);
        let none = parse_target("t", b"point,X,Y,Z,name\na,1,2,3,left\n").unwrap();
        assert_eq!(none.marks()[0].standard_deviation, Vec3::zeros());
        assert!(
            complaint("point,X,Y,Z,sd,sdX\na,1,2,3,1,1\n")
                .contains("t.csv:1: standard deviations stand in sd")
        );
        assert!(complaint("point,X,Y,Z,sdX,sdY\na,1,2,3,1,1\n").contains("of some axes are missing"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        assert_eq!(
            complaint("point,X,Y,Z\na,1,2,3\na,1,2,4\n"),
            "t.csv:3: point 'a' of the target was given on line 2 already"
        );
        assert_eq!(
            complaint("point,X,Y,Z\na,1,2,NaN\n"),
            "t.csv:2: column 'Z' (field 4): 'NaN' is not a finite number"
        );
        assert!(
            complaint("point,X,Y,Z,sd\na,1,2,3,-1\n")
                .starts_with("t.csv: mark 'a' of the target has a standard deviation of -1")
        );
        assert!(complaint("point,X,Y,Z,sd\na,1,2,3,inf\n").contains("'inf' is not a finite number"));
        assert!(complaint("point,X,Y\na,1,2\n").contains("column 'Z' is missing"));
        let seen = |text: &str| parse_seen("c.csv", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            seen("view,point,u,v\n0,a,1,2\n0,a,3,4\n"),
            "c.csv:3: point 'a' of view '0' was given on line 2 already"
        );
        assert!(
            seen("view,point,u,v,sigma_px\n0,a,1,2,0\n")
                .starts_with("c.csv: view '0': point 0 has weight inf")
        );
    }
}

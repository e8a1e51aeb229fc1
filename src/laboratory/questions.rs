//! Which questions can a page ask? Each is a function from numbers to numbers.

use super::{calibration, lens, picture, plane, trials, uncertainty};

/// The numbers of an answer, or why there is none, in words for the reader.
pub(crate) type Answer = Result<Vec<f64>, String>;

/// A question: from its numbers to its answer.
pub(crate) type Question = fn(&[f64]) -> Answer;

/// Every question with its name, under which the WebAssembly exports it.
const TABLE: [(&str, Question); 11] = [
    ("predict", calibration::predict),
    ("observe", calibration::observe),
    ("calibrate", calibration::calibrate_once),
    ("trials", trials::trials),
    ("spread", trials::spread),
    ("uncertainty", uncertainty::uncertainty),
    ("distort", lens::distort),
    ("bend", lens::bend),
    ("photograph", picture::photograph),
    ("rectify", picture::rectify),
    ("nine_points", plane::nine_points),
];

/// The names of all questions.
pub fn questions() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(|(name, _)| *name)
}

/// The answer to the question of that name.
///
/// # Errors
/// There is no such question, it has other numbers, or the library refuses them.
///
/// ```
/// use calibench_laboratory::{CHAPTER, answer};
///
/// // The chapter's scene, draw 0.
/// let found = answer("calibrate", &[&CHAPTER[..], &[0.0]].concat())?;
/// assert!((found[0] - 600.0).abs() < 3.0);
/// # Ok::<(), String>(())
/// ```
pub fn answer(name: &str, numbers: &[f64]) -> Result<Vec<f64>, String> {
    let (_, question) = TABLE
        .iter()
        .find(|(known, _)| *known == name)
        .ok_or_else(|| format!("there is no question `{name}`"))?;
    question(numbers)
}

/// The numbers of a question, as many as it has.
pub(crate) fn exactly<const N: usize>(numbers: &[f64]) -> Result<[f64; N], String> {
    numbers.try_into().map_err(|_| format!("the question has {N} numbers, not {}", numbers.len()))
}

/// A number that counts something, within its range.
pub(crate) fn count(number: f64, what: &str, least: u32, most: u32) -> Result<usize, String> {
    let whole = number == libm::trunc(number) && (f64::from(least)..=f64::from(most)).contains(&number);
    if whole {
        Ok(number as usize)
    } else {
        Err(format!("{what}: a whole number from {least} to {most}, not {number}"))
    }
}

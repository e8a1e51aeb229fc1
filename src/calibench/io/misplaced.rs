//! Is a mark somewhere else on the target in one view than in all others? A corner file repeats where each
//! mark is, line by line, and a slip in one of them is a target of another shape.

use super::corners::PLACES;
use super::shown::on_one_line;
use super::table::{Row, TableError, read_table};
use std::collections::BTreeMap;

/// Other views that must agree with each other before one is said to differ from them.
const LEAST_OTHERS: usize = 2;
/// Part of the target's extent by which places differ that were meant to be the same: above what is lost in
/// writing a number.
const ROUNDING: f64 = 1e-6;

/// A place, so that it can be looked up.
type Place = [u64; 2];

/// Sentences that are said at most: a file that repeats its marks has one for each.
const MOST_SAID: usize = 5;

/// What is to be said of marks of a corner file that stand at another place in one view than in all others,
/// or where another mark of their view stands: a sentence for each, and one for those that are too many.
///
/// Some files number the marks of each view anew. There the place of a mark that seems to have moved is that
/// of another mark of the file, or the place that it should have is taken in its view: such marks are not
/// named.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::misplaced_marks;
///
/// let text = "view,point,X,Y,u,v\na,1,0,0,9,9\na,2,10,0,9,8\nb,1,0,0,9,9\nb,2,10,0,9,8\nc,1,0,0,9,9\nc,2,100,0,9,8\n";
/// assert_eq!(
///     misplaced_marks("c.csv", text.as_bytes())?,
///     ["c.csv:7: point '2' of view 'c' is at (100, 0), and in all 2 other views that show it at (10, 0): a slip, if both are one mark"]
/// );
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn misplaced_marks(file: &str, bytes: &[u8]) -> Result<Vec<String>, TableError> {
    let rows: Vec<Row<2, 2>> = read_table(file, bytes, ["view", "point"], PLACES)?;
    let seen = Seen::of(&rows);
    let mut found: Vec<(u64, String)> = seen.moved().chain(seen.coincident()).collect();
    found.sort();
    let more = found.len().saturating_sub(MOST_SAID);
    let mut said: Vec<String> =
        found.into_iter().take(MOST_SAID).map(|(line, said)| format!("{file}:{line}: {said}")).collect();
    if more > 0 {
        said.push(format!("{file}: {more} more marks are at a place where they are not expected"));
    }
    Ok(said)
}

/// The lines of a file by what they say.
struct Seen<'a> {
    /// How many lines name a place.
    shows: BTreeMap<Place, usize>,
    by_point: BTreeMap<&'a str, Vec<&'a Row<2, 2>>>,
    by_place: BTreeMap<(&'a str, Place), Vec<&'a Row<2, 2>>>,
    /// Largest coordinate.
    extent: f64,
}

impl<'a> Seen<'a> {
    fn of(rows: &'a [Row<2, 2>]) -> Seen<'a> {
        let extent = rows.iter().flat_map(|row| row.numbers).fold(0.0, |extent: f64, x| extent.max(x.abs()));
        let mut seen =
            Seen { shows: BTreeMap::new(), by_point: BTreeMap::new(), by_place: BTreeMap::new(), extent };
        for row in rows {
            let [view, point] = &row.names;
            *seen.shows.entry(place(row)).or_default() += 1;
            seen.by_point.entry(point).or_default().push(row);
            seen.by_place.entry((view, place(row))).or_default().push(row);
        }
        seen
    }

    /// Marks that one view has at another place than all others.
    fn moved(&self) -> impl Iterator<Item = (u64, String)> {
        self.by_point.values().filter_map(|rows| {
            let (odd, other) = odd_one(rows)?;
            let apart = (0..2).map(|i| (odd.numbers[i] - other.numbers[i]).abs()).fold(0.0, f64::max);
            let [view, point] = &odd.names;
            let is_free = !self.by_place.contains_key(&(view.as_str(), place(other)));
            (apart > ROUNDING * self.extent && self.shows[&place(odd)] == 1 && is_free).then(|| {
                let ([x, y], [x_other, y_other]) = (odd.numbers, other.numbers);
                let (point, view, others) = (on_one_line(point), on_one_line(view), rows.len() - 1);
                (
                    odd.line,
                    format!(
                        "point '{point}' of view '{view}' is at ({x}, {y}), and in all {others} other views that show it at ({x_other}, {y_other}): a \
                         slip, if both are one mark"
                    ),
                )
            })
        })
    }

    /// Marks at the place of an earlier one of their view.
    fn coincident(&self) -> impl Iterator<Item = (u64, String)> {
        self.by_place.values().filter(|rows| rows.len() > 1).map(|rows| {
            let [view, first] = &rows[0].names;
            let [_, second] = &rows[1].names;
            let [x, y] = rows[0].numbers;
            let (view, first, second) = (on_one_line(view), on_one_line(first), on_one_line(second));
            (
                rows[1].line,
                format!(
                    "points '{first}' and '{second}' of view '{view}' are at one place of the target, ({x}, {y}): a slip, unless one mark was measured twice"
                ),
            )
        })
    }
}

fn place(row: &Row<2, 2>) -> Place {
    // Minus nought is nought.
    row.numbers.map(|x| (x + 0.0).to_bits())
}

/// Of the lines of one mark the only one with another place, and one of those that agree.
fn odd_one<'a>(rows: &[&'a Row<2, 2>]) -> Option<(&'a Row<2, 2>, &'a Row<2, 2>)> {
    if rows.len() <= LEAST_OTHERS {
        return None;
    }
    // Of the first three two agree, or there is no one that is alone.
    let common =
        if place(rows[0]) == place(rows[1]) || place(rows[0]) == place(rows[2]) { rows[0] } else { rows[1] };
    let mut others = rows.iter().filter(|row| place(row) != place(common));
    match (others.next(), others.next()) {
        (Some(odd), None) => Some((odd, common)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of views, each a list of a mark's name and place.
    fn said(views: &[&[(&str, f64, f64)]]) -> Vec<String> {
        let mut text = "view,point,X,Y,u,v\n".to_string();
        for (view, marks) in views.iter().enumerate() {
            for (point, x, y) in *marks {
                text += &format!("v{view},{point},{x},{y},1,2\n");
            }
        }
        misplaced_marks("c", text.as_bytes()).unwrap()
    }

    const WHOLE: [(&str, f64, f64); 3] = [("a", 0.0, 0.0), ("b", 10.0, 0.0), ("c", 0.0, 10.0)];

    #[test]
    fn one_mark_at_another_place_in_one_view_is_named_wherever_that_view_stands() {
        let moved = [WHOLE[0], ("b", 10.0, 0.5), WHOLE[2]];
        for at in 0..3 {
            let mut views = [&WHOLE[..]; 4];
            views[at] = &moved;
            let said = said(&views);
            assert_eq!(said.len(), 1, "{said:?}");
            assert!(
                said[0].contains(&format!("'b' of view 'v{at}' is at (10, 0.5), and in all 3 other")),
                "{said:?}"
            );
        }
        // Two views that differ from each other: nobody knows which is right.
        assert!(said(&[&WHOLE, &moved]).is_empty());
        assert!(said(&[&WHOLE, &WHOLE, &moved, &moved]).is_empty());
    }

    #[test]
    fn what_was_lost_in_writing_and_the_sign_of_nought_are_no_slips() {
        let written = [("a", -0.0, 0.0), ("b", 10.000_001, 0.0), WHOLE[2]];
        assert!(said(&[&WHOLE, &WHOLE, &written]).is_empty());
    }

    #[test]
    fn marks_that_each_view_numbers_anew_are_not_named() {
        // The first mark is hidden in three of four views.
        let part = [("a", 10.0, 0.0), ("b", 0.0, 10.0)];
        assert!(said(&[&part, &part, &WHOLE, &part]).is_empty());
        // And in one of four.
        assert!(said(&[&WHOLE, &WHOLE, &WHOLE, &part]).is_empty());
    }

    #[test]
    fn two_marks_at_one_place_of_a_view_are_named_and_many_are_counted() {
        let twice = [WHOLE[0], ("b", 0.0, 10.0), WHOLE[2]];
        let found = said(&[&WHOLE, &WHOLE, &twice]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("c:10: points 'b' and 'c' of view 'v2' are at one place"), "{found:?}");
        let found = said(&[&twice[..]; 8]);
        assert_eq!(found.len(), MOST_SAID + 1, "{found:?}");
        assert_eq!(found[MOST_SAID], "c: 3 more marks are at a place where they are not expected");
    }

    #[test]
    fn a_name_begins_no_line_of_the_sentence() {
        let odd = [("\"b\nall held\"", 10.0, 0.5)];
        let even = [("\"b\nall held\"", 10.0, 0.0)];
        let said = said(&[&even, &even, &odd]);
        assert!(said.len() == 1 && !said[0].contains('\n'), "{said:?}");
    }
}

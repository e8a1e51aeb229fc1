//! Why does the vendor's program print other numbers? Half-pixel centres, searched exhaustively.

use super::*;

/// Most coordinates that may be rounded to the neighbouring half pixel when the GUI's numbers are sought.
pub const MOST_MOVES: usize = 3;

/// What the GUI prints, in this order.
pub const GUI: [&str; 6] = ["gui-a11", "gui-a22", "gui-tx", "gui-ty", "gui-sx", "gui-sy"];

/// The six numbers of an affine fit in the order of [`GUI`].
pub fn gui_numbers(centres: &[Vec2], world: &[Vec2]) -> Result<[f64; 6], ExperimentError> {
    let m: Mat3 = Affine::fit(centres, world).map_err(ExperimentError::at("affine fit"))?.matrix();
    let scale = |column: usize| (m[(0, column)] * m[(0, column)] + m[(1, column)] * m[(1, column)]).sqrt();
    Ok([m[(0, 0)], m[(1, 1)], m[(0, 2)], m[(1, 2)], scale(0), scale(1)])
}

/// Centres on half pixels, counted from an origin.
pub struct HalfPixels {
    pub name: &'static str,
    /// What is added to our coordinates before rounding: 0 where pixel (0, 0) is the first pixel's centre,
    /// 0.5 where it is its corner.
    pub origin_px: f64,
    pub rounded: Vec<Vec2>,
    /// The fewest coordinates that must be rounded to the other neighbour for all six printed numbers; `None`
    /// up to [`MOST_MOVES`].
    pub moves: Option<usize>,
    pub tried: usize,
    /// All sets of centres with that few moves that print the GUI's numbers.
    pub matches: Vec<Vec<Vec2>>,
}

impl HalfPixels {
    pub fn new(name: &'static str, origin_px: f64, centres: &[Vec2]) -> Result<HalfPixels, ExperimentError> {
        let half = |x: f64| 0.5 * (2.0 * (x + origin_px)).round();
        let rounded: Vec<Vec2> = centres.iter().map(|c| c.map(half)).collect();
        let mut found = HalfPixels { name, origin_px, rounded, moves: None, tried: 0, matches: Vec::new() };
        let entries = GUI.iter().map(|id| entry(id)).collect::<Result<Vec<_>, _>>()?;
        for moves in 0..=MOST_MOVES {
            let start = found.rounded.clone();
            found.search(start, 0, moves, &entries)?;
            if !found.matches.is_empty() {
                found.moves = Some(moves);
                break;
            }
        }
        Ok(found)
    }

    /// Tries every way to move `left` of the coordinates from `first` on to a neighbouring half pixel.
    pub fn search(
        &mut self,
        centres: Vec<Vec2>,
        first: usize,
        left: usize,
        entries: &[&Entry],
    ) -> Result<(), ExperimentError> {
        if left == 0 {
            self.tried += 1;
            let numbers = gui_numbers(&centres, &unit_grid())?;
            if numbers.iter().zip(entries).all(|(number, entry)| entry.rounds_from(*number)) {
                self.matches.push(centres);
            }
            return Ok(());
        }
        for coordinate in first..2 * centres.len() {
            for step in [-0.5, 0.5] {
                let mut moved = centres.clone();
                moved[coordinate / 2][coordinate % 2] += step;
                self.search(moved, coordinate + 1, left - 1, entries)?;
            }
        }
        Ok(())
    }

    /// Of the matching sets the one nearest to the centres before rounding.
    pub fn nearest(&self, centres: &[Vec2]) -> Option<&Vec<Vec2>> {
        let origin = Vec2::new(self.origin_px, self.origin_px);
        let distance = |set: &Vec<Vec2>| -> f64 {
            set.iter().zip(centres).map(|(s, c)| (s - c - origin).norm_squared()).sum()
        };
        self.matches.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

pub fn explain_gui(
    record: &mut Record,
    centres: &[Vec2],
    fit: &PlaneCalibration,
    band: Band,
) -> Result<(), ExperimentError> {
    let hypotheses = [
        HalfPixels::new("centre of the first pixel", 0.0, centres)?,
        HalfPixels::new("corner of the first pixel", 0.5, centres)?,
    ];
    record.table(hypotheses_table(&hypotheses)?);
    let [from_centre, from_corner] = &hypotheses;
    record
        .claim_that(
            "gui-is-half-pixels-from-the-corner",
            "centres rounded to half pixels and counted from the first pixel's corner print all six numbers \
             of the GUI, counted from its centre they do not",
        )
        .every(
            "cases",
            [
                ("from the corner".to_string(), from_corner.moves.is_some()),
                ("not from the centre".to_string(), from_centre.moves.is_none()),
            ],
        )
        .because(
            "exhaustive search: at most 3 of 18 coordinates rounded to the other neighbour, every printed \
             digit compared",
        );
    // Rounding alone moves each centre by a quarter of a pixel at most, so their mean as well.
    let rounding = 0.25 * fit.scale_x;
    let gap_x = (entry("gui-tx")?.value() - entry("tx")?.value()).abs();
    record
        .group("", band.clone())
        .number("gui-gap-by-rounding-at-most", rounding, "translation that rounding can explain")
        .number("gui-gap-by-origin", 0.5 * fit.scale_x, "translation by half a pixel of the origin");
    record
        .claim_that(
            "rounding-alone-is-too-small",
            "the published gap along x is more than rounding every centre to half pixels can move the mean",
        )
        .at_least(gap_x - rounding, entry("tx")?.rounding() + entry("gui-tx")?.rounding())
        .because("a quarter of a pixel times the scale; half a unit of the last printed digits");

    let set = from_corner.nearest(centres).unwrap_or(&from_corner.rounded);
    let numbers = gui_numbers(set, &unit_grid())?;
    for ((id, number), unit) in GUI.iter().zip(numbers).zip(["1/px", "1/px", "", "", "1/px", "1/px"]) {
        let what = format!("{}, from centres on half pixels", entry(id)?.what);
        record.group(unit, band.clone()).number(*id, number, what);
    }
    let middle = mean(set);
    record
        .group("px/18", Band::absolute(ROUNDING, "a mean of nine multiples of 0.5"))
        .number("gui-centre-u-18ths", 18.0 * (middle.x - 715.0), "mean u less 715")
        .number("gui-centre-v-18ths", 18.0 * (middle.y - 566.0), "mean v less 566");
    let caption = "centres on half pixels that print the GUI's six numbers, nearest to ours";
    record.table(
        Table::of("gui-centres", caption, centres.iter().zip(set))
            .column("u", "px", |(ours, _)| ours.x)
            .column("v", "px", |(ours, _)| ours.y)
            .column("u_gui", "px", |(_, gui)| gui.x)
            .column("v_gui", "px", |(_, gui)| gui.y)
            .column("du", "px", |(ours, gui)| gui.x - ours.x)
            .column("dv", "px", |(ours, gui)| gui.y - ours.y),
    );
    record.figure(gui_figure(centres, set));
    let moved = from_corner.moves.unwrap_or(0);
    let what =
        "coordinates of the stand-in that must be rounded to the other neighbour for all six printed numbers";
    record.exact("").count("gui-moved", moved, what);
    record.note(format!(
        "The GUI's six printed numbers are those of an affine fit to half-pixel centres, counted from the \
         corner of the first pixel; of the stand-in's 18 coordinates {moved} must be rounded to the other \
         neighbour for that. The translations printed differ by {gap_x:.5} along x, of which half a pixel \
         of the origin makes {:.5}; rounding alone moves the mean by less than {rounding:.5}. The chapter \
         names the rounding only. Mean v is 566 + 8/18: read from translation and scale alone it seems to \
         be 566.19, because a dot rounded the other way tilts the map.",
        0.5 * fit.scale_x
    ));
    Ok(())
}

pub fn hypotheses_table(hypotheses: &[HalfPixels]) -> Result<Table, ExperimentError> {
    let mut columns = vec![("origin", ""), ("sets_tried", ""), ("fewest_moves", ""), ("sets_that_match", "")];
    let names: Vec<String> = GUI.iter().map(|id| format!("rounded_{}", id.replace('-', "_"))).collect();
    columns.extend(names.iter().map(|name| (name.as_str(), "")));
    let caption = "half-pixel centres by the place of the origin: sets of at most three other roundings \
                   that print the GUI's six numbers, and the numbers of plain rounding";
    let mut table = Table::new("gui-origins", caption, &columns);
    for h in hypotheses {
        let moves = h.moves.map_or(Cell::from("none"), Cell::from);
        let mut row = vec![Cell::from(h.name), Cell::from(h.tried), moves, Cell::from(h.matches.len())];
        row.extend(gui_numbers(&h.rounded, &unit_grid())?.map(Cell::from));
        table.push(row);
    }
    Ok(table)
}

pub fn gui_figure(centres: &[Vec2], gui: &[Vec2]) -> Figure {
    let apart = mean(gui) - mean(centres);
    let shifts = centres.iter().zip(gui).map(|(c, g)| (g.x - c.x, g.y - c.y));
    let square = |at: f64| {
        let (low, high) = (at - 0.25, at + 0.25);
        [(low, low), (high, low), (high, high), (low, high), (low, low)]
    };
    let plot = Plot::new("GUI's centres less ours", "du (px)", "dv (px)")
        .size(470.0, 430.0)
        .equal_aspect()
        .y_down()
        .x_range(-0.4, 1.0)
        .y_range(-0.4, 1.0)
        .line_as("rounding to half pixels", square(0.0), Look::series(0))
        .line_as("the same from the pixel's corner", square(0.5), Look::series(1))
        .points_as("nine centres", shifts, Look::series(2))
        .points_as("mean", [(apart.x, apart.y)], Look::series(3).size(6.0));
    let caption = format!(
        "Half-pixel centres that print the GUI's six numbers, less ours, in pixels; nothing is drawn at \
         random. Notice that their mean lies {:.2} px away along u and {:.2} px along v, where rounding \
         alone moves it by a quarter of a pixel at most: the origin differs.",
        apart.x, apart.y
    );
    Figure::plot("gui-shift", &plot, caption)
}

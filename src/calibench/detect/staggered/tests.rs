use super::*;

/// A board in a lattice of rows and diagonals, and the places of its marks, px, as they lie on the board.
fn board(columns: usize, rows: usize) -> (Lattice, Vec<Vec2>) {
    let centres: Vec<Vec2> = (0..columns * rows).map(|index| 10.0 * on_board(index, columns)).collect();
    let lattice_place = |(x, y): Place| ((x - y) / 2, y);
    let lattice = (0..columns * rows).map(|k| (lattice_place(place_on_board(k, columns)), k)).collect();
    (lattice, centres)
}

#[test]
fn an_odd_number_of_rows_has_one_order_and_an_even_one_two_half_a_turn_apart() {
    for columns in LEAST_COLUMNS..=9 {
        for rows in LEAST_ROWS..=12 {
            let (lattice, centres) = board(columns, rows);
            let orders = readings(&lattice, hand(&lattice, &centres), columns, rows, 1);
            assert_eq!(orders.len(), 2 - rows % 2, "{columns} x {rows}");
            let marks = ordered_staggered(&lattice, &centres, columns, rows).unwrap();
            assert!(marks.iter().enumerate().all(|(place, &mark)| place == mark), "{columns} x {rows}");
            assert_eq!(complete_size(&lattice, &centres), Some((columns, rows)));
        }
    }
    // With fewer there may be a choice.
    let (lattice, centres) = board(2, 2);
    assert!(readings(&lattice, hand(&lattice, &centres), 2, 2, 1).len() > 2);
}

#[test]
fn a_mirror_image_is_never_the_board_but_where_it_is_its_own() {
    for columns in LEAST_COLUMNS..=7 {
        for rows in LEAST_ROWS..=14 {
            let (lattice, mut centres) = board(columns, rows);
            centres.iter_mut().for_each(|centre| centre.x = -centre.x);
            let found = ordered_staggered(&lattice, &centres, columns, rows);
            // An odd number of rows is its own mirror image, top and bottom exchanged; as many rows as twice
            // the columns the same, a diagonal as the mirror.
            let is_its_own = rows % 2 == 1 || rows == 2 * columns;
            assert_eq!(found.is_ok(), is_its_own, "{columns} x {rows}: {found:?}");
            if let Ok(marks) = found {
                let to = |index: usize| centres[marks[index]] - centres[marks[0]];
                assert!(to(columns - 1).perp(&to(columns * (rows - 1))) > 0.0, "seen from its front");
            } else if rows / 2 >= LEAST_COLUMNS {
                assert!(matches!(found, Err(GridError::Mirrored { .. })), "{columns} x {rows}: {found:?}");
            }
        }
    }
}

#[test]
fn a_board_without_some_marks_is_certain_while_all_its_ends_are_seen() {
    for (columns, rows) in [(4, 11), (5, 8), (9, 9), (4, 7)] {
        let (whole, centres) = board(columns, rows);
        let without = |hidden: &dyn Fn(usize, usize) -> bool| -> Lattice {
            let is_hidden = |mark: usize| hidden(mark % columns, mark / columns);
            whole.iter().filter(|(_, mark)| !is_hidden(**mark)).map(|(place, mark)| (*place, *mark)).collect()
        };
        let part = |lattice: &Lattice| ordered_staggered_part(lattice, &centres, columns, rows);
        let holes =
            part(&without(&|column, row| (column, row) == (0, 0) || (column, row) == (1, 3))).unwrap();
        for (place, mark) in holes.iter().enumerate() {
            let is_hole = place == 0 || place == 3 * columns + 1;
            assert_eq!(*mark, (!is_hole).then_some(place), "{columns} x {rows}");
        }
        // Without a row at an end, or all but two marks of it, it may lie a row further.
        assert_eq!(part(&without(&|_, row| row == 0)), None);
        assert_eq!(part(&without(&|column, row| row == rows - 1 && column > 1)), None);
        assert_eq!(part(&without(&|column, row| column == 0 && row % 2 == 0)), None);
        assert_eq!(part(&without(&|_, row| row > rows / 2 - 1)), None);
    }
}

#[test]
fn a_smaller_board_is_no_larger_one_whose_end_is_hidden() {
    let (lattice, centres) = board(5, 8);
    assert_eq!(ordered_staggered_part(&lattice, &centres, 4, 11), None);
    let named = GridError::Staggered { columns: 4, rows: 11, found_columns: 5, found_rows: 8 };
    assert_eq!(ordered_staggered(&lattice, &centres, 4, 11), Err(named));
}

#[test]
fn rows_in_line_are_called_so() {
    let centres: Vec<Vec2> = (0..35).map(|k| 10.0 * Vec2::new(f64::from(k % 7), f64::from(k / 7))).collect();
    let lattice: Lattice = (0..35).map(|k| ((k % 7, k / 7), k as usize)).collect();
    let found = ordered_staggered(&lattice, &centres, 5, 7);
    assert_eq!(found, Err(GridError::InLine { columns: 5, rows: 7, found_columns: 7, found_rows: 5 }));
}

#[test]
fn marks_go_to_the_diagonals_and_back() {
    for (columns, rows) in [(3, 4), (4, 11), (9, 5)] {
        let places: Vec<Option<Vec2>> =
            (0..columns * rows).map(|k| (k % 5 != 0).then(|| on_board(k, columns))).collect();
        let (grid, width) = along_diagonals(&places, columns);
        assert_eq!(grid.len() % width, 0);
        assert_eq!(grid.iter().flatten().count(), places.iter().flatten().count());
        assert_eq!(from_diagonals(&grid, places.len(), columns), places);
    }
}

//! Are the corner files of others read whole?

use calibench::io::{data_folder, read_corners};

#[test]
fn corner_files_have_the_views_and_points_their_authors_state() {
    let Some(folder) = data_folder().unwrap() else {
        eprintln!("skipped: no ../shared/data and CALIBENCH_DATA is not set");
        return;
    };
    // Views and points a view, from the description of each set.
    for (file, views, points) in
        [("zhang/points.csv", 5, 256), ("opencv_left/corners.csv", 13, 54), ("calib1/points.csv", 7, 35)]
    {
        let corners = read_corners(&folder.join(file)).unwrap();
        assert_eq!((corners.views.len(), corners.view_names.len()), (views, views), "{file}");
        assert!(corners.views.iter().all(|view| view.len() == points), "{file}");
    }
}

//! Are the corner files of others read whole?

use calibench::io::read_corners;

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn corner_files_have_the_views_and_points_their_authors_state() {
    let folder = crate::data::folder();
    // Views and points a view, from the description of each set.
    for (file, views, points) in
        [("zhang/points.csv", 5, 256), ("opencv_left/corners.csv", 13, 54), ("calib1/points.csv", 7, 35)]
    {
        let corners = read_corners(&folder.join(file)).unwrap();
        assert_eq!((corners.views.len(), corners.view_names.len()), (views, views), "{file}");
        assert!(corners.views.iter().all(|view| view.len() == points), "{file}");
    }
}

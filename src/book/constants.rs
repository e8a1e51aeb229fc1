//! Which numbers of the text are no results? Constants of the chapter's scene, taken from the code that
//! builds it.

use calibench::synth::Truth;

/// The text of a scene constant.
pub(super) fn constant(name: &str) -> Option<String> {
    constants().into_iter().find(|(known, _)| *known == name).map(|(_, text)| text)
}

/// All scene constants, by name.
fn constants() -> Vec<(&'static str, String)> {
    let camera = Truth::example_camera();
    let board = Truth::example_board();
    let points = board.points();
    let spacing = (points[1] - points[0]).norm();
    let views = Truth::example_poses().len();
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let minus = |value: f64| value.to_string().replace('-', "\u{2212}");
    vec![
        ("fx", format!("{}", camera.fx)),
        ("fy", format!("{}", camera.fy)),
        ("cx", format!("{}", camera.cx)),
        ("cy", format!("{}", camera.cy)),
        ("k1", minus(camera.distortion.k1)),
        ("k2", minus(camera.distortion.k2)),
        ("image-width", width.to_string()),
        ("image-height", height.to_string()),
        ("spacing", format!("{spacing}")),
        ("points-per-view", points.len().to_string()),
        ("views", views.to_string()),
        ("pairs", (views * points.len()).to_string()),
        ("distance", format!("{}", Truth::example_poses()[0].translation.z)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_tells_its_constants() {
        assert_eq!(constant("fx").as_deref(), Some("600"));
        assert_eq!(constant("k1").as_deref(), Some("\u{2212}0.18"));
        assert_eq!(constant("pairs").as_deref(), Some("252"));
        assert_eq!(constant("spacing").as_deref(), Some("10"));
        assert_eq!(constant("nonsense"), None);
    }
}

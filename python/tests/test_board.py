"""Boards photographed by the virtual camera, found in the image, and calibrated from; images without distortion."""

import numpy as np
import pytest

import calibench

CAMERA = calibench.Scene.example().camera
SIZE = (640, 480)
TILTS = [(0.0, 0.0, 0.0), (20.0, 0.0, 0.0), (0.0, -20.0, 0.0), (-15.0, 15.0, 10.0)]


def photographs(board: calibench.Board, distance: float) -> list[np.ndarray]:
    poses = [calibench.looking_at_centre(tilt, distance) for tilt in TILTS]
    return [board.photograph(CAMERA, SIZE, rotation, translation, blur_px=0.7) for rotation, translation in poses]


@pytest.mark.parametrize("levels", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize(("text", "distance"), [("circles:9x7:10mm:3mm", 120.0), ("chess:9x6:8mm", 120.0)])
def test_a_board_is_found_where_it_was_photographed(text: str, distance: float, levels: type) -> None:
    board = calibench.Board(text)
    rotation, translation = calibench.looking_at_centre((0.0, 0.0, 0.0), distance)
    image = board.photograph(CAMERA, SIZE, rotation, translation, blur_px=0.7)
    scale = 1 if levels is np.float32 else np.iinfo(levels).max
    found = board.detect((image * scale).astype(levels))
    truth = CAMERA.project(board.points, rotation, translation)
    # A board that looks the same after half a turn may be found either way round.
    errors = [np.abs(found - order).max() for order in (truth, truth[::-1])]
    # Discs seen through distortion are biased by some hundredths of a pixel, corners less.
    assert min(errors) < 0.1


def test_discs_lose_their_bias_when_the_camera_is_fitted() -> None:
    board = calibench.Board("circles:9x7:10mm:3mm")
    seen = [board.detect(image) for image in photographs(board, 120.0)]
    fit = calibench.fit_views(board, seen, image_size=SIZE)
    plain = calibench.calibrate(board.points, seen, image_size=SIZE)
    assert fit.kept == (0, 1, 2, 3) and fit.left_out == ()
    assert fit.largest_bias_px is not None and fit.largest_bias_px > 0.01
    assert fit.calibration.rmse_px < 0.5 * plain.rmse_px
    assert abs(fit.calibration.camera.fx - CAMERA.fx) < 0.5 * abs(plain.camera.fx - CAMERA.fx)


def test_a_stray_view_is_left_out_and_named() -> None:
    scene = calibench.Scene.example()
    pixels = scene.observe(0.1, calibench.Stream(seed=3, scenario="stray"))
    pixels[3, ::2, 0] += 3.0
    fit = calibench.fit_views(calibench.Board("circles:9x7:10mm"), pixels, reject_views=3.0)
    assert fit.kept == (0, 1, 2) and [view for view, _ in fit.left_out] == [3] and len(fit.pixels) == 3


def test_a_board_that_is_not_whole_is_refused_with_what_was_seen() -> None:
    board = calibench.Board("circles:9x7:10mm:3mm")
    whole = photographs(board, 120.0)[0]
    without_columns = whole.copy()
    without_columns[:, :200] = 0.85
    with pytest.raises(calibench.DetectError, match="a complete 7 x 7 was seen") as of_columns:
        board.detect(without_columns)
    assert of_columns.value.kind == "WrongSize"
    image = whole.copy()
    image[:200, :200] = 0.85
    with pytest.raises(calibench.DetectError, match="show the whole board") as error:
        board.detect(image)
    numbers = error.value.numbers
    assert error.value.kind == "Partial" and numbers["expected"] == 63 and 0 < numbers["found"] < 63
    with pytest.raises(calibench.DetectError) as of_chess:
        calibench.Board("chess:9x6:8mm").detect(np.zeros((100, 100), dtype=np.uint8))
    assert of_chess.value.numbers["expected"] == 54
    with pytest.raises(TypeError, match="expected a grey image"):
        board.detect(np.zeros((100, 100, 3), dtype=np.uint8))


def test_boards_are_read_as_on_the_command_line() -> None:
    board = calibench.Board("circles:9x7:1cm:3mm")
    assert (board.kind, board.columns, board.rows, board.spacing, board.unit) == ("circles", 9, 7, 1.0, "cm")
    assert board.points.shape == (63, 2) and board.points[0].tolist() == [-4.0, -3.0]
    with pytest.raises(calibench.BoardError, match="expected KIND:COLUMNSxROWS"):
        calibench.Board("rings:9x7:1")
    with pytest.raises(calibench.BoardError) as error:
        calibench.Board("chess:1x6:25mm")
    assert (error.value.kind, error.value.numbers) == ("TooSmall", {"columns": 1, "rows": 6})


def test_detection_sees_rows_whatever_their_order_in_memory() -> None:
    board = calibench.Board("circles:9x7:10mm:3mm")
    image = photographs(board, 120.0)[3]
    assert (board.detect(image) == board.detect(np.asfortranarray(image))).all()


@pytest.mark.parametrize("levels", [np.uint8, np.uint16, np.float32])
def test_an_undistorted_image_shows_marks_where_an_ideal_lens_would(levels: type) -> None:
    board = calibench.Board("chess:9x6:8mm")
    rotation, translation = calibench.looking_at_centre((10.0, 5.0, 0.0), 130.0)
    photo = board.photograph(CAMERA, SIZE, rotation, translation, blur_px=1.0)
    scale = 1 if levels is np.float32 else np.iinfo(levels).max
    ideal, output = CAMERA.undistort_image((photo * scale).astype(levels), view="all-pixels", border=0.85 * scale)
    assert output is not None and ideal.dtype == levels and ideal.shape == photo.shape
    found, truth = board.detect(ideal), output.project(board.points, rotation, translation)
    # Bilinear sampling of an edge that is blurred by a pixel.
    assert min(np.abs(found - order).max() for order in (truth, truth[::-1])) < 0.1


def test_a_map_makes_the_image_that_is_made_without_one() -> None:
    photo = photographs(calibench.Board("chess:9x6:8mm"), 130.0)[3]
    ideal, output = CAMERA.undistort_image(photo)
    assert output is not None
    table = calibench.RectifyMap(CAMERA, SIZE, output)
    assert (table.apply(photo) == ideal).all()
    assert table.valid.shape == (480, 640) and table.sources.shape == (480, 640, 2)
    assert np.abs(table.sources[240, 320] - CAMERA.distort_points([[320.0, 240.0]])[0]).max() < 1e-4
    with pytest.raises(calibench.RectifyError) as error:
        table.apply(photo[:100])
    assert error.value.numbers == {"expected_width": 640, "expected_height": 480, "width": 640, "height": 100}


def test_a_fisheye_is_shown_in_other_projections() -> None:
    fisheye = calibench.Camera(200.0, 200.0, 319.5, 239.5, model="kannala-brandt", k1=0.01)
    grey = np.full((480, 640), 90, dtype=np.uint8)
    for view, has_camera in (("pinhole", True), ("equidistant", True), ("equirectangular", False)):
        image, camera = fisheye.undistort_image(grey, view=view)
        assert image[240, 320] == 90 and (camera is not None) == has_camera
    with pytest.raises(ValueError, match="only the lens model brown-conrady"):
        fisheye.undistort_image(grey)


def test_a_board_is_photographed_through_a_fisheye() -> None:
    board = calibench.Board("chess:9x6:8mm")
    camera = calibench.Camera(fx=300.0, fy=300.0, cx=320.0, cy=240.0, k1=-0.02, model="kannala-brandt")
    image = board.photograph(camera, SIZE, np.eye(3), [0.0, 0.0, 100.0], blur_px=0.7)
    seen = board.detect(image)
    expected = camera.project(np.column_stack([board.points, np.full(len(board.points), 100.0)]))
    assert np.abs(seen - expected).max() < 0.05

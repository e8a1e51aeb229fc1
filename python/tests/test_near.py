"""Photographs of boards that are nowhere, or so near that most of them lies outside of the image: refused, or taken in bounded time."""

import time

import numpy as np
import pytest

import calibench

CAMERA = calibench.Camera(58.0, 58.0, 28.5, 18.0, k1=0.1)
PINHOLE = calibench.Camera(58.0, 58.0, 28.5, 18.0)
SIZE = (58, 37)


@pytest.mark.parametrize("translation", [[0, np.nan, 50], [0, 0, np.inf], [np.inf, 0, 50], [0, 0, np.nan]])
def test_a_pose_that_is_not_finite_is_refused(translation: list[float]) -> None:
    with pytest.raises(calibench.SceneError, match="pose = .* need finite") as error:
        calibench.Board("chess:4x3:10").photograph(CAMERA, SIZE, np.eye(3), translation)
    assert error.value.kind == "Setting"


@pytest.mark.parametrize("blur_px", [0.0, 0.7])
@pytest.mark.parametrize(
    ("text", "translation"),
    [
        ("chess:4x3:10", [0, -158, 1.0]),
        ("chess:4x3:10", [0, 0, 0.01]),
        ("chess:4x3:10", [1.0, 2.0, 1e-6]),
        ("chess:4x3:10", [3.0, 2.0, 1e-12]),
        ("circles:9x7:10mm:3mm", [0, 0, 5.0]),
        ("circles:9x7:10mm:3mm", [0.5, 0, 0.01]),
        ("circles:9x7:10mm:3mm", [1.5, 0, 1e-5]),
    ],
)
def test_a_board_near_the_camera_takes_bounded_time(text: str, translation: list[float], blur_px: float) -> None:
    started = time.process_time()
    image = calibench.Board(text).photograph(PINHOLE, SIZE, np.eye(3), translation, blur_px=blur_px)
    try:
        calibench.Board(text).photograph(CAMERA, SIZE, np.eye(3), translation, blur_px=blur_px)
    except calibench.SceneError as error:
        # The lens makes the rounding of an angle larger than a pixel.
        assert error.kind == "TooNear" and translation[2] < 0.01
    took = time.process_time() - started
    assert image.shape == (37, 58) and np.isfinite(image).all()
    assert 0.1 - 1e-5 <= image.min() and image.max() <= 0.85 + 1e-5
    # A hundredth of a second on a common machine.
    assert took < 2.0, f"{took:.1f} s"


def test_a_board_near_the_camera_is_seen_as_it_is() -> None:
    near = calibench.Board("circles:9x7:10mm:3mm").photograph(PINHOLE, SIZE, np.eye(3), [1.5, 0.2, 0.05])
    # The border of one disc crosses the image almost as a straight line: ink where the ray meets the disc.
    u, v = np.meshgrid(np.arange(58), np.arange(37))
    x, y = (u - 28.5) / 58.0 * 0.05 - 1.5, (v - 18.0) / 58.0 * 0.05 - 0.2
    radius = np.hypot(x, y)
    inside, outside = radius < 1.5 - 0.002, radius > 1.5 + 0.002
    assert inside.any() and outside.any()
    assert np.abs(near[inside] - 0.1).max() < 1e-6 and np.abs(near[outside] - 0.85).max() < 1e-6

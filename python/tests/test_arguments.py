"""Arguments that cannot be are refused before any work, by errors that name them."""

from collections.abc import Callable

import numpy as np
import pytest

import calibench

SCENE = calibench.Scene.example()
BOARD = calibench.Board("chess:4x3:10")
PINHOLE = calibench.Camera(58.0, 58.0, 28.5, 18.0)


@pytest.mark.parametrize("count", [10**12, 10**15, 2**60, 2**63])
def test_what_no_memory_holds_is_refused_and_the_stream_goes_on(count: int) -> None:
    stream = calibench.Stream(1, "x")
    for draw in (stream.normal, stream.uniform, lambda n: stream.below(n, 10)):
        with pytest.raises(MemoryError, match="no memory for"):
            draw(count)
    assert stream.normal(3).tolist() == calibench.Stream(1, "x").normal(3).tolist()


@pytest.mark.parametrize("size", [(10**6, 10**6), (2**31, 2**31), (2**62, 8)])
def test_an_image_that_is_too_large_is_refused_with_the_limit(size: tuple[int, int]) -> None:
    for make in (
        lambda: calibench.RectifyMap(SCENE.camera, (640, 480), SCENE.camera, size),
        lambda: calibench.RectifyMap(SCENE.camera, size, SCENE.camera),
        lambda: BOARD.photograph(PINHOLE, size, np.eye(3), [0, 0, 100.0]),
    ):
        with pytest.raises(calibench.SettingsError, match="at most 268435456 pixels") as error:
            make()
        assert error.value.kind == "TooManyPixels" and error.value.numbers["width"] == size[0]


IMPOSSIBLE: dict[str, tuple[Callable[[], object], str]] = {
    "negative seed": (lambda: calibench.Stream(-1, "x"), "seed = -1 is out of range"),
    "seed beyond 64 bits": (lambda: calibench.Stream(2**64, "x"), "seed = 18446744073709551616 is out of range"),
    "negative trial": (lambda: calibench.Stream(1, "x", -1), "trial = -1"),
    "negative count": (lambda: calibench.Stream(1, "x").normal(-1), "count = -1"),
    "count beyond 64 bits": (lambda: calibench.Stream(1, "x").normal(2**64), "count = "),
    "nothing below 0": (lambda: calibench.Stream(1, "x").below(3, 0), "bound = 0: no whole number lies below 0"),
    "range turned round": (lambda: calibench.Stream(1, "x").uniform(3, 5.0, 1.0), "low = 5: the range ends at high = 1"),
    "range without end": (lambda: calibench.Stream(1, "x").uniform(3, 0.0, np.inf), "high = inf"),
    "angle NaN": (lambda: calibench.looking_at_centre((0.0, np.nan, 0.0), 100.0), "xyz_degrees = NaN"),
    "distance NaN": (lambda: calibench.looking_at_centre((0.0, 0.0, 0.0), np.nan), "distance = NaN"),
    "noise 0": (lambda: calibench.cramer_rao(SCENE, 0.0), "sigma_px = 0"),
    "noise negative": (lambda: calibench.cramer_rao(SCENE, -0.1), "sigma_px = -0.1"),
    "noise NaN": (lambda: calibench.cramer_rao(SCENE, np.nan), "sigma_px = NaN"),
    "factor negative": (lambda: calibench.cramer_rao(SCENE, 0.1).scaled(-1.0), "factor = -1"),
    "factor NaN": (lambda: calibench.cramer_rao(SCENE, 0.1).scaled(np.nan), "factor = NaN"),
    "RMSE of no noise": (lambda: calibench.RmseDistribution(0.0, 100, 10), "sigma_px = 0"),
    "RMSE of no points": (lambda: calibench.RmseDistribution(0.1, 0, 0), "points = 0"),
    "RMSE of too many parameters": (lambda: calibench.RmseDistribution(0.1, 5, 10), "parameters = 10: 5 points have 10 coordinates"),
    "RMSE of negative points": (lambda: calibench.RmseDistribution(0.1, -5, 1), "points = -5"),
    "RMSE of NaN": (lambda: calibench.RmseDistribution(0.1, 50, 10).cdf(np.nan), "rmse_px = NaN"),
    "no image": (lambda: calibench.calibrate(SCENE.points, SCENE.pixels, image_size=(0, 0)), "an image has pixels"),
    "image of negative size": (lambda: calibench.calibrate(SCENE.points, SCENE.pixels, image_size=(-640, 480)), "image_size = \\(-640, 480\\) is out of range"),
    "steps": (lambda: calibench.calibrate(SCENE.points, SCENE.pixels, max_iterations=-1), "max_iterations = -1 is out of range"),
    "no scene": (lambda: calibench.Scene(SCENE.camera, (0, 480), SCENE.points, SCENE.rotations, SCENE.translations), "an image has pixels"),
}


@pytest.mark.parametrize(("call", "text"), IMPOSSIBLE.values(), ids=IMPOSSIBLE.keys())
def test_an_argument_that_cannot_be_is_refused_by_its_name(call: Callable[[], object], text: str) -> None:
    with pytest.raises(calibench.SettingsError, match=text):
        call()


def test_an_argument_of_another_type_is_named() -> None:
    for options, text in (
        ({"image_size": "640x480"}, "image_size = '640x480'"),
        ({"hold": {"k1": "small"}}, "hold\\[\"k1\"\\] = 'small'"),
        ({"hold": 3}, "hold: expected a dict"),
        ({"priors": {"k1": 0.1}}, "priors\\[\"k1\"\\] = 0.1"),
        ({"tie": "square"}, "tie = 'square'"),
        ({"max_iterations": 2.5}, "max_iterations = 2.5"),
        ({"free": 7}, "free = 7"),
    ):
        with pytest.raises(TypeError, match=text):
            calibench.calibrate(SCENE.points, SCENE.pixels, **options)
    with pytest.raises(TypeError, match="give both or none"):
        calibench.Stream(1, "x").uniform(3, 5.0)


def test_a_scene_of_nothing_is_refused() -> None:
    for points, views in ((0, 4), (63, 0)):
        with pytest.raises(calibench.SceneError) as error:
            calibench.Scene(SCENE.camera, (640, 480), SCENE.points[:points], SCENE.rotations[:views], SCENE.translations[:views])
        assert (error.value.kind, error.value.numbers) == ("Empty", {"points": points, "views": views})


def test_marks_of_another_image_than_the_stated_one_are_refused() -> None:
    for size, advice in (((480, 640), "sides of image_size swapped"), ((320, 240), "check image_size and pixels")):
        for refuse in (
            lambda: calibench.calibrate(SCENE.points, SCENE.pixels, image_size=size),
            lambda: calibench.compare_models(SCENE.points, SCENE.pixels, image_size=size),
            lambda: calibench.fit_views(calibench.Board("circles:9x7:10mm"), SCENE.pixels, image_size=size),
        ):
            with pytest.raises(calibench.ViewError, match=advice) as error:
                refuse()
            outside = (SCENE.pixels[..., 0] > size[0] - 1 + 0.02 * max(size)) | (SCENE.pixels[..., 1] > size[1] - 1 + 0.02 * max(size))
            assert error.value.kind == "OutsideImage" and error.value.numbers["outside"] == outside.sum()
    # A single mark outside is let through.
    pixels = SCENE.pixels
    pixels[0, 0] = (-30.0, 50.0)
    assert calibench.calibrate(SCENE.points, pixels, image_size=(640, 480)).image_size == (640, 480)


def test_an_error_of_another_length_than_the_parameters_is_refused() -> None:
    bound = calibench.cramer_rao(SCENE, 0.1)
    assert bound.normalised_error_squared([0.0] * 6) == 0.0
    with pytest.raises(calibench.ArrayError, match="5 numbers for 6 parameters"):
        bound.normalised_error_squared([0.0] * 5)


def test_no_digit_is_a_plain_zero() -> None:
    assert str(calibench.digits(1.0, 0.0)) == "0.0" and calibench.digits(1.0, 1.0) == 15.0


def test_fewer_than_four_marks_locate_nothing() -> None:
    for marks in range(4):
        assert calibench.locate(SCENE.camera, SCENE.points[:marks].reshape(-1, 2), SCENE.pixels[0, :marks].reshape(-1, 2)) is None


def test_the_rmse_is_of_weighted_residuals_and_of_all_whatever_the_loss() -> None:
    pixels = SCENE.observe(0.1, calibench.Stream(1, "weights"))
    pixels[1, 7] += 5.0
    weights = np.linspace(0.5, 2.0, 4 * 63).reshape(4, 63)
    for options in ({}, {"loss": "huber:0.2"}, {"weights": weights}, {"weights": weights, "model": "rational", "free": "fx,fy,cx,cy,k1,k2"}):
        result = calibench.calibrate(SCENE.points, pixels, **options)
        residuals, given = np.stack(result.residuals), np.asarray(options.get("weights", np.ones((4, 63))))
        square = (given[..., None] ** 2 * residuals**2).sum()
        assert result.rmse_px == pytest.approx(np.sqrt(square / residuals[..., 0].size), rel=1e-12)
        assert result.sigma_px == pytest.approx(np.sqrt(square / result.degrees_of_freedom), rel=1e-12)
        assert result.view_rmse_px == pytest.approx(np.sqrt((residuals**2).sum(axis=2).mean(axis=1)), rel=1e-12)

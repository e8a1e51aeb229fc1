"""Arrays of every kind that NumPy reads as numbers give the same points; masked and complex ones are refused everywhere."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import calibench

SCENE = calibench.Scene.example()
POINTS = np.round(SCENE.points)
# Whole pixels, so that every kind of number holds them exactly.
PIXELS = np.round(SCENE.pixels)
MASK = np.zeros(PIXELS.shape, dtype=bool)
MASK[0, 0] = True


class Given:
    """What gives itself as an array, such as a tensor."""

    def __init__(self, array: np.ndarray) -> None:
        self.array = array

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        return self.array


KINDS: dict[str, Callable[[np.ndarray], Any]] = {
    "float32": lambda array: array.astype("f4"),
    "float16": lambda array: array.astype("f2"),
    "int64": lambda array: array.astype(int),
    "int16": lambda array: array.astype("i2"),
    "big-endian": lambda array: array.astype(">f8"),
    "long double": lambda array: array.astype(np.longdouble),
    "list": lambda array: array.tolist(),
    "tuple": lambda array: tuple(array.tolist()),
    "__array__": Given,
    "memoryview": lambda array: memoryview(np.ascontiguousarray(array)),  # type: ignore[arg-type]
    "strided": lambda array: np.repeat(array, 2, axis=0)[::2],
    "read-only": lambda array: np.frombuffer(array.tobytes()).reshape(array.shape),
    "Z = 0": lambda array: np.concatenate([array, np.zeros((*array.shape[:-1], 1))], axis=-1),
    "OpenCV": lambda array: array[..., None, :],
    "OpenCV, Z = 0": lambda array: np.concatenate([array, np.zeros((*array.shape[:-1], 1))], axis=-1)[..., None, :].astype("f4"),
    "OpenCV, list": lambda array: array[..., None, :].tolist(),
}


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
def test_points_shared_or_of_every_view_and_pixels_may_be_of_any_kind(kind: Callable[[np.ndarray], Any]) -> None:
    plain = calibench.calibrate(POINTS, PIXELS)
    assert calibench.calibrate(kind(POINTS), kind(PIXELS)) == plain
    assert calibench.calibrate(kind(np.repeat(POINTS[None], 4, axis=0)), [kind(view) for view in PIXELS]) == plain
    assert calibench.calibrate([kind(POINTS)] * 4, PIXELS) == plain
    found, usual = calibench.locate(SCENE.camera, kind(POINTS), kind(PIXELS[0])), calibench.locate(SCENE.camera, POINTS, PIXELS[0])
    assert found is not None and usual is not None and (found.rotation == usual.rotation).all()


def test_views_of_several_lengths_come_as_a_list_or_as_an_array_of_objects() -> None:
    points, pixels = [POINTS, POINTS[:40], POINTS, POINTS], [PIXELS[0], PIXELS[1][:40], PIXELS[2], PIXELS[3]]
    ragged = np.empty(4, dtype=object)
    ragged[:] = pixels
    assert calibench.calibrate(points, ragged) == calibench.calibrate(points, pixels)
    assert calibench.calibrate(iter(points), iter(pixels)) == calibench.calibrate(points, pixels)  # type: ignore[arg-type]


TAKES: dict[str, Callable[[np.ndarray], Any]] = {
    "calibrate": lambda pixels: calibench.calibrate(POINTS, pixels),
    "calibrate, list": lambda pixels: calibench.calibrate(POINTS, list(pixels)),
    "points": lambda pixels: calibench.calibrate(pixels[0], PIXELS),
    "weights": lambda pixels: calibench.calibrate(POINTS, PIXELS, weights=pixels[..., 0]),
    "weights, list": lambda pixels: calibench.calibrate(POINTS, PIXELS, weights=list(pixels[..., 0])),
    "fit_views": lambda pixels: calibench.fit_views(calibench.Board("circles:9x7:10mm"), pixels),
    "compare_models": lambda pixels: calibench.compare_models(POINTS, pixels),
    "locate": lambda pixels: calibench.locate(SCENE.camera, POINTS, pixels[0]),
    "project": lambda pixels: SCENE.camera.project(pixels[0]),
    "unproject": lambda pixels: SCENE.camera.unproject(pixels[0]),
    "undistort_points": lambda pixels: SCENE.camera.undistort_points(pixels[0]),
    "distort_points": lambda pixels: SCENE.camera.distort_points(pixels[0]),
    "rotation": lambda pixels: SCENE.camera.project(POINTS, np.eye(3) + 0 * pixels[0, 0, 0], [0, 0, 1]),
    "translation": lambda pixels: SCENE.camera.project(POINTS, np.eye(3), pixels[0, :3, 0]),
    "Scene": lambda pixels: calibench.Scene(SCENE.camera, (640, 480), pixels[0], SCENE.rotations, SCENE.translations),
    "Scene, poses": lambda pixels: calibench.Scene(SCENE.camera, (640, 480), POINTS, SCENE.rotations, pixels[0, :4]),
    "error": lambda pixels: calibench.cramer_rao(SCENE, 0.1).normalised_error_squared(pixels[0, :6, 0]),
}


@pytest.mark.parametrize("take", TAKES.values(), ids=TAKES.keys())
def test_complex_and_masked_arrays_are_refused(take: Callable[[np.ndarray], Any]) -> None:
    with pytest.raises(calibench.ArrayError, match="fill what is masked|leave the masked") as masked:
        take(np.ma.array(PIXELS, mask=MASK))
    assert masked.value.kind == "Masked"
    with pytest.raises(calibench.ArrayError, match="complex") as imaginary:
        take(PIXELS + 0.5j)
    assert imaginary.value.kind == "Complex"


def test_masked_images_are_refused() -> None:
    image = np.ma.array(np.zeros((480, 640), dtype=np.uint8), mask=False)
    takes = (calibench.Board("circles:9x7:10mm").detect, SCENE.camera.undistort_image, calibench.RectifyMap(SCENE.camera, (640, 480), SCENE.camera).apply)
    for take in takes:
        with pytest.raises(calibench.ArrayError, match="masked"):
            take(image)


def test_a_wrong_shape_is_told_with_the_argument_and_its_numbers() -> None:
    cases: list[tuple[Callable[[], object], str, dict[str, object]]] = [
        (lambda: calibench.calibrate(POINTS, PIXELS[0]), "Shape", {"argument": "pixels", "got": (63, 2)}),
        (lambda: calibench.calibrate(POINTS, [PIXELS[0], PIXELS[1, :, 0]]), "Shape", {"argument": "pixels[1]", "got": (63,)}),
        (lambda: SCENE.camera.unproject(np.zeros((3, 4))), "Columns", {"argument": "pixels", "got": 4}),
        (lambda: SCENE.camera.project(POINTS, np.eye(3), [1.0, 2.0]), "Shape", {"argument": "translation", "got": (2,)}),
        (lambda: SCENE.camera.project(POINTS, 2 * np.eye(3), [0, 0, 1]), "NoRotation", {"argument": "rotation"}),
        (lambda: SCENE.camera.project("points"), "NotNumbers", {"argument": "points"}),
        (lambda: SCENE.camera.project([[1.0, 2.0], [3.0]]), "NotNumbers", {"argument": "points"}),
    ]
    for take, kind, numbers in cases:
        with pytest.raises(calibench.ArrayError) as error:
            take()
        assert error.value.kind == kind and numbers.items() <= error.value.numbers.items(), error.value
    with pytest.raises(calibench.ViewError) as views:
        calibench.calibrate([POINTS] * 3, PIXELS)
    assert (views.value.kind, views.value.numbers) == ("Views", {"points": 3, "pixels": 4})
    with pytest.raises(calibench.ViewError) as of_weights:
        calibench.calibrate(POINTS, PIXELS, weights=np.ones((3, 63)))
    assert of_weights.value.numbers == {"weights": 3, "pixels": 4}

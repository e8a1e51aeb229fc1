"""Calibrations from arrays: every option, every shape, and what is refused."""

import json
import pickle
import threading
import time

import numpy as np
import pytest

import calibench

SCENE = calibench.Scene.example()
NOISE = 0.1


def observed(trial: int = 0) -> np.ndarray:
    return SCENE.observe(NOISE, calibench.Stream(seed=2, scenario="python", trial=trial))


def same(a: calibench.Calibration, b: calibench.Calibration) -> bool:
    return a.camera == b.camera and a.covariance == b.covariance and a.rmse_px == b.rmse_px


def test_the_shape_of_the_arrays_does_not_matter() -> None:
    pixels = observed()
    plain = calibench.calibrate(SCENE.points, pixels)
    with_z = np.pad(SCENE.points, ((0, 0), (0, 1)))
    assert same(plain, calibench.calibrate([SCENE.points] * 4, list(pixels)))
    assert same(plain, calibench.calibrate([with_z] * 4, [view[:, None, :] for view in pixels]))
    assert same(plain, calibench.calibrate(SCENE.points, np.asfortranarray(pixels)))
    assert same(plain, calibench.calibrate(np.repeat(SCENE.points[None], 4, axis=0), pixels[::-1][::-1]))
    single = pixels.astype(np.float32)
    assert same(calibench.calibrate(SCENE.points, single.astype(float)), calibench.calibrate(SCENE.points, list(single)))


def test_a_result_has_its_arrays() -> None:
    result = calibench.calibrate(SCENE.points, observed(), image_size=(640, 480))
    assert result.free == ("fx", "fy", "cx", "cy", "k1", "k2") and result.image_size == (640, 480)
    assert result.rotations.shape == (4, 3, 3) and result.translations.shape == (4, 3)
    assert result.covariance.intrinsics.shape == (6, 6)
    assert result.covariance.poses.shape == (4, 6, 6) and result.covariance.cross.shape == (4, 6, 6)
    deviations = np.sqrt(np.diag(result.covariance.intrinsics))
    assert list(result.standard_deviations.values()) == deviations.tolist()
    residuals = np.stack(result.residuals)
    assert result.rmse_px == pytest.approx(np.sqrt((residuals**2).sum(axis=2).mean()), rel=1e-12)
    assert result.degrees_of_freedom == 504 - 30 and len(result.view_rmse_px) == 4
    for rotation, translation, view, residual in zip(result.rotations, result.translations, observed(), residuals, strict=True):
        predicted = result.camera.project(SCENE.points, rotation, translation)
        assert np.abs(predicted - view - residual).max() < 1e-10
    assert result.certificate is not None and result.certificate.holds
    assert result.conditioning is not None and result.conditioning.weakest[0].weight != 0.0
    fields = json.loads(result.to_json(["a", "b", "c", "d"]))
    assert fields["camera"]["fx"] == result.camera.fx and fields["views"][3]["name"] == "d"
    assert "loss" not in fields


def test_a_result_names_its_robust_loss() -> None:
    result = calibench.calibrate(SCENE.points, observed(), loss="huber:0.3")
    copy = pickle.loads(pickle.dumps(result))
    assert copy == result
    assert [json.loads(each.to_json())["loss"] for each in (result, copy)] == ["huber:0.3"] * 2


def test_options_do_what_they_say() -> None:
    pixels = observed()
    held = calibench.calibrate(SCENE.points, pixels, free="fx,fy,k1", hold={"cx": 326.0, "cy": 243.0, "k2": 0.05})
    assert held.free == ("fx", "fy", "k1") and held.camera.cx == 326.0 and held.camera.parameters["k2"] == 0.05
    tied = calibench.calibrate(SCENE.points, pixels, tie=1.0)
    assert tied.camera.fx == tied.camera.fy and tied.covariance.fy_per_fx == 1.0
    assert tied.standard_deviations["fx"] == tied.standard_deviations["fy"]
    known = calibench.calibrate(SCENE.points, pixels, priors={"k1": (-0.18, 0.001)})
    assert known.standard_deviations["k1"] < 0.001 and known.priors[0].mean == -0.18
    intervals = calibench.calibrate(SCENE.points, pixels, intervals=0.95).intervals
    assert [interval.parameter for interval in intervals] == list(held.free[:2]) + ["cx", "cy", "k1", "k2"]
    low, high = intervals[0].low, intervals[0].high
    assert low is not None and high is not None and low < calibench.calibrate(SCENE.points, pixels).camera.fx < high


def test_a_robust_loss_resists_an_outlier_and_the_warning_names_it() -> None:
    pixels = observed()
    pixels[2, 10] += 8.0
    plain = calibench.calibrate(SCENE.points, pixels)
    (outlier,) = [w for w in plain.warnings if w.kind == "Outliers"]
    assert (outlier.numbers["view"], outlier.numbers["point"], outlier.numbers["marks"]) == (2, 10, 1)
    assert outlier.numbers["residual_px"] > 5.0 and "view 2, point 10" in outlier.message
    robust = calibench.calibrate(SCENE.points, pixels, loss="huber:0.3")
    errors = [abs(r.camera.fx - SCENE.camera.fx) for r in (plain, robust)]
    assert errors[1] < 0.5 * errors[0]


def test_weights_count_as_standard_deviations_do() -> None:
    noise = calibench.Stream(seed=2, scenario="weights")
    sigma = np.where(np.arange(63) % 2, 0.05, 0.5)
    pixels = SCENE.pixels + noise.normal(504).reshape(4, 63, 2) * sigma[:, None]
    weights = [0.1 / sigma] * 4
    weighted = calibench.calibrate(SCENE.points, pixels, weights=weights)
    assert weighted.standard_deviations["fx"] < 0.6 * calibench.calibrate(SCENE.points, pixels).standard_deviations["fx"]
    with pytest.raises(calibench.ViewError) as error:
        calibench.calibrate(SCENE.points, pixels, weights=weights[:3] + [np.ones(62)])
    assert error.value.numbers == {"marks": 63, "weights": 62, "view": 3}


FREE = {
    "brown-conrady": "fx,fy,cx,cy,k1,k2",
    "rational": "fx,fy,cx,cy,k1,k2",
    "thin-prism": "fx,fy,cx,cy,k1,k2",
    "tilted": "fx,fy,cx,cy,k1,k2",
    "kannala-brandt": ["fx", "fy", "cx", "cy", "k1", "k2"],
    "division": None,
    "double-sphere": "fx,fy,cx,cy,alpha",
    "halcon-polynomial": "fx,fy,cx,cy,k1,k2",
}


@pytest.mark.parametrize("model", FREE)
def test_every_lens_model_is_calibrated(model: str) -> None:
    result = calibench.calibrate(SCENE.points, observed(), model=model, free=FREE[model])
    # The noise floor of 0.1414 px; a model that did not fit would be far above.
    assert result.camera.model == model and result.rmse_px < 0.15


def test_models_are_compared_by_views_that_were_left_out() -> None:
    # Marks to 0.1 px would not do: in four views they fit one coefficient of the division model as well, and at 0.01 px a
    # double sphere.
    noise = 0.001
    pixels = SCENE.observe(noise, calibench.Stream(seed=2, scenario="python", trial=0))
    compared = calibench.compare_models(SCENE.points, pixels)
    best = compared[0]
    assert (best.model, best.coefficients) == ("brown-conrady", "k1,k2")
    assert best.hold_out_px is not None and abs(best.hold_out_px - noise) < 0.0002
    assert len({(one.model, one.coefficients) for one in compared}) == len(compared) > 5


def test_a_bowed_board_is_estimated() -> None:
    x, y = SCENE.points[:, 0] / 40.0, SCENE.points[:, 1] / 30.0
    height = 0.4 * (1 - x**2) - 0.2 * (1 - y**2)
    bowed = np.c_[SCENE.points, height]
    poses = zip(SCENE.rotations, SCENE.translations, strict=True)
    noise = calibench.Stream(seed=2, scenario="bow").normal(504).reshape(4, 63, 2)
    pixels = np.stack([SCENE.camera.project(bowed, r, t) for r, t in poses]) + 0.02 * noise
    shape = calibench.calibrate(SCENE.points, pixels, board_shape="bow:free").board
    assert shape is not None
    assert abs(shape.bow_x - 0.4) < 4 * shape.standard_deviations[0]
    assert abs(shape.bow_y + 0.2) < 4 * shape.standard_deviations[1]
    assert shape.region == ((-40.0, -30.0), (40.0, 30.0))


def test_what_determines_no_camera_is_refused_with_its_numbers() -> None:
    with pytest.raises(calibench.CalibrationError) as error:
        calibench.calibrate(SCENE.points, observed()[:1])
    assert error.value.kind == "TooFewViews"
    assert error.value.numbers == {"need": 2, "got": 1, "linear": 4, "copies": 0}
    broken = observed()
    broken[1, 5, 0] = np.nan
    with pytest.raises(calibench.ViewError) as of_view:
        calibench.calibrate(SCENE.points, broken)
    assert of_view.value.kind == "NotFinite" and of_view.value.numbers["view"] == 1 and of_view.value.numbers["index"] == 5
    with pytest.raises(calibench.CalibrationError) as held:
        calibench.calibrate(SCENE.points, observed(), free="fx,fy")
    assert held.value.kind == "HeldWithoutValue" and held.value.numbers == {"parameter": "cx"}
    assert isinstance(held.value, calibench.CalibenchError) and isinstance(held.value, ValueError)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"free": "fx,focal"}, "unknown camera parameter `focal`"),
        ({"loss": "tukey:1"}, "expected squares, huber:PX or cauchy:PX"),
        ({"board_shape": "wavy"}, "expected flat, bow:SD or bent:SD"),
        ({"intervals": 95.0}, "expected a probability between 0 and 1"),
        ({"model": "fisheye"}, "unknown lens model"),
    ],
)
def test_an_option_that_cannot_be_is_refused(options: dict, text: str) -> None:
    with pytest.raises(calibench.SettingsError, match=text):
        calibench.calibrate(SCENE.points, observed(), **options)


def test_wrong_arguments_are_told_from_wrong_data() -> None:
    with pytest.raises(TypeError, match="no option \"weigths\""):
        calibench.calibrate(SCENE.points, observed(), weigths=None)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="points of 3 views, pixels of 4"):
        calibench.calibrate([SCENE.points] * 3, observed())
    with pytest.raises(ValueError, match="Z = 1"):
        calibench.calibrate([np.pad(SCENE.points, ((0, 0), (0, 1)), constant_values=1.0)] * 4, observed())


def test_a_known_camera_locates_a_board() -> None:
    found = calibench.locate(SCENE.camera, SCENE.points, SCENE.pixels[3])
    assert found is not None
    assert np.abs(found.rotation - SCENE.rotations[3]).max() < 1e-9
    assert np.abs(found.translation - SCENE.translations[3]).max() < 1e-6


def many_views() -> tuple[np.ndarray, np.ndarray]:
    stream = calibench.Stream(seed=2, scenario="many")
    poses = [calibench.looking_at_centre(tuple(stream.uniform(3, -30.0, 30.0)), 150.0) for _ in range(150)]
    scene = calibench.Scene(SCENE.camera, (640, 480), SCENE.points, [r for r, _ in poses], [t for _, t in poses])
    return scene.points, scene.observe(NOISE, stream)


def test_other_threads_of_python_go_on_meanwhile() -> None:
    points, pixels = many_views()
    ticks, stop = [], threading.Event()

    def tick() -> None:
        while not stop.wait(0.001):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    started = time.perf_counter()
    calibench.calibrate(points, pixels, intervals=0.95)
    ended = time.perf_counter()
    stop.set()
    thread.join()
    assert sum(started < at < ended for at in ticks) >= 0.02 * (ended - started) / 0.001


def test_calibrations_in_several_threads_have_the_bits_of_one() -> None:
    alone = [calibench.calibrate(SCENE.points, observed(trial)).camera for trial in range(40)]
    together: list[calibench.Camera | None] = [None] * 40

    def work(first: int) -> None:
        for trial in range(first, 40, 4):
            together[trial] = calibench.calibrate(SCENE.points, observed(trial)).camera

    threads = [threading.Thread(target=work, args=(first,)) for first in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone

"""The experiment of four views from Python: the numbers of `golden/four-pose.snap`, to the last bit."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import calibench

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2")
SIGMA_PX = 0.1


def golden() -> dict[str, float]:
    lines = (ROOT / "golden/four-pose.snap").read_text().splitlines()
    rows = (line.split(" | ") for line in lines if line.startswith("number | "))
    return {row[1]: float(row[2]) for row in rows}


def printed() -> dict[str, float]:
    """The chapter's table."""
    values = tomllib.loads((ROOT / "golden/published.toml").read_text())["value"]
    by_id = {value["id"]: value["printed"] for value in values}
    return {name: float(by_id[f"four-pose.{name}"]) for name in NAMES}


def camera_of(values: dict[str, float]) -> calibench.Camera:
    return calibench.Camera(1.0, 1.0, 0.0, 0.0).replace(**values)


@pytest.fixture(scope="module")
def numbers() -> dict[str, float | None]:
    """What the experiment computes of its one draw, by the names of the snapshot."""
    scene = calibench.Scene.example()
    pixels = scene.observe(SIGMA_PX, calibench.Stream(seed=1, scenario="four-pose"))
    result = calibench.calibrate(scene.points, pixels)
    bound = calibench.cramer_rao(scene, SIGMA_PX)
    errors = calibench.errors_of(scene.camera, result.camera, bound)
    book = calibench.errors_of(scene.camera, camera_of(printed()), bound)
    expected = calibench.RmseDistribution(SIGMA_PX, points=pixels.shape[0] * pixels.shape[1], parameters=6 + 6 * len(pixels))
    found: dict[str, float | None] = {
        "rmse": result.rmse_px,
        "rmse-expected": expected.mean_px,
        "rmse-sd": expected.standard_deviation_px,
        "rmse-p-value-ours": expected.p_value(result.rmse_px),
        "noise-floor": expected.noise_floor_px,
        "chi-squared-ours": errors.chi_squared,
        "p-value-ours": errors.p_value,
        "chi-squared-book": book.chi_squared,
        "p-value-book": book.p_value,
        "k1-k2-correlation": bound.correlation("k1", "k2"),
        "fx-fy-correlation": bound.correlation("fx", "fy"),
        "pairs": float(pixels.shape[0] * pixels.shape[1]),
    }
    for name in NAMES:
        found |= {
            f"{name}-true": scene.camera.parameters[name],
            name: result.camera.parameters[name],
            f"{name}-error": errors.error[name],
            f"{name}-sd": bound.standard_deviations[name],
            f"{name}-z": errors.z[name],
            f"{name}-book-z": book.z[name],
        }
    return found


def test_the_draw_has_the_numbers_of_the_snapshot_to_the_last_bit(numbers: dict[str, float | None]) -> None:
    snapshot = golden()
    assert len(numbers) == 48
    assert {name: snapshot[name] for name in numbers} == numbers


def test_two_thousand_trials_have_the_numbers_of_the_snapshot_to_the_last_bit() -> None:
    scene, trials = calibench.Scene.example(), 2000
    bound = calibench.cramer_rao(scene, SIGMA_PX)
    truth = np.array([scene.camera.parameters[name] for name in NAMES])
    errors = np.empty((trials, len(NAMES)))
    for trial in range(trials):
        noise = calibench.Stream(seed=1, scenario="four-pose/monte-carlo", trial=trial)
        result = calibench.calibrate(scene.points, scene.observe(SIGMA_PX, noise))
        assert result.termination == "converged"
        errors[trial] = [result.camera.parameters[name] for name in NAMES] - truth
    # Added one after the other, as the experiment does: another order has other roundings.
    total, squares = np.cumsum(errors, axis=0)[-1], np.cumsum(errors * errors, axis=0)[-1]
    deviation = np.sqrt((squares - total * total / trials) / (trials - 1))
    found = {}
    for i, name in enumerate(NAMES):
        found[f"{name}-bias"] = total[i] / trials
        found[f"{name}-sd-ratio"] = deviation[i] / bound.standard_deviations[name]
    snapshot = golden()
    assert {name: snapshot[name] for name in found} == found


def test_views_that_face_the_camera_are_refused_with_what_cannot_be_separated() -> None:
    scene = calibench.Scene.example()
    poses = [calibench.looking_at_centre((0.0, 0.0, 0.0), distance) for distance in (100.0, 120.0, 140.0, 160.0)]
    rotations, translations = zip(*poses, strict=True)
    facing = calibench.Scene(scene.camera, scene.image_size, scene.points, rotations, translations)
    with pytest.raises(calibench.BoundError) as bound:
        calibench.cramer_rao(facing, SIGMA_PX)
    assert bound.value.numbers == {"free": "fx,fy,cx,cy,k1,k2", "views": 4}
    with pytest.raises(calibench.CalibrationError, match="cannot separate focal length") as refused:
        calibench.calibrate(facing.points, facing.observe(SIGMA_PX, calibench.Stream(1, "facing")), image_size=facing.image_size)
    assert refused.value.kind == "NotIdentifiable"
    assert refused.value.numbers["inseparable"][:2] == ["focal-length", "distance"]

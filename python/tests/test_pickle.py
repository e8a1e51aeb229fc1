"""Results go to other processes and come back with every bit."""

import copy
import math
import multiprocessing
import pickle

import numpy as np
import pytest

import calibench

SCENE = calibench.Scene.example()
OPTIONS: list[dict] = [
    {"image_size": (640, 480)},
    {"model": "kannala-brandt", "free": "fx,fy,cx,cy,k1,k2"},
    {"intervals": 0.95, "tie": 1.0, "priors": {"k1": (-0.18, 0.01)}},
    {"loss": "huber:0.2", "board_shape": "bow:0.5"},
    {"polish": True, "free": "fx,fy,k1", "hold": {"cx": 326.0, "cy": 243.0, "k2": 0.05}},
]


def calibrated(trial: int) -> calibench.Calibration:
    pixels = SCENE.observe(0.1, calibench.Stream(seed=5, scenario="pool", trial=trial))
    return calibench.calibrate(SCENE.points, pixels, **OPTIONS[trial % len(OPTIONS)])


def same(one: calibench.Calibration, other: calibench.Calibration) -> bool:
    arrays = ("rotations", "translations", "view_rmse_px", "residuals")
    numbers = ("intervals", "warnings", "certificate", "conditioning", "board", "termination", "image_size", "free", "priors", "starts", "solver_seconds")
    return (
        one == other
        and one.camera == other.camera
        and one.covariance.cross.tobytes() == other.covariance.cross.tobytes()
        and all(np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes() for name in arrays)
        and all(getattr(one, name) == getattr(other, name) for name in numbers)
    )


@pytest.mark.parametrize("trial", range(len(OPTIONS)))
@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))], ids=["copy", "deepcopy", "pickle"])
def test_a_calibration_keeps_every_bit(trial: int, way) -> None:
    result = calibrated(trial)
    assert same(result, way(result))


def test_a_pool_of_processes_returns_calibrations() -> None:
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.map(calibrated, range(5))
    ours = [calibrated(trial) for trial in range(5)]
    assert [one.camera for one in found] == [one.camera for one in ours]
    assert [one.covariance for one in found] == [one.covariance for one in ours]


def test_what_is_made_of_arguments_is_made_again_of_them() -> None:
    board = calibench.Board("circles:9x7:10mm:3mm")
    table = calibench.RectifyMap(SCENE.camera, (640, 480), SCENE.camera.replace(k1=0.0, k2=0.0), (320, 240))
    for way in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        assert (way(SCENE).pixels == SCENE.pixels).all() and way(SCENE) == SCENE and way(SCENE).image_size == (640, 480)
        assert way(board) == board and (way(board).points == board.points).all() and hash(way(board)) == hash(board)
        bound = calibench.cramer_rao(SCENE, 0.1)
        assert way(bound) == bound and way(bound).poses.tobytes() == bound.poses.tobytes()
        rmse = calibench.RmseDistribution(0.1, 252, 30)
        assert way(rmse) == rmse and way(rmse).mean_px == rmse.mean_px
        assert np.array_equal(way(table).sources, table.sources, equal_nan=True)
    fit = calibench.fit_views(board, SCENE.observe(0.1, calibench.Stream(1, "fit")))
    again = pickle.loads(pickle.dumps(fit))
    assert again.calibration == fit.calibration and again.kept == fit.kept


def test_a_stream_goes_on_elsewhere_where_it_was_left() -> None:
    stream = calibench.Stream(seed=7, scenario="pickled", trial=2, purpose="pose")
    stream.normal(1001)
    for way in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        other, again = way(stream), way(stream)
        assert repr(other) == "Stream(seed=7, scenario=\"pickled\", trial=2, purpose=\"pose\")"
        assert other.normal(5).tobytes() == again.normal(5).tobytes()
    assert pickle.loads(pickle.dumps(stream)).uniform(3).tobytes() == stream.uniform(3).tobytes()


def test_errors_go_through_pickle_too() -> None:
    with pytest.raises(calibench.CalibrationError) as error:
        calibench.calibrate(SCENE.points, SCENE.pixels[:1])
    again = pickle.loads(pickle.dumps(error.value))
    assert (str(again), again.kind, again.numbers) == (str(error.value), error.value.kind, error.value.numbers)


def test_numbers_that_are_not_finite_are_kept() -> None:
    bound = calibench.cramer_rao(SCENE, 0.1).scaled(1e308)
    bound = bound.scaled(1e308)
    assert math.isinf(abs(bound.intrinsics).max())
    assert pickle.loads(pickle.dumps(bound)).intrinsics.tobytes() == bound.intrinsics.tobytes()


def test_cameras_are_keys() -> None:
    camera = SCENE.camera
    assert hash(camera) == hash(camera.replace()) and len({camera, camera.replace(), camera.replace(fx=601.0)}) == 2
    assert hash(camera.replace(k3=0.0)) == hash(camera.replace(k3=-0.0)) and camera.replace(k3=0.0) == camera.replace(k3=-0.0)

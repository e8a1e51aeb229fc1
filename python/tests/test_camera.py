"""Cameras of every lens model: their parameters, and points through the lens and back."""

import pickle

import numpy as np
import pytest

import calibench

COEFFICIENTS = {
    "brown-conrady": {"k1": -0.18, "k2": 0.05, "p1": 1e-3, "p2": -2e-3, "k3": 0.01},
    "rational": {"k1": 0.2, "k2": 0.05, "k4": 0.4, "k5": 0.03, "p1": 1e-4},
    "thin-prism": {"k1": 0.1, "s1": 1e-3, "s3": -1e-3},
    "tilted": {"k1": 0.1, "tau_x": 0.02, "tau_y": -0.01},
    "kannala-brandt": {"k1": -0.02, "k2": 0.003},
    "division": {"k1": -0.1},
    "double-sphere": {"xi": 0.1, "alpha": 0.55},
    "halcon-polynomial": {"k1": 0.2, "k2": 0.03, "p1": 1e-3, "p2": -2e-3, "k3": 0.01},
}


@pytest.fixture(params=COEFFICIENTS, ids=str)
def camera(request: pytest.FixtureRequest) -> calibench.Camera:
    return calibench.Camera(600.0, 610.0, 320.0, 240.0, model=request.param, skew=0.5, **COEFFICIENTS[request.param])


def pixels() -> np.ndarray:
    u, v = np.meshgrid(np.linspace(100, 540, 9), np.linspace(60, 420, 7))
    return np.stack([u.ravel(), v.ravel()], axis=1)


def test_rays_go_back_to_their_pixels(camera: calibench.Camera) -> None:
    rays = camera.unproject(pixels())
    assert np.linalg.norm(rays, axis=1) == pytest.approx(1.0, abs=1e-15)
    # Two maps of pixels near 640, a few roundings of 640 each.
    assert np.abs(camera.project(rays) - pixels()).max() < 1e-10


def test_undistorted_pixels_go_back_when_distorted(camera: calibench.Camera) -> None:
    ideal = camera.undistort_points(pixels())
    assert np.abs(camera.distort_points(ideal) - pixels()).max() < 1e-9
    assert np.abs(ideal - pixels()).max() > 0.1


def test_parameters_survive_pickle_and_replacement(camera: calibench.Camera) -> None:
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert camera.replace(fx=601.0).parameters == camera.parameters | {"fx": 601.0}
    assert list(camera.parameters)[5:] and camera.distortion.shape == (len(camera.parameters) - 5,)
    assert eval(repr(camera), {"Camera": calibench.Camera}) == camera
    assert camera.matrix.tolist() == [[600.0, 0.5, 320.0], [0.0, 610.0, 240.0], [0.0, 0.0, 1.0]]


def test_a_pose_moves_points_before_they_are_projected() -> None:
    camera = calibench.Camera(600.0, 600.0, 320.0, 240.0)
    rotation, translation = calibench.looking_at_centre((0.0, 0.0, 90.0), 100.0)
    assert camera.project([[10.0, 0.0]], rotation, translation)[0] == pytest.approx([320.0, 300.0])
    with pytest.raises(TypeError, match="give both or none"):
        camera.project([[10.0, 0.0]], rotation)
    with pytest.raises(ValueError, match="no rotation"):
        camera.project([[10.0, 0.0]], 2 * rotation, translation)


def test_a_point_without_an_image_is_nan_and_a_pixel_without_a_ray_is_told() -> None:
    camera = calibench.Camera(600.0, 600.0, 320.0, 240.0, k1=-0.18, k2=0.0)
    assert np.isnan(camera.project([[0.0, 0.0, -1.0]])).all()
    outside = [[320.0, 240.0], [2000.0, 240.0]]
    with pytest.raises(calibench.UndistortError) as error:
        camera.unproject(outside)
    numbers = error.value.numbers
    assert error.value.kind == "OutsideMonotoneRadius" and numbers["index"] == 1
    assert numbers["x"] == (2000.0 - 320.0) / 600.0 and 0.0 < numbers["limit"] < numbers["radius"]
    with pytest.raises(calibench.UndistortError):
        camera.undistort_points(outside)
    for found in (camera.unproject(outside, outside="nan"), camera.undistort_points(outside, outside="nan")):
        assert np.isfinite(found[0]).all() and np.isnan(found[1]).all()


def test_what_no_camera_has_is_refused() -> None:
    with pytest.raises(calibench.SettingsError, match="must be positive"):
        calibench.Camera(-1.0, 600.0, 320.0, 240.0)
    with pytest.raises(calibench.SettingsError, match="unknown lens model `fisheye`"):
        calibench.Camera(600.0, 600.0, 320.0, 240.0, model="fisheye")
    with pytest.raises(TypeError, match="xi = 1.0: the numbers of a brown-conrady camera are"):
        calibench.Camera(600.0, 600.0, 320.0, 240.0, xi=1.0)
    with pytest.raises(ValueError, match="expected 2 columns, got 4"):
        calibench.Camera(600.0, 600.0, 320.0, 240.0).unproject(np.zeros((3, 4)))


def test_a_million_points_are_those_of_one_at_a_time() -> None:
    camera = calibench.Camera(600.0, 600.0, 320.0, 240.0, k1=-0.18, k2=0.05)
    many = np.random.default_rng(1).uniform((0, 0), (640, 480), (200_000, 2))
    ideal = camera.undistort_points(many)
    some = [0, 1, 77_777, 199_999]
    assert all((camera.undistort_points(many[i : i + 1])[0] == ideal[i]).all() for i in some)


FISHEYES = {
    "brown-conrady": {"k1": -0.18},
    "rational": {"k1": -0.2, "k2": 0.01},
    "thin-prism": {"k1": -0.2},
    "tilted": {"k1": -0.2, "tau_x": 0.02},
    "kannala-brandt": {"k1": -0.05},
    "division": {"k1": -0.1},
    "double-sphere": {"xi": -0.2, "alpha": 0.6},
    "halcon-polynomial": {"k1": -0.2},
}


@pytest.mark.parametrize("model", FISHEYES)
def test_no_lens_has_an_image_beyond_its_monotone_angle_or_exactly_behind(model: str) -> None:
    camera = calibench.Camera(300.0, 300.0, 320.0, 240.0, model=model, **FISHEYES[model])
    limit = camera.monotone_angle
    for turn in (0.0, 1.0, 2.5):
        angles = np.concatenate([limit * np.linspace(0.01, 0.999, 9), np.minimum(limit * np.array([1.001, 1.2, 2.0]), np.pi)])
        angles = angles[angles < np.pi - 1e-6]
        rays = np.c_[np.sin(angles) * np.cos(turn), np.sin(angles) * np.sin(turn), np.cos(angles)]
        assert np.isnan(camera.project(rays)).all(axis=1).tolist() == (angles > limit).tolist()
    assert np.isnan(camera.project([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [np.nan, 0.0, 1.0]])).all()
    wide = 320.0 + 300.0 * np.tan(min(limit, 1.5) * 1.01)
    ideal = camera.distort_points([[wide, 240.0], [330.0, 240.0]])
    assert np.isnan(ideal[0]).all() == (limit < 1.5) and np.isfinite(ideal[1]).all()


@pytest.mark.parametrize("model", FISHEYES)
def test_every_ray_of_a_pixel_is_seen_there_up_to_the_last(model: str) -> None:
    camera = calibench.Camera(300.0, 300.0, 320.0, 240.0, model=model, **FISHEYES[model])
    limit = min(camera.monotone_angle, 3.0) * (1.0 - 1e-9)
    edge = camera.project([[np.sin(limit), 0.0, np.cos(limit)]])[0, 0]
    pixels = np.c_[np.linspace(320.0, edge, 1000), np.full(1000, 240.0)]
    rays = camera.unproject(pixels, outside="nan")
    seen = camera.project(rays[np.isfinite(rays).all(axis=1)])
    assert len(seen) > 900 and np.isfinite(seen).all()

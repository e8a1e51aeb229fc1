"""The virtual camera: the streams and scenes of the Rust library."""

import numpy as np
import pytest

import calibench


def test_a_key_gives_the_same_numbers_and_another_key_others() -> None:
    draws = calibench.Stream(seed=1, scenario="four-pose", trial=0, purpose="noise").normal(4)
    assert (draws == calibench.Stream(1, "four-pose").normal(4)).all()
    assert not np.isin(draws, calibench.Stream(1, "four-pose", trial=1).normal(4)).any()
    assert not np.isin(draws, calibench.Stream(1, "four-pose", purpose="pose").normal(4)).any()


def test_noise_is_drawn_view_by_view_point_by_point() -> None:
    scene = calibench.Scene.example()
    noise = calibench.Stream(1, "order").normal(504).reshape(4, 63, 2)
    assert (scene.observe(0.1, calibench.Stream(1, "order")) == scene.pixels + noise * 0.1).all()


def test_draws_lie_where_they_should() -> None:
    stream = calibench.Stream(1, "draws")
    assert ((0.0 < (u := stream.uniform(1000))) & (u < 1.0)).all()
    assert ((-2.0 < (v := stream.uniform(1000, -2.0, 3.0))) & (v < 3.0)).all()
    assert set(stream.below(1000, 3)) == {0, 1, 2}
    # Mean of 10 000 standard normal numbers: 0.01; 5 of these by chance once in two million.
    assert abs(stream.normal(10_000).mean()) < 0.05
    with pytest.raises(ValueError, match="below 0"):
        stream.below(1, 0)


def test_a_scene_sees_what_its_camera_projects() -> None:
    scene = calibench.Scene.example()
    poses = zip(scene.rotations, scene.translations, strict=True)
    seen = np.stack([scene.camera.project(scene.points, r, t) for r, t in poses])
    assert (seen == scene.pixels).all()
    again = calibench.Scene(scene.camera, scene.image_size, scene.points, scene.rotations, scene.translations)
    assert (again.pixels == scene.pixels).all() and again.image_size == (640, 480)


def test_a_scene_that_cannot_be_photographed_is_refused() -> None:
    scene = calibench.Scene.example()
    with pytest.raises(calibench.SceneError) as error:
        calibench.Scene(scene.camera, (640, 480), scene.points, scene.rotations[:1], -scene.translations[:1])
    assert (error.value.kind, error.value.numbers) == ("BehindCamera", {"view": 0, "point": 0})
    with pytest.raises(ValueError, match="not negative"):
        scene.observe(-0.1, calibench.Stream(1, "x"))
    with pytest.raises(ValueError, match="only the lens model brown-conrady"):
        fisheye = calibench.Camera(600.0, 600.0, 320.0, 240.0, model="kannala-brandt")
        calibench.Scene(fisheye, (640, 480), scene.points, scene.rotations, scene.translations)


def test_the_bound_grows_with_the_noise_and_with_what_is_free() -> None:
    scene = calibench.Scene.example()
    one, two = (calibench.cramer_rao(scene, sigma).standard_deviations["fx"] for sigma in (0.1, 0.2))
    assert two == pytest.approx(2 * one, rel=1e-14)
    fewer = calibench.cramer_rao(scene, 0.1, free=["fx", "fy", "k1"])
    assert fewer.free == ("fx", "fy", "k1") and fewer.standard_deviations["fx"] < one
    assert fewer.scaled(4.0).standard_deviations["fx"] == pytest.approx(2 * fewer.standard_deviations["fx"])

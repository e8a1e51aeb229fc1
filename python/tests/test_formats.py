"""Files of this program and of others, there and back."""

from pathlib import Path

import numpy as np
import pytest

import calibench

SCENE = calibench.Scene.example()
CAMERA = calibench.Camera(601.25, 602.5, 319.75, 240.5, k1=-0.18, k2=0.05, p1=1e-3, p2=-5e-4)


@pytest.mark.parametrize("name", [n for n in calibench.format_names() if n != "halcon"])
def test_every_format_gives_the_camera_back(name: str, tmp_path: Path) -> None:
    path = tmp_path / "camera.txt"
    written = calibench.write_camera(path, CAMERA, format=name, image_size=(640, 480))
    read = calibench.read_camera(path, format=written.format)
    assert read.format == name and read.image_size in ((640, 480), None)
    # Moving the origin by half a pixel or one may cost a rounding.
    assert read.camera.parameters == pytest.approx(CAMERA.parameters, rel=1e-15, abs=1e-15)


def test_a_format_that_cannot_hold_the_lens_says_so_or_fits_one(tmp_path: Path) -> None:
    with pytest.raises(calibench.FormatError) as error:
        calibench.write_camera(tmp_path / "camera.dat", CAMERA, format="halcon", image_size=(640, 480))
    assert error.value.kind == "CannotHold" and error.value.numbers["format"] == "HALCON"
    fitted = calibench.write_camera(tmp_path / "camera.dat", CAMERA, format="halcon", image_size=(640, 480), fit=True)
    assert any("px" in converted for converted in fitted.converted)
    assert not (tmp_path / "other.dat").exists()


def test_a_calibration_keeps_its_covariance(tmp_path: Path) -> None:
    pixels = SCENE.observe(0.1, calibench.Stream(4, "formats"))
    result = calibench.calibrate(SCENE.points, pixels, image_size=(640, 480))
    calibench.write_camera(tmp_path / "camera.json", result, format="calibench")
    read = calibench.read_camera(tmp_path / "camera.json")
    assert read.camera == result.camera and read.free == result.free and read.image_size == (640, 480)
    assert read.covariance is not None and (read.covariance == result.covariance.intrinsics).all()
    (tmp_path / "result.json").write_text(result.to_json())
    assert calibench.read_camera(tmp_path / "result.json").camera == result.camera


def test_a_result_of_another_lens_is_read(tmp_path: Path) -> None:
    pixels = SCENE.observe(0.1, calibench.Stream(4, "fisheye"))
    result = calibench.calibrate(SCENE.points, pixels, model="kannala-brandt", free="fx,fy,cx,cy,k1,k2", image_size=(640, 480))
    (tmp_path / "result.json").write_text(result.to_json())
    assert calibench.read_camera(tmp_path / "result.json").camera == result.camera
    written = calibench.write_camera(tmp_path / "camera.yaml", result, format="opencv-yaml")
    assert calibench.read_camera(tmp_path / "camera.yaml").camera == result.camera and "covariance" in written.lost[0]
    with pytest.raises(calibench.FormatError, match="it holds brown-conrady, rational, thin-prism"):
        calibench.write_camera(tmp_path / "camera.cameramodel", result)


def test_what_is_wrong_in_a_file_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "cameras.txt"
    path.write_text("# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 SIMPLE_RADIAL 640 480 600 320 wrong -0.18\n")
    with pytest.raises(calibench.FormatError) as error:
        calibench.read_camera(path, format="colmap")
    assert error.value.numbers["line"] == 2 and error.value.numbers["file"] == str(path)
    with pytest.raises(calibench.FormatError, match="missing.txt"):
        calibench.read_camera(tmp_path / "missing.txt")
    with pytest.raises(ValueError, match="no format \"jpeg\""):
        calibench.read_camera(path, format="jpeg")


def test_corners_survive_their_file(tmp_path: Path) -> None:
    pixels = SCENE.observe(0.1, calibench.Stream(4, "corners"))
    calibench.write_corners(tmp_path / "points.csv", SCENE.points, pixels, view_names=list("abcd"))
    corners = calibench.read_corners(tmp_path / "points.csv")
    assert list(corners) == ["a", "b", "c", "d"]
    assert (np.stack([view.pixels for view in corners.values()]) == pixels).all()
    assert all((view.points == SCENE.points).all() and view.weights is None for view in corners.values())
    (tmp_path / "weighted.csv").write_text("view,point,X,Y,u,v,sigma_px\na,0,0,0,1,2,0.5\n")
    weights = calibench.read_corners(tmp_path / "weighted.csv")["a"].weights
    assert weights is not None and weights.tolist() == [2.0]
    (tmp_path / "broken.csv").write_text("view,point,X,Y,u,v\na,0,0,0,?,2\n")
    with pytest.raises(calibench.FormatError, match="broken.csv:2: column 'u'"):
        calibench.read_corners(tmp_path / "broken.csv")


def test_advice_is_in_the_words_of_python(tmp_path: Path) -> None:
    camera = calibench.Camera(600.0, 600.0, 320.0, 240.0, k1=-0.1, k3=0.01)
    cases = (
        (lambda: calibench.write_camera(tmp_path / "a.yaml", camera), "format="),
        (lambda: calibench.write_camera(tmp_path / "a.yaml", camera, format="ros"), r"image_size=\(width, height\)"),
        (lambda: calibench.write_camera(tmp_path / "a.yaml", camera, format="kalibr", image_size=(640, 480)), 'hold={"k3": 0.0}'),
        (lambda: calibench.write_camera(tmp_path / "a.cal", camera, format="halcon", image_size=(640, 480)), "fit=True"),
    )
    for write, text in cases:
        with pytest.raises(calibench.FormatError, match=text) as error:
            write()
        assert "--" not in str(error.value)

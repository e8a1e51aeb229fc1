"""lensboy's calibrate_camera behind `calibench gate`.

    pip install lensboy
    calibench gate --solver "python3 adapters/lensboy_solver.py"

Its OpenCV model, with the coefficients that are asked for. The board's warp is not estimated and no mark is left out: the gate's boards are
flat, and its noise Gaussian but where a scene says otherwise. It states no covariance.
"""

import contextlib
import json
import sys

import lensboy
import numpy as np

LENS = ["k1", "k2", "p1", "p2", "k3"]


class Unsupported(ValueError):
    """lensboy is not made for this problem."""


def model(problem):
    """What is estimated: focal lengths and principal point always, of the lens what is free."""
    held = problem["held"]
    if any(name in held for name in ("fx", "fy", "cx", "cy")):
        raise Unsupported("lensboy always estimates fx, fy, cx and cy")
    if "skew" in problem["free"] or any(held.get(name, 0.0) != 0.0 for name in ["skew", *LENS]):
        raise Unsupported("lensboy holds coefficients at 0 only, and its camera has no skew")
    mask = np.zeros(14, dtype=bool)
    mask[:5] = [name in problem["free"] for name in LENS]
    width, height = problem["image_size"]
    return lensboy.OpenCVConfig(image_height=height, image_width=width, included_distortion_coefficients=mask)


def marks(problem):
    """All target points in one list, and for each view which of them were seen where."""
    points, frames = [], []
    for view in problem["views"]:
        pixels = np.array(view["pixels"], dtype=float).reshape(-1, 2)
        frames.append(lensboy.Frame(np.arange(len(points), len(points) + len(view["target"])), pixels))
        points += [[x, y, 0.0] for x, y in view["target"]]
    return np.array(points, dtype=float).reshape(-1, 3), frames


def solve(problem):
    points, frames = marks(problem)
    result = lensboy.calibrate_camera(points, frames, model(problem), estimate_target_warp=False, outlier_threshold_stddevs=None)
    camera = result.camera_model
    values = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
    values |= dict(zip(LENS, camera.distortion_coeffs))
    if any(pose is None for pose in result.cameras_from_target):
        return {"status": "refused", "message": "a view was left out"}
    return {
        "status": "ok",
        "parameters": {name: float(values[name]) for name in problem["free"]},
        "poses": [
            {"rotation": pose.matrix[:3, :3].tolist(), "translation": pose.matrix[:3, 3].tolist()}
            for pose in result.cameras_from_target
        ],
    }


def answer(problem):
    try:
        return {"id": problem["id"]} | solve(problem)
    except Unsupported as error:
        return {"id": problem["id"], "status": "unsupported", "message": str(error)}
    except Exception as error:  # Whatever it raises is its refusal.
        return {"id": problem["id"], "status": "refused", "message": f"{type(error).__name__}: {error}".split("\n")[0]}


def main():
    for line in sys.stdin:
        # It tells its progress on standard output, where answers go.
        with contextlib.redirect_stdout(sys.stderr):
            said = answer(json.loads(line))
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main()

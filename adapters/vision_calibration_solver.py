"""calibration-rs (vision-calibration) behind `calibench gate`.

    pip install vision-calibration
    calibench gate --solver "python3 adapters/vision_calibration_solver.py"

Its workflow for planar intrinsics, with 200 iterations. Coefficients that are held are 0 and fixed. It states no covariance.
"""

import json
import sys

import vision_calibration as vc

LENS = ["k1", "k2", "k3", "p1", "p2"]


class Unsupported(ValueError):
    """The workflow is not made for this problem."""


def settings(problem):
    free, held = set(problem["free"]), problem["held"]
    if any(name in held for name in ("fx", "fy", "cx", "cy")):
        raise Unsupported("a value that fx, fy, cx or cy is held at cannot be given")
    if "skew" in free or any(held.get(name, 0.0) != 0.0 for name in ["skew", *LENS]):
        raise Unsupported("a value that a coefficient is held at cannot be given, and skew is not estimated")
    if not {"k1", "k2"} <= free:
        raise Unsupported("the linear start estimates k1 and k2")
    fixed = {name: name not in free for name in LENS}
    return vc.PlanarCalibrationConfig(
        init=vc.IntrinsicsInitConfig(fix_k3=fixed["k3"], fix_tangential=fixed["p1"] and fixed["p2"]),
        solver=vc.SolverConfig(max_iters=200),
        fix_camera=vc.CameraFixMask(distortion=fixed),
    )


def rotation_matrix(x, y, z, w):
    """Of a unit quaternion."""
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def solve(problem):
    config = settings(problem)
    views = [
        vc.PlanarView(
            observation=vc.Observation(
                points_3d=[(x, y, 0.0) for x, y in view["target"]], points_2d=[tuple(pixel) for pixel in view["pixels"]]
            )
        )
        for view in problem["views"]
    ]
    result = vc.run_planar_intrinsics(vc.PlanarDataset(views=views), config)
    camera = result.camera
    values = {name: getattr(camera.intrinsics, name) for name in ("fx", "fy", "cx", "cy")}
    values |= {name: getattr(camera.distortion, name) for name in LENS}
    return {
        "status": "ok",
        "parameters": {name: float(values[name]) for name in problem["free"]},
        "poses": [
            {"rotation": rotation_matrix(*pose.rotation_xyzw), "translation": list(pose.translation_xyz)}
            for pose in result.camera_se3_target
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
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()

"""OpenCV's calibrateCamera behind `calibench gate`.

    pip install opencv-python-headless
    calibench gate --solver "python3 adapters/opencv_solver.py"

OpenCV is used as its documentation says: parameters that are held are fixed by flags, with an intrinsic guess where their
value is not the default; the search may take 200 iterations and runs to machine precision. The Python binding takes points in
single precision only. Nothing is checked here that OpenCV does not check itself: its behaviour on bad input is its own.
"""

import json
import sys

import cv2
import numpy as np

ORDER = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]
CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, np.finfo(float).eps)


class Unsupported(ValueError):
    """OpenCV is not made for this problem."""


def flags_and_guess(problem, views):
    """The flags that hold what must be held, and a starting matrix where values are not OpenCV's defaults."""
    free, held = set(problem["free"]), problem["held"]
    if "skew" in free or held.get("skew", 0.0) != 0.0:
        raise Unsupported("OpenCV's camera has no skew")
    flags = 0
    for name, flag in [("k1", cv2.CALIB_FIX_K1), ("k2", cv2.CALIB_FIX_K2), ("k3", cv2.CALIB_FIX_K3)]:
        if name not in free:
            flags |= flag
    if "p1" not in free and "p2" not in free:
        flags |= cv2.CALIB_FIX_TANGENT_DIST
        if held.get("p1", 0.0) == held.get("p2", 0.0) == 0.0:
            flags = flags & ~cv2.CALIB_FIX_TANGENT_DIST | cv2.CALIB_ZERO_TANGENT_DIST
    elif "p1" not in free or "p2" not in free:
        raise Unsupported("OpenCV holds p1 and p2 only together")
    if ("fx" in free) != ("fy" in free):
        raise Unsupported("OpenCV holds fx and fy only together")
    if ("cx" in free) != ("cy" in free):
        raise Unsupported("OpenCV holds cx and cy only together")
    if "fx" not in free:
        flags |= cv2.CALIB_FIX_FOCAL_LENGTH
    if "cx" not in free:
        flags |= cv2.CALIB_FIX_PRINCIPAL_POINT
    distortion = np.array([held.get(name, 0.0) for name in ["k1", "k2", "p1", "p2", "k3"]])
    needs_guess = "fx" not in free or "cx" not in free or distortion.any()
    if not needs_guess:
        return flags, None, np.zeros(5)
    target, pixels = views
    matrix = cv2.initCameraMatrix2D(target, pixels, tuple(problem["image_size"]))
    for name, place in [("fx", (0, 0)), ("fy", (1, 1)), ("cx", (0, 2)), ("cy", (1, 2))]:
        matrix[place] = held.get(name, matrix[place])
    return flags | cv2.CALIB_USE_INTRINSIC_GUESS, matrix, distortion


def solve(problem):
    target = [
        np.array([[x, y, 0.0] for x, y in view["target"]], dtype=np.float32).reshape(-1, 3)
        for view in problem["views"]
    ]
    pixels = [np.array(view["pixels"], dtype=np.float32).reshape(-1, 1, 2) for view in problem["views"]]
    flags, matrix, distortion = flags_and_guess(problem, (target, pixels))
    rmse, matrix, distortion, rotations, translations, deviations, _, _ = cv2.calibrateCameraExtended(
        target, pixels, tuple(problem["image_size"]), matrix, distortion, flags=flags, criteria=CRITERIA
    )
    d = distortion.ravel()
    values = dict(zip(ORDER, [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *d[:5]]))
    stated = dict(zip(ORDER, deviations.ravel()))
    return {
        "status": "ok",
        "parameters": {name: float(value) for name, value in values.items()},
        "poses": [
            {"rotation": cv2.Rodrigues(r)[0].tolist(), "translation": np.ravel(t).tolist()}
            for r, t in zip(rotations, translations)
        ],
        "standard_deviations": {name: float(stated[name]) for name in problem["free"]},
        "rmse": float(rmse),
    }


def answer(problem):
    try:
        return {"id": problem["id"]} | solve(problem)
    except (cv2.error, ValueError) as error:
        status = "unsupported" if isinstance(error, Unsupported) else "refused"
        return {"id": problem["id"], "status": status, "message": str(error).strip().split("\n")[0]}


def main():
    cv2.setNumThreads(1)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()

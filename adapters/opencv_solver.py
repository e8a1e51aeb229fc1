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

ORDER = "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y".split()
MODELS = {  # Flags, and how many coefficients there are.
    "brown-conrady": (0, 5),
    "rational": (cv2.CALIB_RATIONAL_MODEL, 8),
    "thin-prism": (cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL, 12),
    "tilted": (cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL | cv2.CALIB_TILTED_MODEL, 14),
}
CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, np.finfo(float).eps)


class Unsupported(ValueError):
    """OpenCV is not made for this problem."""


def flags_and_guess(problem, views):
    """The flags that hold what must be held, and a starting matrix where values are not OpenCV's defaults."""
    free, held = set(problem["free"]), problem["held"]
    if "skew" in free or held.get("skew", 0.0) != 0.0:
        raise Unsupported("OpenCV's camera has no skew")
    flags, coefficients = MODELS[problem.get("model", "brown-conrady")]
    for name in ["k1", "k2", "k3", "k4", "k5", "k6"]:
        if name not in free and (name in held or name in ORDER[:9]):
            flags |= getattr(cv2, f"CALIB_FIX_{name.upper()}")
    for names, flag in [(ORDER[12:16], cv2.CALIB_FIX_S1_S2_S3_S4), (ORDER[16:], cv2.CALIB_FIX_TAUX_TAUY)]:
        if set(names) <= set(held):
            flags |= flag
        elif set(names) & set(held):
            raise Unsupported(f"OpenCV holds {', '.join(names)} only together")
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
    distortion = np.array([held.get(name, 0.0) for name in ORDER[4:]][:coefficients])
    needs_guess = "fx" not in free or "cx" not in free or distortion.any()
    if not needs_guess:
        return flags, None, np.zeros(coefficients)
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
    values = dict(zip(ORDER, [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *d]))
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


def answer(problem, solve=solve):
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

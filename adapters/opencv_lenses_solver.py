"""OpenCV's other lens models behind `calibench gate`: rational, thin prism, tilted sensor, and its fisheye module.

    pip install opencv-python-headless
    calibench gate --solver "python3 adapters/opencv_lenses_solver.py"

The first line says which models these are (version 2 of the protocol), so that only their scenes are asked. The fisheye module
takes points in double precision, estimates no skew here, and states no standard deviations. From its own start it often ends
far from the minimum: it is started from a row of focal lengths besides, and the lowest RMSE is taken.
"""

import json
import sys

import cv2
import numpy as np

import opencv_solver
from opencv_solver import CRITERIA, Unsupported

FISHEYE = ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"]
# OpenCV 5 has the flags of its fisheye module among the others.
FLAGS_OF = cv2 if hasattr(cv2, "CALIB_FIX_SKEW") else cv2.fisheye
FLAGS = FLAGS_OF.CALIB_RECOMPUTE_EXTRINSIC | FLAGS_OF.CALIB_FIX_SKEW
# Focal lengths to start from, over the image's width; first OpenCV's own.
STARTS = [None, 0.2, 0.25, 0.3, 0.36, 0.43, 0.52, 0.62]
GREETING = {"protocol": 2, "models": ["rational", "thin-prism", "tilted", "kannala-brandt"]}


def solve(problem):
    return fisheye(problem) if problem["model"] == "kannala-brandt" else opencv_solver.solve(problem)


def fisheye(problem):
    if set(problem["free"]) != set(FISHEYE) or problem["held"].get("skew", 0.0) != 0.0:
        raise Unsupported("this adapter frees all parameters of the fisheye together, without skew")
    target = [np.array([[[x, y, 0.0] for x, y in view["target"]]]) for view in problem["views"]]
    pixels = [np.array([view["pixels"]]) for view in problem["views"]]
    found = [refined for start in STARTS if (refined := refine(target, pixels, problem["image_size"], start))]
    if not found:
        raise ValueError("no start can be refined")
    rmse, matrix, distortion, rotations, translations = min(found, key=lambda refined: refined[0])
    values = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()]
    return {
        "status": "ok",
        "parameters": dict(zip(FISHEYE, map(float, values))),
        "poses": [
            {"rotation": cv2.Rodrigues(r)[0].tolist(), "translation": np.ravel(t).tolist()}
            for r, t in zip(rotations, translations)
        ],
        "rmse": float(rmse),
    }


def refine(target, pixels, image_size, start):
    """The result from a start, None where OpenCV raises."""
    (width, height), flags, matrix, distortion = image_size, FLAGS, None, None
    if start is not None:
        focal = start * width
        matrix = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
        flags, distortion = flags | FLAGS_OF.CALIB_USE_INTRINSIC_GUESS, np.zeros(4)
    try:
        return cv2.fisheye.calibrate(target, pixels, (width, height), matrix, distortion, flags=flags, criteria=CRITERIA)
    except cv2.error:
        return None


def main():
    cv2.setNumThreads(1)
    print(json.dumps(GREETING), flush=True)
    for line in sys.stdin:
        print(json.dumps(opencv_solver.answer(json.loads(line), solve)), flush=True)


if __name__ == "__main__":
    main()

"""OpenCV's finders behind `calibench gate --detector`.

    pip install opencv-python-headless
    calibench gate --detector --solver "python3 adapters/detector_opencv.py classic"

`classic`: findChessboardCorners with cornerSubPix (window 5, as in OpenCV's tutorial) and findCirclesGrid. `sb`: findChessboardCornersSB;
discs as before.
"""

import json
import sys

import cv2
import numpy as np

REFINED = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.001)


def marks(image, board, method):
    size = (board["columns"], board["rows"])
    if board["kind"] == "circles":
        return cv2.findCirclesGrid(image, size, flags=cv2.CALIB_CB_SYMMETRIC_GRID)
    if method == "sb":
        return cv2.findChessboardCornersSB(image, size)
    found, corners = cv2.findChessboardCorners(image, size)
    return found, cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), REFINED) if found else None


def answer(question, method):
    image = cv2.imread(question["image"], cv2.IMREAD_GRAYSCALE)
    try:
        found, places = marks(image, question["board"], method)
    except cv2.error as error:
        return {"status": "not-found", "message": str(error).strip().splitlines()[-1]}
    if not found:
        return {"status": "not-found"}
    return {"status": "ok", "marks": np.reshape(places, (-1, 2)).tolist()}


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in ("classic", "sb"):
        sys.exit("usage: detector_opencv.py classic|sb")
    for line in sys.stdin:
        question = json.loads(line)
        print(json.dumps({"id": question["id"], **answer(question, sys.argv[1])}), flush=True)

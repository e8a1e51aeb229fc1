"""OpenCV's finders behind `calibench gate detector`.

    pip install opencv-python-headless
    calibench gate detector --solver "python3 adapters/detector_opencv.py classic"

`classic`: findChessboardCorners with cornerSubPix (window 5, as in OpenCV's tutorial), findCirclesGrid, CharucoDetector, and ArucoDetector
with cornerSubPix for grids of AprilTags. `sb`: findChessboardCornersSB; the others as before.
"""

import json
import sys

import cv2
import numpy as np

REFINED = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.001)


def plain(image, board, method):
    """All marks of a board without markers, or none."""
    size = (board["columns"], board["rows"])
    if board["kind"] == "circles":
        return cv2.findCirclesGrid(image, size, flags=cv2.CALIB_CB_SYMMETRIC_GRID)
    if board["kind"] == "asymmetric":
        return cv2.findCirclesGrid(image, size, flags=cv2.CALIB_CB_ASYMMETRIC_GRID)
    if method == "sb":
        return cv2.findChessboardCornersSB(image, size)
    found, corners = cv2.findChessboardCorners(image, size)
    return found, cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), REFINED) if found else None


def dictionary(board):
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board["dictionary"]))


def charuco(image, board):
    """The inner corners that are seen, by number."""
    squares = (board["columns"] + 1, board["rows"] + 1)
    layout = cv2.aruco.CharucoBoard(squares, 1.0, board["marker"], dictionary(board))
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(layout).detectBoard(image)
    return {} if numbers is None else dict(zip(numbers.ravel().tolist(), np.reshape(corners, (-1, 2)).tolist()))


def april_grid(image, board):
    """The corners of the tags that are seen, by number: Kalibr's tags have a border of two cells, and stand upside down beside OpenCV's. The squares
    between them move the outline that OpenCV finds by 2 to 3 px, farther than its own refinement reaches; cornerSubPix, as Kalibr uses it, does."""
    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits = 2
    tags, numbers, _ = cv2.aruco.ArucoDetector(dictionary(board), settings).detectMarkers(image)
    columns, places = board["columns"], {}
    for tag, corners in zip([] if numbers is None else numbers.ravel().tolist(), tags):
        row, column = divmod(tag, columns // 2)
        if 2 * row >= board["rows"]:
            continue
        first = 2 * row * columns + 2 * column
        order = (first + 1, first, first + columns, first + columns + 1)
        refined = cv2.cornerSubPix(image, np.reshape(corners, (4, 1, 2)).copy(), (5, 5), (-1, -1), REFINED)
        places.update(zip(order, np.reshape(refined, (4, 2)).tolist()))
    return places


CODED = {"charuco": charuco, "aprilgrid": april_grid}


def answer(question, method):
    image, board = cv2.imread(question["image"], cv2.IMREAD_GRAYSCALE), question["board"]
    kind = board["kind"]
    if kind not in ("chessboard", "circles", "asymmetric", *CODED):
        return {"status": "unsupported"}
    try:
        if kind in CODED:
            seen = CODED[kind](image, board)
            marks = [seen.get(number) for number in range(board["columns"] * board["rows"])] if seen else None
        else:
            found, places = plain(image, board, method)
            marks = np.reshape(places, (-1, 2)).tolist() if found else None
    except cv2.error as error:
        return {"status": "not-found", "message": str(error).strip().splitlines()[-1]}
    return {"status": "not-found"} if marks is None else {"status": "ok", "marks": marks}


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in ("classic", "sb"):
        sys.exit("usage: detector_opencv.py classic|sb")
    for line in sys.stdin:
        question = json.loads(line)
        print(json.dumps({"id": question["id"], **answer(question, sys.argv[1])}), flush=True)

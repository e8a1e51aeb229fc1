"""OpenCV's side of the comparison: the same problems through its Python interface, on one thread."""

import sys
from pathlib import Path

import cv2
import numpy as np

from serve import numbers, serve

FOLDER = Path(sys.argv[1])
CAMERA = np.array([[600.0, 0, 326], [0, 600, 243], [0, 0, 1]])
LENS = np.array([-0.18, 0.05, 0, 0, 0])
# Six intrinsics free: fx, fy, cx, cy, k1, k2.
FREE = cv2.CALIB_FIX_K3 | (getattr(cv2, "CALIB_ZERO_TANGENT_DIST", 0))


def calibration(count, extended):
    pairs = numbers(FOLDER, f"views-{count}").reshape(int(count), -1, 4)
    # Its input is single precision.
    board = [np.c_[view[:, :2], np.zeros(len(view))].astype(np.float32) for view in pairs]
    pixels = [np.ascontiguousarray(view[:, None, 2:], dtype=np.float32) for view in pairs]
    function = cv2.calibrateCameraExtended if extended else cv2.calibrateCamera

    def run():
        return function(board, pixels, (640, 480), None, None, flags=FREE)

    def answer(result):
        k, d = result[1], result[2].ravel()
        return [k[0, 0], k[1, 1], k[0, 2], k[1, 2], d[0], d[1]]

    return run, answer


def fisheye(count):
    """Its fisheye module, which takes double precision and ends after 100 steps or at machine precision, as it comes.

    From its own start it raises an exception or not as a library's threads round (InitExtrinsics of 20 views): it is given a focal
    length, which is the true one.
    """
    pairs = numbers(FOLDER, f"wide-views-{count}").reshape(int(count), -1, 4)
    board = [np.c_[view[:, :2], np.zeros(len(view))][None] for view in pairs]
    pixels = [np.ascontiguousarray(view[None, :, 2:]) for view in pairs]
    # OpenCV 5 has the flags of its fisheye module among the others.
    has = cv2 if hasattr(cv2, "CALIB_FIX_SKEW") else cv2.fisheye
    flags = has.CALIB_RECOMPUTE_EXTRINSIC | has.CALIB_FIX_SKEW | has.CALIB_USE_INTRINSIC_GUESS
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, np.finfo(float).eps)

    def run():
        start = np.array([[230.0, 0, 319.5], [0, 230, 239.5], [0, 0, 1]])
        return cv2.fisheye.calibrate(board, pixels, (640, 480), start, np.zeros(4), flags=flags, criteria=criteria)

    def answer(result):
        k, d = result[1], result[2].ravel()
        return [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d]

    return run, answer


def rational(count):
    """As it comes: at most 30 steps, or to machine precision."""
    pairs = numbers(FOLDER, f"rational-views-{count}").reshape(int(count), -1, 4)
    board = [np.c_[view[:, :2], np.zeros(len(view))].astype(np.float32) for view in pairs]
    pixels = [np.ascontiguousarray(view[:, None, 2:], dtype=np.float32) for view in pairs]

    def run():
        return cv2.calibrateCamera(board, pixels, (640, 480), None, None, flags=cv2.CALIB_RATIONAL_MODEL)

    def answer(result):
        k, d = result[1], result[2].ravel()
        return [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d[:8]]

    return run, answer


def homography():
    pairs = numbers(FOLDER, "homography").reshape(-1, 4)
    source, target = pairs[:, :2].copy(), pairs[:, 2:].copy()
    return lambda: cv2.findHomography(source, target, 0)[0], np.ravel


def affine():
    pairs = numbers(FOLDER, "affine").reshape(-1, 4)
    source, target = pairs[:, :2].copy(), pairs[:, 2:].copy()
    return lambda: cv2.estimateAffine2D(source, target)[0], np.ravel


def points(iterated):
    pixels = numbers(FOLDER, "points").reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    if not iterated:
        return lambda: cv2.undistortPoints(pixels, CAMERA, LENS, None, None, CAMERA), np.ravel
    if hasattr(cv2, "undistortPointsIter"):
        return lambda: cv2.undistortPointsIter(pixels, CAMERA, LENS, None, CAMERA, criteria), np.ravel
    return lambda: cv2.undistortPoints(pixels, CAMERA, LENS, None, None, CAMERA, criteria), np.ravel


def frame(size):
    width, height = map(int, size.split("x"))
    image = np.fromfile(FOLDER / f"frame-{size}", dtype=np.uint8).reshape(height, width)
    return image, np.diag([width / 640, width / 640, 1]) @ CAMERA


def remap(size):
    image, camera = frame(size)
    x, y = cv2.initUndistortRectifyMap(camera, LENS, None, camera, image.shape[::-1], cv2.CV_32FC1)
    return lambda: cv2.remap(image, x, y, cv2.INTER_LINEAR), np.ravel


def undistort(size):
    image, camera = frame(size)
    return lambda: cv2.undistort(image, camera, LENS), np.ravel


def grid():
    image, _ = frame_of("grid", 640, 480)

    def run():
        found, centres = cv2.findCirclesGrid(image, (9, 7), flags=cv2.CALIB_CB_SYMMETRIC_GRID)
        if not found:
            raise RuntimeError("findCirclesGrid found nothing")
        return centres

    return run, np.ravel


def frame_of(name, width, height):
    return np.fromfile(FOLDER / name, dtype=np.uint8).reshape(height, width), (width, height)


def dots_by_components():
    """Otsu's threshold, connected components, centroids of the nine."""
    image, _ = frame_of("dots", 1571, 1053)

    def run():
        _, mask = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
        _, _, stats, centroids = cv2.connectedComponentsWithStats(mask)
        return centroids[1:][stats[1:, cv2.CC_STAT_AREA] > 100]

    return run, np.ravel


def dots_by_blobs():
    """As it comes."""
    image, _ = frame_of("dots", 1571, 1053)
    detector = cv2.SimpleBlobDetector_create()

    def run():
        return np.array([k.pt for k in detector.detect(image)])

    return run, np.ravel


def make(row):
    kind, _, size = row.partition("-")
    return {
        "calibrate": lambda: calibration(size, False),
        "deviations": lambda: calibration(size, True),
        "wide": lambda: fisheye(size),
        "rational": lambda: rational(size),
        "homography": homography,
        "affine": affine,
        "points": lambda: points(size == "iterated"),
        "remap": lambda: remap(size),
        "undistort": lambda: undistort(size),
        "grid": grid,
        "dots": dots_by_blobs if size == "blobs" else dots_by_components,
    }[kind]()


cv2.setNumThreads(1)
if __name__ == "__main__":
    if len(sys.argv) > 2 and sys.argv[2] == "version":
        print(cv2.__version__)
    else:
        serve(make)

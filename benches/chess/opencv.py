"""What do OpenCV's finders make of the same images? `opencv.py FOLDER`, after `chess --write FOLDER`.

Two of them: `findChessboardCorners` with `cornerSubPix` (window 5, the usual choice), and `findChessboardCornersSB`. A board counts as
found where every corner lies within 6 px of its place, in either order; as wrong otherwise.
"""

import glob
import os
import sys
import time

import cv2
import numpy as np

SIZE = (9, 6)
WRONG_PX = 6.0
CRITERIA = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)


def classic(image):
    found, corners = cv2.findChessboardCorners(image, SIZE)
    if not found:
        return None
    return cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), CRITERIA)


def sector_based(image):
    found, corners = cv2.findChessboardCornersSB(image, SIZE)
    return corners if found else None


def errors(corners, truth):
    corners = corners.reshape(-1, 2).astype(float)
    ways = [np.linalg.norm(way - truth, axis=1) for way in (corners, corners[::-1])]
    return min(ways, key=np.sum)


def main(folder):
    cv2.setNumThreads(1)
    cases = {}
    for path in sorted(glob.glob(os.path.join(folder, "*.pgm"))):
        cases.setdefault(os.path.basename(path).rsplit("-", 1)[0], []).append(path)
    print(f"{'case':<36}" + 2 * f"{'found':>8}{'wrong':>6}{'rms px':>9}{'ms':>8}")
    for case, paths in cases.items():
        row = f"{case:<36}"
        for finder in (classic, sector_based):
            found, wrong, squares, seconds = 0, 0, [], 0.0
            for path in paths:
                image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
                truth = np.loadtxt(path[:-3] + "csv", delimiter=",", skiprows=1)
                start = time.thread_time()
                corners = finder(image)
                seconds += time.thread_time() - start
                if corners is None:
                    continue
                error = errors(corners, truth)
                if error.max() > WRONG_PX:
                    wrong += 1
                    continue
                found += 1
                squares.extend(error**2)
            rms = np.sqrt(np.mean(squares)) if squares else float("nan")
            row += f"{found:>5}/{len(paths):<2}{wrong:>6}{rms:>9.4f}{1e3 * seconds / len(paths):>8.1f}"
        print(row, flush=True)


main(sys.argv[1])

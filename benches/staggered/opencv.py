"""What does OpenCV make of the same photographs? `opencv.py FOLDER`, after `staggered --write FOLDER`.

`findCirclesGrid` for symmetric or asymmetric grids, without and with clustering. A board counts as found where each centre lies within 0.4 of
the least distance of two marks from its place, in the board's order (`own`) or, for symmetric grids and an even number of rows, half a turn on
(`turned`); as `mirrored` where it does so in an order that only a mirror shows; as wrong otherwise.
"""

import glob
import os
import sys

import cv2
import numpy as np


def orders(kind, columns, rows):
    """The board's own order and others, as the places of a board's marks in each."""
    index = np.arange(columns * rows).reshape(rows, columns)
    named = {"own": index, "turned": index[::-1, ::-1], "mirrored": index[:, ::-1], "flipped": index[::-1]}
    if kind == "circles" and columns == rows:
        named |= {"quarter": np.rot90(index), "quarter back": np.rot90(index, 3)}
    return {name: order.ravel() for name, order in named.items()}


def found_as(centres, truth, kind, columns, rows):
    pairs = np.linalg.norm(truth[:, None] - truth[None], axis=2)
    limit = 0.4 * pairs[pairs > 0].min()
    for name, order in orders(kind, columns, rows).items():
        error = np.linalg.norm(centres - truth[order], axis=1)
        if error.max() < limit:
            return name, error
    return "wrong", None


def main(folder):
    cv2.setNumThreads(1)
    cases = {}
    for path in sorted(glob.glob(os.path.join(folder, "*.pgm"))):
        cases.setdefault(os.path.basename(path).rsplit("-", 1)[0], []).append(path)
    print(f"OpenCV {cv2.__version__}")
    print(f"{'board':<26}{'finder':<12}{'photos':>7}{'own':>6}{'turned':>8}{'mirrored':>9}{'wrong':>7}{'rms px':>9}{'worst px':>10}")
    for case, paths in cases.items():
        kind, size, _ = case.split("_")
        columns, rows = map(int, size.split("x"))
        grid = cv2.CALIB_CB_SYMMETRIC_GRID if kind == "circles" else cv2.CALIB_CB_ASYMMETRIC_GRID
        for name, extra in (("plain", 0), ("clustering", cv2.CALIB_CB_CLUSTERING)):
            counts, errors = dict.fromkeys(("own", "turned", "mirrored", "flipped", "wrong"), 0), []
            for path in paths:
                image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
                truth = np.loadtxt(path[:-3] + "csv", delimiter=",", skiprows=1)
                ok, centres = cv2.findCirclesGrid(image, (columns, rows), flags=grid + extra)
                if not ok:
                    continue
                way, error = found_as(centres.reshape(-1, 2).astype(float), truth, kind, columns, rows)
                counts[way] += 1
                if error is not None:
                    errors.extend(error)
            rms = np.sqrt(np.mean(np.square(errors))) if errors else float("nan")
            worst = max(errors, default=float("nan"))
            print(
                f"{case:<26}{name:<12}{len(paths):>7}{counts['own']:>6}{counts['turned']:>8}{counts['mirrored'] + counts['flipped']:>9}"
                f"{counts['wrong']:>7}{rms:>9.4f}{worst:>10.3f}",
                flush=True,
            )


main(sys.argv[1])

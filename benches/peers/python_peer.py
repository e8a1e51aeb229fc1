"""This library called from Python, for what the call costs: arrays in, result with full covariance out."""

import sys
from pathlib import Path

import calibench
import numpy as np

from serve import numbers, serve

FOLDER = Path(sys.argv[1])


def make(row):
    count = int(row.split("-")[1])
    pairs = numbers(FOLDER, f"views-{count}").reshape(count, 63, 4)
    points, pixels = np.ascontiguousarray(pairs[..., :2]), np.ascontiguousarray(pairs[..., 2:])

    def answer(result):
        parameters = result.camera.parameters
        return [parameters[name] for name in ("fx", "fy", "cx", "cy", "k1", "k2")]

    return lambda: calibench.calibrate(points, pixels), answer


if __name__ == "__main__":
    if sys.argv[2:] == ["version"]:
        print(calibench.__version__)
    else:
        serve(make)

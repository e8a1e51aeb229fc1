"""calibench's Python package behind `calibench gate`, by the pipe that all others go through.

    pip install calibench
    calibench gate --solver "python3 adapters/calibench_solver.py"
"""

import json
import sys

import calibench
import numpy as np
from calibench.gate import Problem, answered


def problem_of(line):
    """The problem of a line of the protocol; `null` is a coordinate that was not measured."""
    said = json.loads(line)
    arrays = {key: [np.array(view[name], dtype=float).reshape(-1, 2) for view in said["views"]]
              for key, name in (("points", "target"), ("pixels", "pixels"))}
    model = said.get("model", "brown-conrady")
    return Problem(id=said["id"], image_size=tuple(said["image_size"]), model=model, free=tuple(said["free"]), hold=said["held"], **arrays)


def solve(problem):
    return calibench.calibrate(
        problem.points,
        problem.pixels,
        model=problem.model,
        free=problem.free,
        hold=problem.hold,
        image_size=problem.image_size,
    )


MODELS = [
    "brown-conrady", "rational", "thin-prism", "tilted", "kannala-brandt", "division", "double-sphere", "halcon-polynomial"
]


def main():
    print(json.dumps({"protocol": 2, "models": MODELS}), flush=True)
    for line in sys.stdin:
        print(json.dumps(answered(solve, problem_of(line))), flush=True)


if __name__ == "__main__":
    main()

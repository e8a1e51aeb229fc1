"""A bundle adjustment with scipy.optimize.least_squares behind `calibench gate`.

    pip install scipy
    calibench gate --solver "python3 adapters/scipy_solver.py"

The model and the starting values are those of `minimal_solver.py`; the search, its stopping rules and the Jacobian by finite
differences are SciPy's, as a user would call them. The covariance is `s^2 (J^T J)^-1` at the solution.
"""

# First, because it sets the number of threads.
from minimal_solver import NAMES, main, pose_covariances, project, rotation_matrix, start, views_of

import numpy as np
from scipy.optimize import least_squares


def solve(problem):
    free = [NAMES.index(name) for name in problem["free"]]
    views = views_of(problem)
    camera, poses = start(problem, views, problem["held"])
    count = len(free)

    def residuals(x):
        values = camera.copy()
        values[free] = x[:count]
        blocks = x[count:].reshape(-1, 6)
        return np.concatenate([(project(values, b, t) - p).ravel() for b, (t, p) in zip(blocks, views)])

    x = np.r_[camera[free], np.concatenate(poses)]
    fit = least_squares(
        residuals, x, jac="3-point", method="trf", x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=200
    )
    r, freedom = fit.fun, len(fit.fun) - len(x)
    scale = np.linalg.norm(fit.jac, axis=0)
    normal = (fit.jac / scale).T @ (fit.jac / scale)
    if freedom <= 0 or not np.isfinite(normal).all():
        raise ValueError("fewer measurements than unknowns")
    covariance = np.linalg.inv(normal) / np.outer(scale, scale) * (r @ r / freedom)
    blocks = fit.x[count:].reshape(-1, 6)
    return {
        "status": "ok" if fit.success else "not_converged",
        "parameters": {NAMES[i]: float(v) for i, v in zip(free, fit.x)},
        "poses": [{"rotation": rotation_matrix(b[:3]).tolist(), "translation": b[3:].tolist()} for b in blocks],
        "covariance": {"parameters": problem["free"], "matrix": covariance[:count, :count].tolist()},
        "pose_covariances": pose_covariances(covariance, count, blocks),
        "rmse": float(np.sqrt(r @ r / (len(r) / 2))),
        "message": fit.message,
    }


if __name__ == "__main__":
    main(solve)

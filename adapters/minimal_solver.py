"""A complete solver for `calibench gate`: the standard library and NumPy, nothing else.

    calibench gate --solver "python3 adapters/minimal_solver.py"

It estimates what it is asked to by Gauss-Newton with Levenberg damping and numerical derivatives, states its covariance, and
refuses what it cannot solve. It writes no greeting, so that it is asked about Brown-Conrady's lens only. Start your own
adapter from `main` and `answer`.
"""

import json
import os
import sys

# Small matrices: threads only get in each other's way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

NAMES = ["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"]


def rotation_matrix(w):
    """Rodrigues' formula."""
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def rotation_vector(r):
    angle = np.arccos(np.clip((np.trace(r) - 1) / 2, -1, 1))
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return axis * (0.5 if angle < 1e-9 else angle / (2 * np.sin(angle)))


def pose_covariances(covariance, count, poses, unit=1.0):
    """Of `exp([w]x) R` in place of rotation vectors v: a step dv is the small rotation w = J dv with
    J = I + (1 - cos a) / a^2 [v]x + (a - sin a) / a^3 [v]x^2, a = |v| (the left Jacobian). The first `count` rows are the
    camera's, translations are in `unit`."""
    stated = []
    for i, pose in enumerate(poses):
        x, y, z = pose[:3]
        angle, cross = np.linalg.norm(pose[:3]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        small = angle < 1e-4  # 1 - cos a has no digits left
        first = 0.5 if small else (1 - np.cos(angle)) / angle**2
        second = 1 / 6 if small else (angle - np.sin(angle)) / angle**3
        step = unit * np.eye(6)
        step[:3, :3] = np.eye(3) + first * cross + second * (cross @ cross)
        rows = slice(count + 6 * i, count + 6 * i + 6)
        stated.append((step @ covariance[rows, rows] @ step.T).tolist())
    return stated


def project(camera, pose, target):
    fx, fy, cx, cy, skew, k1, k2, p1, p2, k3 = camera
    r = rotation_matrix(pose[:3])
    point = target @ r[:, :2].T + pose[3:]
    x, y = point[:, 0] / point[:, 2], point[:, 1] / point[:, 2]
    s = x * x + y * y
    g = 1 + s * (k1 + s * (k2 + s * k3))
    xd = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    yd = y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y
    return np.stack([fx * xd + skew * yd + cx, fy * yd + cy], axis=1)


def homography(target, pixels):
    """Direct linear transform with normalised coordinates."""

    def normaliser(points):
        centre = points.mean(axis=0)
        scale = np.sqrt(2) / np.linalg.norm(points - centre, axis=1).mean()
        return np.array([[scale, 0, -scale * centre[0]], [0, scale, -scale * centre[1]], [0, 0, 1]])

    t, u = normaliser(target), normaliser(pixels)
    a = np.c_[target, np.ones(len(target))] @ t.T
    b = np.c_[pixels, np.ones(len(pixels))] @ u.T
    zero = np.zeros_like(a)
    rows = np.r_[np.c_[a, zero, -b[:, :1] * a], np.c_[zero, a, -b[:, 1:2] * a]]
    _, singular, v = np.linalg.svd(rows)
    if singular[-2] < 1e-9 * singular[0]:
        raise ValueError("the points of a view do not fix a homography")
    return np.linalg.inv(u) @ v[-1].reshape(3, 3) @ t


def start(problem, views, held):
    """Focal length from the homographies with the principal point at the image centre, then poses."""
    width, height = problem["image_size"]
    cx, cy = held.get("cx", (width - 1) / 2), held.get("cy", (height - 1) / 2)
    rows, right, homographies = [], [], []
    for target, pixels in views:
        h = np.array([[1, 0, -cx], [0, 1, -cy], [0, 0, 1]]) @ homography(target, pixels)
        h /= np.linalg.norm(h)
        homographies.append(h)
        a, b = h[:, 0], h[:, 1]
        rows += [[a[0] * b[0], a[1] * b[1]], [a[0] ** 2 - b[0] ** 2, a[1] ** 2 - b[1] ** 2]]
        right += [-a[2] * b[2], b[2] ** 2 - a[2] ** 2]
    inverse_squares = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
    guess = [1 / np.sqrt(w) if w > 0 else float(width) for w in inverse_squares]
    values = {"fx": guess[0], "fy": guess[1], "cx": cx, "cy": cy} | held
    camera = np.array([values.get(name, 0.0) for name in NAMES])
    poses = []
    for h in homographies:
        m = np.diag([1 / camera[0], 1 / camera[1], 1]) @ h
        m *= np.sign(m[2, 2]) * 2 / (np.linalg.norm(m[:, 0]) + np.linalg.norm(m[:, 1]))
        u, _, v = np.linalg.svd(np.c_[m[:, :2], np.cross(m[:, 0], m[:, 1])])
        poses.append(np.r_[rotation_vector(u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v), m[:, 2]])
    return camera, poses


def views_of(problem):
    views = [(np.array(view["target"], float), np.array(view["pixels"], float)) for view in problem["views"]]
    for target, pixels in views:
        if target.shape != pixels.shape or target.ndim != 2 or not np.isfinite(pixels).all():
            raise ValueError("points and pixels do not pair, or a pixel was not measured")
    if not views:
        raise ValueError("no views")
    return views


def solve(problem):
    held = problem["held"]
    free = [NAMES.index(name) for name in problem["free"]]
    views = views_of(problem)
    # A target of unit size makes the damping mean the same for rotations and translations.
    unit = np.sqrt(np.mean([np.sum(t**2, axis=1).mean() for t, _ in views]))
    views = [(t / unit, p) for t, p in views]
    camera, poses = start(problem, views, held)
    x = np.r_[camera[free], np.concatenate(poses)]

    def residuals(x):
        values = camera.copy()
        values[free] = x[: len(free)]
        blocks = x[len(free) :].reshape(-1, 6)
        return np.concatenate([(project(values, b, t) - p).ravel() for b, (t, p) in zip(blocks, views)])

    ends = np.cumsum([0] + [2 * len(p) for _, p in views])

    def jacobian(x):
        """Central differences; a pose moves the pixels of its own view only."""
        values, count = camera.copy(), len(free)
        values[free] = x[:count]
        j = np.zeros((ends[-1], len(x)))
        for i in range(len(x)):
            h = 1e-6 * max(1.0, abs(x[i]))
            up, down = x.copy(), x.copy()
            up[i] += h
            down[i] -= h
            if i < count:
                j[:, i] = (residuals(up) - residuals(down)) / (2 * h)
            else:
                v = (i - count) // 6
                pose = slice(count + 6 * v, count + 6 * v + 6)
                difference = project(values, up[pose], views[v][0]) - project(values, down[pose], views[v][0])
                j[ends[v] : ends[v + 1], i] = difference.ravel() / (2 * h)
        return j

    damping, r = 1e-3, residuals(x)
    converged = False
    for _ in range(100):
        j = jacobian(x)
        scale = np.linalg.norm(j, axis=0)
        if (scale == 0).any():
            raise ValueError("a parameter has no influence")
        j = j / scale
        normal, gradient = j.T @ j, j.T @ r
        while damping < 1e8:
            step = np.linalg.solve(normal + damping * np.eye(len(x)), -gradient)
            trial = residuals(x + step / scale)
            if trial @ trial <= r @ r:
                break
            damping *= 10
        else:
            converged = True  # no step lowers the cost
            break
        gain = r @ r - trial @ trial
        x, r, damping = x + step / scale, trial, max(damping / 10, 1e-15)
        if gain <= 1e-15 * (r @ r) + 1e-24:
            converged = True
            break
    freedom = len(r) - len(x)
    eigenvalues = np.linalg.eigvalsh(normal)
    if freedom < 0 or eigenvalues[0] < 1e-9 * eigenvalues[-1]:
        raise ValueError("the data do not determine the parameters")
    covariance = np.linalg.inv(normal) / np.outer(scale, scale) * (r @ r / max(freedom, 1))
    count = len(free)
    blocks = x[count:].reshape(-1, 6)
    return {
        "status": "ok" if converged else "not_converged",
        "parameters": {NAMES[i]: float(v) for i, v in zip(free, x)},
        "poses": [
            {"rotation": rotation_matrix(b[:3]).tolist(), "translation": (b[3:] * unit).tolist()} for b in blocks
        ],
        "covariance": {"parameters": problem["free"], "matrix": covariance[:count, :count].tolist()},
        "pose_covariances": pose_covariances(covariance, count, blocks, unit),
        "rmse": float(np.sqrt(r @ r / (len(r) / 2))),
    }


class Unsupported(ValueError):
    """The program is not made for this problem."""


def answer(problem, solve):
    try:
        return {"id": problem["id"]} | solve(problem)
    except Unsupported as error:
        return {"id": problem["id"], "status": "unsupported", "message": str(error)}
    except (ValueError, ArithmeticError, RuntimeError, np.linalg.LinAlgError, IndexError) as error:
        return {"id": problem["id"], "status": "refused", "message": str(error)}


def main(solve):
    np.seterr(all="ignore")
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line), solve)), flush=True)


if __name__ == "__main__":
    main(solve)

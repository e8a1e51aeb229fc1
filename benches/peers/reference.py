"""How exact is an answer? Every row's answer against an optimum computed here, in other ways than any of the compared programs."""

from functools import lru_cache

import numpy as np

from serve import numbers

CAMERA = np.array([600.0, 600, 326, 243, -0.18, 0.05])


class Reference:
    """Measures of the answers to the problems in a folder: each returns a number in the unit of `UNITS`."""

    def __init__(self, folder):
        self.folder = folder

    def measure(self, row, answer):
        kind, _, size = row.partition("-")
        return {
            "calibrate": lambda: self.calibration(size, answer),
            "wide": lambda: self.wide_calibration(kind, size, answer),
            "rational": lambda: self.wide_calibration(kind, size, answer),
            "homography": lambda: self.homography(answer),
            "affine": lambda: self.affine(answer),
            "points": lambda: self.points(answer),
            "remap": lambda: self.rectified(size, answer),
            "undistort": lambda: self.rectified(size, answer),
            "grid": lambda: self.centres("grid", answer),
            "dots": lambda: self.centres("dots", answer),
        }[kind]()

    @lru_cache
    def optimum(self, size):
        """Least squares by Gauss-Newton steps, and the standard deviations of the six intrinsics for noise of 0.1 px."""
        return least_squares(normal_parts, 6, *self.problem("views", "found", size), 4)

    @lru_cache
    def wide_optimum(self, kind, size):
        """The same of the cameras with other lenses; valleys of coefficients that make up for each other take more steps."""
        parameters = {"wide": 8, "rational": 12}[kind]
        problem = self.problem(f"{kind}-views", f"{kind}-found", size)
        return least_squares(lambda *state: parts_by_complex_steps(IMAGES[kind], *state), parameters, *problem, 12)

    def problem(self, views, found, size):
        """Pairs of points and pixels view by view, and where to start."""
        pairs = numbers(self.folder, f"{views}-{size}").reshape(int(size), -1, 4)
        return pairs, numbers(self.folder, f"{found}-{size}")

    def wide_calibration(self, kind, size, answer):
        """Largest distance of a parameter from the optimum, in standard deviations."""
        optimum, deviations = self.wide_optimum(kind, size)
        return np.max(np.abs(answer - optimum) / deviations)

    def calibration(self, size, answer):
        """Largest distance of a parameter from the optimum, in standard deviations."""
        optimum, deviations = self.optimum(size)
        return np.max(np.abs(answer - optimum) / deviations)

    def homography(self, answer):
        """Largest distance of a mapped point from where the optimum maps it, px."""
        pairs = numbers(self.folder, "homography").reshape(-1, 4)
        source = np.c_[pairs[:, :2], np.ones(len(pairs))]
        h = np.asarray(answer, float) / answer[8]
        best = h.copy()
        for _ in range(6):
            p = source @ best.reshape(3, 3).T
            q = p[:, :2] / p[:, 2:]
            row = source / p[:, 2:]
            zero = np.zeros_like(row)
            u = np.c_[row, zero, -q[:, :1] * row[:, :2]]
            v = np.c_[zero, row, -q[:, 1:] * row[:, :2]]
            j = np.r_[u, v]
            scale = np.linalg.norm(j, axis=0)
            r = np.r_[q[:, 0] - pairs[:, 2], q[:, 1] - pairs[:, 3]]
            best[:8] -= np.linalg.lstsq(j / scale, r, rcond=None)[0] / scale
        mapped = [(p[:, :2] / p[:, 2:]) for p in (source @ m.reshape(3, 3).T for m in (h, best))]
        return np.max(np.linalg.norm(mapped[0] - mapped[1], axis=1))

    def affine(self, answer):
        """Largest distance of a mapped point from where the least-squares map puts it, world units (mm)."""
        pairs = numbers(self.folder, "affine").reshape(-1, 4)
        source = np.c_[pairs[:, :2], np.ones(len(pairs))]
        best = np.linalg.lstsq(source, pairs[:, 2:], rcond=None)[0]
        return np.max(np.linalg.norm(source @ (np.reshape(answer, (2, 3)).T - best), axis=1))

    def points(self, answer):
        """Largest distance of a pixel from where the lens puts its corrected position, px."""
        pixels = numbers(self.folder, "points").reshape(-1, 2)
        there = distort(np.reshape(answer, (-1, 2)), CAMERA)
        return np.max(np.linalg.norm(there - pixels, axis=1))

    def rectified(self, size, answer):
        """Largest difference from exact bilinear sampling, grey levels, over the pixels whose source lies inside the image."""
        width, height = map(int, size.split("x"))
        image = np.fromfile(self.folder / f"frame-{size}", dtype=np.uint8).reshape(height, width).astype(float)
        camera = np.r_[CAMERA[:4] * width / 640, CAMERA[4:]]
        worst = 0.0
        for first in range(0, height, 500):
            rows = np.arange(first, min(first + 500, height))
            v, u = np.meshgrid(rows, np.arange(width), indexing="ij")
            source = distort(np.c_[u.ravel(), v.ravel()].astype(float), camera)
            inside = np.all((source >= 0) & (source <= [width - 1, height - 1]), axis=1)
            x, y = source[inside].T
            i, j = np.minimum(x.astype(int), width - 2), np.minimum(y.astype(int), height - 2)
            right, down = x - i, y - j
            top = image[j, i] * (1 - right) + image[j, i + 1] * right
            bottom = image[j + 1, i] * (1 - right) + image[j + 1, i + 1] * right
            exact = top * (1 - down) + bottom * down
            found = np.reshape(answer, (height, width))[rows].ravel()[inside]
            worst = max(worst, np.max(np.abs(found - exact)))
        return worst

    def centres(self, name, answer):
        """Root mean square distance of the found centres from the true ones, px."""
        true = numbers(self.folder, f"{name}-true").reshape(-1, 2)
        found = np.reshape(answer, (-1, 2))
        if len(found) != len(true):
            return np.inf
        nearest = np.min(np.linalg.norm(found[:, None] - true[None], axis=2), axis=1)
        return np.sqrt(np.mean(nearest**2))


# What the number is, by kind of row.
UNITS = {
    "calibrate": "sd",
    "wide": "sd",
    "rational": "sd",
    "homography": "px",
    "affine": "mm",
    "points": "px",
    "remap": "grey",
    "undistort": "grey",
    "grid": "px",
    "dots": "px",
}


def distort(pixels, camera):
    """The pixels where a lens puts the pixels of a camera without distortion."""
    fx, fy, cx, cy, k1, k2 = camera
    x, y = (pixels[:, 0] - cx) / fx, (pixels[:, 1] - cy) / fy
    s = x * x + y * y
    g = 1 + s * (k1 + s * k2)
    return np.c_[fx * x * g + cx, fy * y * g + cy]


def least_squares(parts, parameters, pairs, start, steps):
    """The intrinsics after Gauss-Newton steps from a start near by, and their standard deviations for noise of 0.1 px."""
    camera, poses = start[:parameters].copy(), start[parameters:].reshape(-1, 12)
    rotations, translations = poses[:, :9].reshape(-1, 3, 3).copy(), poses[:, 9:].copy()
    for _ in range(steps):
        ja, jc, r = parts(camera, rotations, translations, pairs)
        a = np.einsum("vpi,vpj->ij", ja, ja)
        b = np.einsum("vpi,vpj->vij", ja, jc)
        c = np.einsum("vpi,vpj->vij", jc, jc)
        follow = np.linalg.solve(c, b.transpose(0, 2, 1))
        schur = a - np.einsum("vij,vjk->ik", b, follow)
        gc = np.einsum("vpi,vp->vi", jc, r)
        ga = np.einsum("vpi,vp->i", ja, r) - np.einsum("vji,vj->i", follow, gc)
        # Scaled by its diagonal: the columns' units differ by powers of ten.
        scale = 1 / np.sqrt(np.diag(schur))
        scaled = schur * np.outer(scale, scale)
        step = -scale * np.linalg.solve(scaled, scale * ga)
        turn = -np.linalg.solve(c, gc[..., None])[..., 0] - follow @ step
        camera += step
        rotations = np.array([rotation(w) for w in turn[:, :3]]) @ rotations
        translations += turn[:, 3:]
    deviations = 0.1 * scale * np.sqrt(np.diag(np.linalg.inv(scaled)))
    if np.max(np.abs(step) / deviations) > 1e-6:
        raise RuntimeError("the reference has not converged")
    return camera, deviations


def fisheye_image(camera, x, y, z):
    """u and v of points before a fisheye of Kannala and Brandt: fx, fy, cx, cy, k1 to k4."""
    fx, fy, cx, cy, k1, k2, k3, k4 = camera
    r = np.sqrt(x * x + y * y)
    # On the axis the direction does not matter.
    r = np.where(r == 0, 1e-150, r)
    angle = np.arctan(r / z)
    t = angle * angle
    d = angle * (1 + t * (k1 + t * (k2 + t * (k3 + t * k4)))) / r
    return fx * x * d + cx, fy * y * d + cy


def rational_image(camera, x, y, z):
    """The same of the rational model: fx, fy, cx, cy, k1, k2, p1, p2, k3 to k6."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 = camera
    x, y = x / z, y / z
    s = x * x + y * y
    g = (1 + s * (k1 + s * (k2 + s * k3))) / (1 + s * (k4 + s * (k5 + s * k6)))
    xd = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    yd = y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y
    return fx * xd + cx, fy * yd + cy


IMAGES = {"wide": fisheye_image, "rational": rational_image}


def parts_by_complex_steps(image, camera, rotations, translations, pairs):
    """As `normal_parts`, the derivatives by steps along the imaginary axis (Squire & Trapp 1998), exact to rounding."""
    step = 1e-100
    target = np.concatenate([pairs[..., :2], np.zeros((*pairs.shape[:2], 1))], axis=-1)
    q = np.einsum("vij,vpj->vpi", rotations, target)
    p = (q + translations[:, None]).astype(complex)
    slope = lambda camera, p: np.stack([c.imag / step for c in image(camera, *np.moveaxis(p, -1, 0))], 2)
    moved = [camera + 1j * step * row for row in np.eye(len(camera))]
    ja = np.stack([slope(one, p) for one in moved], -1)
    by_point = np.stack([slope(camera, p + 1j * step * row) for row in np.eye(3)], -1)
    by_turn = np.cross(q[:, :, None, :], by_point)
    jc = np.concatenate([by_turn, by_point], -1)
    seen = np.stack(image(camera, *np.moveaxis(p.real, -1, 0)), 2)
    flat = lambda a: a.reshape(len(pairs), -1, a.shape[-1])
    return flat(ja), flat(jc), (seen - pairs[..., 2:]).reshape(len(pairs), -1)


def rotation(w):
    """Rodrigues' formula for a small turn."""
    angle = np.linalg.norm(w)
    k = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    if angle < 1e-12:
        return np.eye(3) + k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def normal_parts(camera, rotations, translations, pairs):
    """Jacobians by the intrinsics and by the poses (turned on the left), and residuals, of every view."""
    fx, fy, cx, cy, k1, k2 = camera
    target = np.concatenate([pairs[..., :2], np.zeros((*pairs.shape[:2], 1))], axis=-1)
    q = np.einsum("vij,vpj->vpi", rotations, target)
    p = q + translations[:, None]
    x, y, z = p[..., 0] / p[..., 2], p[..., 1] / p[..., 2], p[..., 2]
    s = x * x + y * y
    g, slope = 1 + s * (k1 + s * k2), k1 + 2 * s * k2
    zero, one = np.zeros_like(x), np.ones_like(x)
    lens_u = [x * g, zero, one, zero, fx * x * s, fx * x * s * s]
    lens_v = [zero, y * g, zero, one, fy * y * s, fy * y * s * s]
    ja = np.stack([np.stack(lens_u, -1), np.stack(lens_v, -1)], 2)
    by_x = np.stack([fx * (g + 2 * slope * x * x), fy * 2 * slope * x * y], 2)
    by_y = np.stack([fx * 2 * slope * x * y, fy * (g + 2 * slope * y * y)], 2)
    by_point = np.stack([by_x, by_y, -(by_x * x[..., None] + by_y * y[..., None])], -1) / z[..., None, None]
    by_turn = np.cross(q[:, :, None, :], by_point)
    jc = np.concatenate([by_turn, by_point], -1)
    residual = np.stack([fx * x * g + cx - pairs[..., 2], fy * y * g + cy - pairs[..., 3]], 2)
    flat = lambda a: a.reshape(len(pairs), -1, a.shape[-1])
    return flat(ja), flat(jc), residual.reshape(len(pairs), -1)

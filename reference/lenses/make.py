"""Pixels of other programs for lenses of every model that they have: `python3 make.py > pixels.csv`.

OpenCV's projectPoints (5, 8, 12 and 14 coefficients) and fisheye.projectPoints; the double sphere and the division
model written out from their papers (Usenko et al. 2018, equations 40 to 43; Fitzgibbon 2001, equation 1, solved for
the distorted point by bisection). HALCON's polynomial takes the seen point to the ideal one, as OpenCV's five
coefficients take the ideal one to the seen one but for the order of p1 and p2: OpenCV's undistortPoints solves it.
"""

import cv2
import numpy as np

rng = np.random.default_rng(20260101)
K = np.array([[812.5, 0.0, 641.25], [0.0, 806.75, 477.5], [0.0, 0.0, 1.0]])
BROWN = [-0.21, 0.06, 1.2e-3, -7e-4, 0.013]
RATIONAL = [0.61, 0.05, 1.2e-3, -7e-4, 1.3e-3, 0.91, 0.21, 0.011]
PRISM = [2e-3, -1e-3, 1.5e-3, 7e-4]
TILT = [0.03, -0.05]
LENSES = {
    "brown-conrady": BROWN,
    "rational": RATIONAL,
    "thin-prism": RATIONAL + PRISM,
    "tilted": RATIONAL + PRISM + TILT,
    "kannala-brandt": [-0.021, 0.0043, -0.0011, 2.3e-4],
    "division": [-0.27],
    "double-sphere": [-0.2, 0.6],
    "halcon-polynomial": [0.25, 0.04, 6e-4, -9e-4, -0.01],
}


def division(point, k1):
    r = np.hypot(point[0], point[1]) / point[2]
    low, high = 0.0, max(r, 10.0)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle / (1 + k1 * middle * middle) < r and 1 + k1 * middle * middle > 0:
            low = middle
        else:
            high = middle
    scale = low / np.hypot(point[0], point[1])
    return point[0] * scale, point[1] * scale


def double_sphere(point, xi, alpha):
    x, y, z = point
    d1 = np.sqrt(x * x + y * y + z * z)
    w = xi * d1 + z
    d2 = np.sqrt(x * x + y * y + w * w)
    below = alpha * d2 + (1 - alpha) * w
    return x / below, y / below


def halcon_polynomial(point, k1, k2, p1, p2, k3):
    ideal = np.array([point[0] / point[2], point[1] / point[2]]).reshape(1, 1, 2)
    changed_over = np.array([k1, k2, p2, p1, k3])
    # Each round more than halves the error of these coefficients over this frame: 200 leave rounding alone.
    rounds = (cv2.TERM_CRITERIA_COUNT, 200, 0.0)
    return cv2.undistortPoints(ideal, np.eye(3), changed_over, criteria=rounds).ravel()


def pixel(model, coefficients, point):
    p = np.array(point, dtype=np.float64).reshape(1, 1, 3)
    zero = np.zeros(3)
    if model == "kannala-brandt":
        return cv2.fisheye.projectPoints(p, zero, zero, K, np.array(coefficients))[0].ravel()
    if model == "division":
        x, y = division(point, coefficients[0])
    elif model == "double-sphere":
        x, y = double_sphere(point, *coefficients)
    elif model == "halcon-polynomial":
        x, y = halcon_polynomial(point, *coefficients)
    else:
        return cv2.projectPoints(p, zero, zero, K, np.array(coefficients))[0].ravel()
    return K[0, 0] * x + K[0, 2], K[1, 1] * y + K[1, 2]


print("model,coefficients,X,Y,Z,u,v")
for model, coefficients in LENSES.items():
    for _ in range(40):
        wide = 1.0 if model in ("kannala-brandt", "double-sphere") else 0.75
        point = [rng.uniform(-wide, wide), rng.uniform(-wide, wide), rng.uniform(0.3 if wide == 1.0 else 0.9, 2.0)]
        u, v = pixel(model, coefficients, point)
        lens = " ".join(repr(c) for c in coefficients)
        print(f"{model},{lens},{point[0]!r},{point[1]!r},{point[2]!r},{float(u)!r},{float(v)!r}")

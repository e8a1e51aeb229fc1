"""Where does a lens put a point in camera coordinates? The equations of adapters/PROTOCOL.md, for `make.py`; standard library only.

`certify_lenses.py` has them too, with derivatives, and shares nothing with this file.
"""

import math

# What a model has besides fx, fy, cx, cy and skew.
COEFFICIENTS = {
    "brown-conrady": ["k1", "k2", "p1", "p2", "k3"],
    "rational": ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
    "thin-prism": ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"],
    "tilted": ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"],
    "kannala-brandt": ["k1", "k2", "k3", "k4"],
    "division": ["k1"],
    "double-sphere": ["xi", "alpha"],
    "halcon-polynomial": ["k1", "k2", "p1", "p2", "k3"],
}
# Their far start has an equidistant fisheye's focal length and poses.
FISHEYES = ("kannala-brandt", "double-sphere")


def image(camera, point):
    """(x_d, y_d), or None where the lens has no image of the point."""
    model = camera.get("model", "brown-conrady")
    if model == "kannala-brandt":
        return kannala_brandt(camera, *point)
    if model == "division":
        return division(camera, *point)
    if model == "double-sphere":
        return double_sphere(camera, *point)
    if point[2] <= 0:
        return None
    x, y = point[0] / point[2], point[1] / point[2]
    if model == "halcon-polynomial":
        return halcon_polynomial(camera, x, y)
    s = x * x + y * y
    g = 1 + camera["k1"] * s + camera["k2"] * s**2 + camera["k3"] * s**3
    if model != "brown-conrady":
        g /= 1 + camera["k4"] * s + camera["k5"] * s**2 + camera["k6"] * s**3
    xd = x * g + 2 * camera["p1"] * x * y + camera["p2"] * (s + 2 * x * x)
    yd = y * g + camera["p1"] * (s + 2 * y * y) + 2 * camera["p2"] * x * y
    if model in ("thin-prism", "tilted"):
        xd += camera["s1"] * s + camera["s2"] * s**2
        yd += camera["s3"] * s + camera["s4"] * s**2
    return on_tilted_sensor(camera["tau_x"], camera["tau_y"], xd, yd) if model == "tilted" else (xd, yd)


def on_tilted_sensor(tau_x, tau_y, x, y):
    """Where the ray along (x, y, 1) meets a sensor whose axes are turned, in the sensor's own coordinates.

    After the turn R = R_y(tau_y) R_x(tau_x) the sensor is upright, the ray is along q = R (x, y, 1) and the lens's axis along
    c = R (0, 0, 1). The sensor is crossed by the axis at (0, 0), so the pinhole stands at -c from there: the ray meets it at
    c_z q / q_z - c.
    """
    q = turned(tau_x, tau_y, (x, y, 1.0))
    c = turned(tau_x, tau_y, (0.0, 0.0, 1.0))
    return c[2] * q[0] / q[2] - c[0], c[2] * q[1] / q[2] - c[1]


def turned(tau_x, tau_y, v):
    """R_y R_x v, with the signs of OpenCV's documentation: x about its axis first."""
    x, y, z = v
    y, z = math.cos(tau_x) * y + math.sin(tau_x) * z, math.cos(tau_x) * z - math.sin(tau_x) * y
    x, z = math.cos(tau_y) * x - math.sin(tau_y) * z, math.sin(tau_y) * x + math.cos(tau_y) * z
    return x, y, z


def kannala_brandt(camera, x, y, z):
    t = math.hypot(x, y)
    if t == 0:
        return 0.0, 0.0
    a = math.atan2(t, z)
    b = a * a
    d = a * (1 + camera["k1"] * b + camera["k2"] * b**2 + camera["k3"] * b**3 + camera["k4"] * b**4)
    return x / t * d, y / t * d


def division(camera, x, y, z):
    """The distorted radius r_d with r_d / (1 + k1 r_d^2) = t / z, the smaller root; by bisection for a barrel (k1 < 0)."""
    t, k1 = math.hypot(x, y), camera["k1"]
    if z <= 0 or k1 > 0:
        raise ValueError("division: only barrels, and points before the camera, are drawn here")
    low, high = 0.0, t / z
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if middle * z < t * (1 + k1 * middle * middle) else (low, middle)
    return (x / t * low, y / t * low) if t else (0.0, 0.0)


def double_sphere(camera, x, y, z):
    d1 = math.sqrt(x * x + y * y + z * z)
    w = camera["xi"] * d1 + z
    below = camera["alpha"] * math.sqrt(x * x + y * y + w * w) + (1 - camera["alpha"]) * w
    return (x / below, y / below) if below > 0 else None


def halcon_polynomial(camera, x, y):
    """The seen point whose ideal one is (x, y), on the branch that holds the axis: without p1 and p2 by bisection along the radius, and
    from there by Newton's method in the plane, whose steps are halved until they come nearer and stay on the branch.
    """
    k1, k2, p1, p2, k3 = (camera[name] for name in COEFFICIENTS["halcon-polynomial"])

    def ideal(u, v):
        s = u * u + v * v
        radial = 1 + k1 * s + k2 * s**2 + k3 * s**3
        return u * radial + p1 * (s + 2 * u * u) + 2 * p2 * u * v, v * radial + 2 * p1 * u * v + p2 * (s + 2 * v * v)

    def slopes(u, v):
        """d x / d u, d x / d v = d y / d u, and d y / d v: the matrix is symmetric."""
        s = u * u + v * v
        radial, more = 1 + k1 * s + k2 * s**2 + k3 * s**3, 2 * k1 + 4 * k2 * s + 6 * k3 * s**2
        return (
            radial + more * u * u + 6 * p1 * u + 2 * p2 * v,
            more * u * v + 2 * p1 * v + 2 * p2 * u,
            radial + more * v * v + 2 * p1 * u + 6 * p2 * v,
        )

    def on_branch(u, v):
        """Is the matrix positive definite here? It is on the axis, and ceases to be where the image folds."""
        a, b, d = slopes(u, v)
        return a > 0 and a * d > b * b

    def distance(u, v):
        p, q = ideal(u, v)
        return math.hypot(p - x, q - y)

    t = math.hypot(x, y)
    if t == 0:
        return 0.0, 0.0
    # Outwards as far as the radius needs, or to its fold.
    radius = lambda r: r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6)
    low, pace = 0.0, min(t, 1.0) / 32
    while radius(low) < radius(low + pace) < t:
        low += pace
    high = low + pace
    if radius(high) >= t:
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if radius(middle) < t else (low, middle)
    u, v = x / t * low, y / t * low
    # p1 and p2 move the fold a little: back from it.
    while not on_branch(u, v):
        u, v = 0.98 * u, 0.98 * v
    for _ in range(50):
        p, q = ideal(u, v)
        a, b, d = slopes(u, v)
        determinant = a * d - b * b
        du, dv = (d * (x - p) - b * (y - q)) / determinant, (a * (y - q) - b * (x - p)) / determinant
        part = 1.0
        while part > 1e-3 and not (on_branch(u + part * du, v + part * dv) and distance(u + part * du, v + part * dv) < distance(u, v)):
            part /= 2
        if part <= 1e-3:
            break
        u, v = u + part * du, v + part * dv
    from_the_axis = all(on_branch(u * i / 64, v * i / 64) for i in range(65))
    return (u, v) if from_the_axis and distance(u, v) < 1e-12 * (1 + t) else None

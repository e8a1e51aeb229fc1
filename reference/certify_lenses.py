"""Where does a lens put a point in camera coordinates, and how does that move with the point and with the coefficients?

For `certify.py`: every model is written from its literature, with derivatives of its own, for numbers of any precision. A model takes
coefficients and a point `(X, Y, Z)` and returns None where it has no image, or

    image        (x_d, y_d), on the plane of the linear parameters
    by_point     (d x_d / d (X, Y, Z), d y_d / d (X, Y, Z))
    by_lens      (d x_d / d c, d y_d / d c) of each coefficient c

`certify.py` compares all derivatives with differences in 60 digits before it certifies anything.
"""

import math

# Coefficients by model, in the order in which the functions take them.
COEFFICIENTS = {
    "brown-conrady": "k1 k2 p1 p2 k3".split(),
    "rational": "k1 k2 p1 p2 k3 k4 k5 k6".split(),
    "thin-prism": "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4".split(),
    "tilted": "k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y".split(),
    "kannala-brandt": "k1 k2 k3 k4".split(),
    "division": ["k1"],
    "double-sphere": ["xi", "alpha"],
    "halcon-polynomial": "k1 k2 p1 p2 k3".split(),
}

# Of a lens that must be solved: paces per unit of the radius, so many at first, the shortest, and the most steps of Newton's method.
PACES, MOST_PACES, LEAST_PACE, NEWTON_STEPS = 4, 64, 1e-4, 30


# --- lenses before which a point must lie: functions of (x, y) = (X / Z, Y / Z) -------------------------------------------------------


def brown_conrady(ctx, coefficients, x, y):
    """Brown (1971): image, derivatives by x and y, derivatives by k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = coefficients
    s = x * x + y * y
    g, slope = 1 + s * (k1 + s * (k2 + s * k3)), k1 + s * (2 * k2 + s * 3 * k3)
    image, across, tangential = with_tangential(x, y, s, g, slope, p1, p2)
    powers = [(x * s, y * s), (x * s * s, y * s * s), (x * s * s * s, y * s * s * s)]
    return image, across, [powers[0], powers[1], *tangential, powers[2]]


def rational(ctx, coefficients, x, y):
    """A quotient of two cubics in s (Claus & Fitzgibbon 2005 and OpenCV's documentation of its camera model)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients
    s = x * x + y * y
    above, below = 1 + s * (k1 + s * (k2 + s * k3)), 1 + s * (k4 + s * (k5 + s * k6))
    if not below > 0:
        return None
    g = above / below
    slope = (k1 + s * (2 * k2 + 3 * s * k3) - g * (k4 + s * (2 * k5 + 3 * s * k6))) / below
    image, across, tangential = with_tangential(x, y, s, g, slope, p1, p2)
    first = s / below
    up = [(x * f, y * f) for f in (first, first * s, first * s * s)]
    down = [(-g * a, -g * b) for a, b in up]
    return image, across, [up[0], up[1], *tangential, up[2], *down]


def with_tangential(x, y, s, g, slope, p1, p2):
    """A radial factor g of slope dg/ds, and Conrady's decentring: image, derivatives by x and y, derivatives by p1 and p2."""
    along_x, along_y, cross = s + 2 * x * x, s + 2 * y * y, 2 * x * y
    image = (x * g + p1 * cross + p2 * along_x, y * g + p1 * along_y + p2 * cross)
    mixed = cross * slope + 2 * p1 * x + 2 * p2 * y
    across = (
        (g + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x, mixed),
        (mixed, g + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x),
    )
    return image, across, [(cross, along_y), (along_x, cross)]


def thin_prism(ctx, coefficients, x, y):
    """The rational model and thin prisms (Weng, Cohen & Herniou 1992; OpenCV's documentation)."""
    s1, s2, s3, s4 = coefficients[8:]
    bent = rational(ctx, coefficients[:8], x, y)
    if bent is None:
        return None
    (xd, yd), ((a, b), (c, d)), lens = bent
    s, zero = x * x + y * y, 0 * x
    right, down = 2 * (s1 + 2 * s2 * s), 2 * (s3 + 2 * s4 * s)
    image = (xd + s * (s1 + s2 * s), yd + s * (s3 + s4 * s))
    across = ((a + right * x, b + right * y), (c + down * x, d + down * y))
    return image, across, lens + [(s, zero), (s * s, zero), (zero, s), (zero, s * s)]


def tilted(ctx, coefficients, x, y):
    """A sensor tilted behind a lens (Scheimpflug; OpenCV's documentation, after Louhichi et al. 2007).

    (x_d, y_d, 1) ~ P R (x_t, y_t, 1), with R = R_y R_x of the two tilts and P the perspective onto the sensor's plane: the rows
    (R33, 0, -R13), (0, R33, -R23), (0, 0, 1).
    """
    tau_x, tau_y = coefficients[12:]
    bent = thin_prism(ctx, coefficients[:12], x, y)
    if bent is None:
        return None
    (xt, yt), across, lens = bent
    turn_x, turn_y = about_x(ctx, tau_x), about_y(ctx, tau_y)
    quarter = ctx.pi / 2
    # The derivative of a cosine and a sine is that of an angle a quarter turn on; what does not turn has none.
    by_x = [[0 * e if (i == 0 or j == 0) else e for j, e in enumerate(row)] for i, row in enumerate(about_x(ctx, tau_x + quarter))]
    by_y = [[0 * e if (i == 1 or j == 1) else e for j, e in enumerate(row)] for i, row in enumerate(about_y(ctx, tau_y + quarter))]
    r = times(turn_y, turn_x)
    m = times(perspective(ctx, r, 1), r)
    vector = (xt, yt, ctx.mpf(1))
    h = applied(m, vector)
    if not h[2] > 0:
        return None
    image = (h[0] / h[2], h[1] / h[2])

    def moved(change):
        """What the image does when h changes."""
        return ((change[0] - image[0] * change[2]) / h[2], (change[1] - image[1] * change[2]) / h[2])

    def through(a, b):
        """What it does when (x_t, y_t) changes by (a, b)."""
        return moved([row[0] * a + row[1] * b for row in m])

    def by_angle(dr):
        first, second = times(perspective(ctx, dr, 0), r), times(perspective(ctx, r, 1), dr)
        return moved([p + q for p, q in zip(applied(first, vector), applied(second, vector))])

    by_column = [through(across[0][k], across[1][k]) for k in (0, 1)]
    across = tuple((by_column[0][i], by_column[1][i]) for i in (0, 1))
    angles = [by_angle(times(turn_y, by_x)), by_angle(times(by_y, turn_x))]
    return image, across, [through(a, b) for a, b in lens] + angles


def about_x(ctx, angle):
    c, s, one, zero = ctx.cos(angle), ctx.sin(angle), ctx.mpf(1), ctx.mpf(0)
    return [[one, zero, zero], [zero, c, s], [zero, -s, c]]


def about_y(ctx, angle):
    c, s, one, zero = ctx.cos(angle), ctx.sin(angle), ctx.mpf(1), ctx.mpf(0)
    return [[c, zero, -s], [zero, one, zero], [s, zero, c]]


def perspective(ctx, r, corner):
    """P of a rotation; with corner 0 and the derivative of a rotation its derivative."""
    zero = ctx.mpf(0)
    return [[r[2][2], zero, -r[0][2]], [zero, r[2][2], -r[1][2]], [zero, zero, ctx.mpf(corner)]]


def times(a, b):
    return [[sum(row[k] * b[k][j] for k in range(3)) for j in range(3)] for row in a]


def applied(m, v):
    return [row[0] * v[0] + row[1] * v[1] + row[2] * v[2] for row in m]


def halcon_polynomial(ctx, coefficients, x, y):
    """HALCON's polynomial (MVTec's operator reference, "Calibration"): the ideal point as a polynomial of the seen one, solved for that.

    Newton's method, from a point in double precision on the branch that holds the axis. Where the seen point p belongs to the ideal one q,
    q = F(p; c), it moves by F_p^-1 when q moves, and by -F_p^-1 F_c when a coefficient does.
    """
    start = followed([float(c) for c in coefficients], float(x), float(y))
    if start is None:
        return None
    a, b = (ctx.mpf(c) for c in start)
    # The error after a step is of the order of its square.
    enough = ctx.sqrt(ctx.eps) / 1000
    for _ in range(NEWTON_STEPS):
        (p, q), across, _ = to_ideal(coefficients, a, b)
        step = solved(across, x - p, y - q)
        if step is None:
            return None
        a, b = a + step[0], b + step[1]
        if abs(step[0]) + abs(step[1]) <= enough * (1 + abs(a) + abs(b)):
            break
    else:
        return None
    _, across, by_lens = to_ideal(coefficients, a, b)
    one, zero = ctx.mpf(1), ctx.mpf(0)
    columns = [solved(across, one, zero), solved(across, zero, one)]
    if None in columns:
        return None
    return (a, b), tuple(zip(*columns)), [solved(across, -f, -g) for f, g in by_lens]


def to_ideal(coefficients, a, b):
    """The ideal point of a seen one, its derivatives by that and by k1 k2 p1 p2 k3: Brown's lens with p1 and p2 changed over."""
    k1, k2, p1, p2, k3 = coefficients
    s = a * a + b * b
    g, slope = 1 + s * (k1 + s * (k2 + s * k3)), k1 + s * (2 * k2 + s * 3 * k3)
    image, across, (by_second, by_first) = with_tangential(a, b, s, g, slope, p2, p1)
    return image, across, [(a * s, b * s), (a * s * s, b * s * s), by_first, by_second, (a * s * s * s, b * s * s * s)]


def solved(across, p, q):
    """across^-1 (p, q), or None where the symmetric matrix is not positive definite: the axis's branch has ended."""
    (a, b), (_, d) = across
    determinant = a * d - b * b
    if not (a > 0 and determinant > 0):
        return None
    return (d * p - b * q) / determinant, (a * q - b * p) / determinant


def followed(coefficients, x, y):
    """The seen point of an ideal one, to about double precision: followed out from the axis as the ideal one moves along its ray.

    None where the branch ends on the way, which is where no pace is short enough any more.
    """
    seen, done, pace = (0.0, 0.0), 0.0, 1 / (1 + int(min(MOST_PACES, PACES * math.hypot(x, y))))
    while done < 1:
        part = min(done + pace, 1.0)
        moved = paced(coefficients, seen, part * x, part * y)
        if moved is not None:
            seen, done = moved, part
        elif pace > LEAST_PACE:
            pace /= 2
        else:
            return None
    return seen


def paced(coefficients, seen, x, y):
    """The seen point of (x, y) from that of a neighbour by steps of Newton's method, or None where they might have left the branch.

    They have not where they shrink at once, and where the matrix stays positive definite on the way and its determinant about what it was:
    a step over a fold, to where another branch begins, starts from a determinant near 0.
    """
    (a, b), sizes, determinants = seen, [], []
    for _ in range(4):
        (p, q), across, _ = to_ideal(coefficients, a, b)
        step = solved(across, x - p, y - q)
        if step is None:
            return None
        determinants.append(across[0][0] * across[1][1] - across[0][1] ** 2)
        sizes.append(math.hypot(*step))
        a, b = a + step[0], b + step[1]
    shrinks = all(after < before_it / 4 or after < 1e-12 for before_it, after in zip(sizes, sizes[1:]))
    alike = max(determinants) < 2 * min(determinants)
    halfway = to_ideal(coefficients, (a + seen[0]) / 2, (b + seen[1]) / 2)[1]
    return (a, b) if shrinks and alike and solved(halfway, 0.0, 0.0) else None


def before(bend):
    """A model of rays from a model of (X / Z, Y / Z): points must lie before the camera."""

    def model(ctx, coefficients, point):
        X, Y, Z = point
        if not Z > 0:
            return None
        w = 1 / Z
        x, y = X * w, Y * w
        bent = bend(ctx, coefficients, x, y)
        if bent is None:
            return None
        image, across, by_lens = bent
        return image, tuple((a * w, b * w, -(a * x + b * y) * w) for a, b in across), by_lens

    return model


# --- lenses that see beside and behind themselves -----------------------------------------------------------------------------------


def kannala_brandt(ctx, coefficients, point):
    """The radius is an odd polynomial of the angle from the axis (Kannala & Brandt 2006, equation 6, with d1 = 1)."""
    X, Y, Z = point
    r = ctx.sqrt(X * X + Y * Y)
    if r == 0:
        # On the axis the image is (X, Y) / Z to first order, whatever the coefficients.
        if not Z > 0:
            return None
        w, zero = 1 / Z, 0 * Z
        return (zero, zero), ((w, zero, zero), (zero, w, zero)), [(zero, zero)] * 4
    theta = ctx.atan2(r, Z)
    t = theta * theta
    radius, slope, power = theta, 1 + 0 * t, theta
    by_k = []
    for order, k in zip((3, 5, 7, 9), coefficients):
        slope += order * k * power * theta
        power *= t
        radius += k * power
        by_k.append(power)
    c, s = X / r, Y / r
    # theta moves by (Z dr - r dZ) / (r^2 + Z^2), the direction (c, s) by its normal.
    square = r * r + Z * Z
    along, back = slope * Z / square, -slope * r / square
    over = radius / r
    by_point = (
        (c * c * along + s * s * over, c * s * (along - over), c * back),
        (c * s * (along - over), s * s * along + c * c * over, s * back),
    )
    return (c * radius, s * radius), by_point, [(c * p, s * p) for p in by_k]


def division(ctx, coefficients, point):
    """(x, y) = (x_d, y_d) / (1 + k1 r_d^2) (Fitzgibbon 2001), solved for the root that is the pinhole's where k1 = 0.

    With r = r_d g, and Z = g (1 + k1 g^2 (X^2 + Y^2)) ... the quadratic of g: k1 (X^2 + Y^2) g^2 - Z g + 1 = 0.
    """
    (k1,) = coefficients
    X, Y, Z = point
    square = X * X + Y * Y
    under = Z * Z - 4 * k1 * square
    if not under > 0:
        return None
    root = ctx.sqrt(under)
    if not Z + root > 0:
        return None
    g = 2 / (Z + root)
    # Differentiated where it stands: (2 k1 square g - Z) dg = g dZ - g^2 d(k1 square), and 2 k1 square g - Z = -root.
    by_x, by_y, by_z = 2 * k1 * X * g * g / root, 2 * k1 * Y * g * g / root, -g / root
    by_k = square * g * g / root
    return (
        (X * g, Y * g),
        ((g + X * by_x, X * by_y, X * by_z), (Y * by_x, g + Y * by_y, Y * by_z)),
        [(X * by_k, Y * by_k)],
    )


def double_sphere(ctx, coefficients, point):
    """Two spheres and a pinhole (Usenko, Demmel & Cremers 2018, equations 40 to 42)."""
    xi, alpha = coefficients
    X, Y, Z = point
    square = X * X + Y * Y
    first = ctx.sqrt(square + Z * Z)
    shifted = xi * first + Z
    second = ctx.sqrt(square + shifted * shifted)
    below = alpha * second + (1 - alpha) * shifted
    if not below > 0:
        return None
    image = (X / below, Y / below)
    by_shifted = alpha * shifted / second + 1 - alpha
    # Of `below`: by X, Y and Z through both distances, and by the coefficients.
    slopes = [alpha * c / second + by_shifted * xi * c / first for c in (X, Y)]
    slopes.append(by_shifted * (xi * Z / first + 1))
    by_xi, by_alpha = by_shifted * first, second - shifted
    by_point = tuple(
        tuple(((1 if i == j else 0) - image[i] * slope) / below for j, slope in enumerate(slopes)) for i in (0, 1)
    )
    return image, by_point, [tuple(-a * slope / below for a in image) for slope in (by_xi, by_alpha)]


MODELS = {
    "brown-conrady": before(brown_conrady),
    "rational": before(rational),
    "thin-prism": before(thin_prism),
    "tilted": before(tilted),
    "kannala-brandt": kannala_brandt,
    "division": division,
    "double-sphere": double_sphere,
    "halcon-polynomial": before(halcon_polynomial),
}

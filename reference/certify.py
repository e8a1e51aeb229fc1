"""What is the least-squares camera of each reference problem, to twenty digits?

    pip install mpmath gmpy2          (gmpy2 is optional: several times faster)
    python3 certify.py [NAME ...]     certifies problems and writes the values into their files
    python3 certify.py --check [NAME] certifies from scratch and compares every digit with the file
    python3 certify.py --steps [NAME] takes Gauss-Newton steps from the file's values and compares every digit: a second or ten each
    ... --starts N                    so many starts drawn from far away, 12 unless said otherwise
    python3 certify.py --sums         writes SHA256SUMS

Nothing is shared with calibench: another language, other rotations (turned on the right, `R exp(w)`), own derivatives, numbers of 40
and of 60 digits. `README.md` says what is certified, and how.
"""

import hashlib
import json
import math
import operator
import pathlib
import random
import sys

import mpmath

from certify_lenses import COEFFICIENTS, MODELS

HERE = pathlib.Path(__file__).resolve().parent
LINEAR = ["fx", "fy", "cx", "cy", "skew"]
FX, FY, CX, CY, SKEW = range(5)
FISHEYES = ("kannala-brandt", "double-sphere")
DIGITS = (40, 60)
CERTIFIED_DIGITS = 20
STARTS = 12
# Steps of a search in double precision. Coefficients that make up for each other have long valleys.
SEARCH, LONG_SEARCH = 300, 2000


# --- numbers: the same code runs in double precision (mpmath.fp) and in any other (mpmath.mp) -----------------------------------


def dot(ctx, a, b):
    return sum(map(operator.mul, a, b)) if ctx is mpmath.fp else ctx.fdot(a, b)


def product(ctx, a, b):
    return [[dot(ctx, row, [b[k][j] for k in range(3)]) for j in range(3)] for row in a]


def exponential(ctx, w):
    """exp of the cross-product matrix of w (Rodrigues)."""
    square = dot(ctx, w, w)
    if square == 0:
        return [[ctx.mpf(i == j) for j in range(3)] for i in range(3)]
    angle = ctx.sqrt(square)
    half = ctx.sin(angle / 2) / angle
    a, b = ctx.sin(angle) / angle, 2 * half * half
    x, y, z = w
    cross = [[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]]
    second = product(ctx, cross, cross)
    return [[ctx.mpf(i == j) + a * cross[i][j] + b * second[i][j] for j in range(3)] for i in range(3)]


def orthonormal(ctx, r):
    """Gram and Schmidt, so that rounding of a coarser number does not stay in a rotation."""
    a, b = ([r[i][j] for i in range(3)] for j in (0, 1))
    norm = ctx.sqrt(dot(ctx, a, a))
    a = [x / norm for x in a]
    along = dot(ctx, a, b)
    b = [y - along * x for x, y in zip(a, b)]
    norm = ctx.sqrt(dot(ctx, b, b))
    b = [y / norm for y in b]
    c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return [[a[i], b[i], c[i]] for i in range(3)]


def cholesky(ctx, matrix):
    """Lower factor, or None where the matrix is not positive definite."""
    n = len(matrix)
    lower = [[ctx.mpf(0)] * n for _ in range(n)]
    for j in range(n):
        pivot = matrix[j][j] - dot(ctx, lower[j][:j], lower[j][:j])
        if not pivot > 0:
            return None
        lower[j][j] = ctx.sqrt(pivot)
        for i in range(j + 1, n):
            lower[i][j] = (matrix[i][j] - dot(ctx, lower[i][:j], lower[j][:j])) / lower[j][j]
    return lower


def forward(ctx, lower, b):
    x = []
    for i, row in enumerate(lower):
        x.append((b[i] - dot(ctx, row[:i], x)) / row[i])
    return x


def backward(ctx, lower, b):
    n = len(lower)
    x = [None] * n
    for i in reversed(range(n)):
        x[i] = (b[i] - dot(ctx, [lower[k][i] for k in range(i + 1, n)], x[i + 1 :])) / lower[i][i]
    return x


# --- the problem ----------------------------------------------------------------------------------------------------------------


class Problem:
    """A file's observations in one kind of number. Target points are moved so that their centre is the origin: poses follow."""

    def __init__(self, ctx, data):
        def number(text):
            # Exact in double precision: any program reads the same data.
            if mpmath.mpf(text) != float(text):
                raise ValueError(f"{text} is no double")
            return ctx.mpf(text)

        self.ctx, self.data = ctx, data
        self.model = data.get("model", "brown-conrady")
        self.lens = MODELS[self.model]
        self.names = LINEAR + COEFFICIENTS[self.model]
        self.free = [self.names.index(name) for name in data["free"]]
        self.held = {self.names.index(name): number(value) for name, value in data["held"].items()}
        points = [p for view in data["views"] for p in view["target"]]
        self.centre = [sum(number(p[i]) for p in points) / len(points) for i in (0, 1)]
        self.views = [
            (
                [[number(c) - m for c, m in zip(p, self.centre)] for p in view["target"]],
                [[number(c) for c in p] for p in view["pixels"]],
            )
            for view in data["views"]
        ]
        self.points = len(points)
        self.freedom = 2 * self.points - len(self.free) - 6 * len(self.views)

    def start(self, kind):
        """A start of the file: camera and poses."""
        ctx, given = self.ctx, self.data["starts"][kind]
        values = {self.names.index(name): ctx.mpf(value) for name, value in given["parameters"].items()}
        camera = [self.held.get(i, values.get(i)) for i in range(len(self.names))]
        poses = []
        for pose in given["poses"]:
            r = exponential(ctx, [ctx.mpf(w) for w in pose["rotation_vector"]])
            t = [ctx.mpf(x) + r[i][0] * self.centre[0] + r[i][1] * self.centre[1] for i, x in enumerate(pose["translation"])]
            poses.append((r, t))
        return camera, poses

    def translation(self, pose):
        """Of a pose in the file's own target frame."""
        r, t = pose
        return [t[i] - r[i][0] * self.centre[0] - r[i][1] * self.centre[1] for i in range(3)]


def rows(ctx, lens, camera, pose, view, free, with_jacobian=True):
    """Residuals of a view (u and v in turn), and the columns of its Jacobian: free intrinsics, rotation, translation.

    None where the lens has no image of a point.
    """
    fx, fy, cx, cy, skew = camera[:5]
    coefficients = camera[5:]
    r, t = pose
    one, zero = ctx.mpf(1), ctx.mpf(0)
    residuals = []
    columns = [[] for _ in range(len(free) + 6)]
    for (X, Y), (u, v) in zip(*view):
        seen = lens(ctx, coefficients, [r[i][0] * X + r[i][1] * Y + t[i] for i in range(3)])
        if seen is None:
            return None
        (xd, yd), (xd_q, yd_q), by_lens = seen
        residuals += [fx * xd + skew * yd + cx - u, fy * yd + cy - v]
        if not with_jacobian:
            continue
        for column, index in zip(columns, free):
            if index >= len(LINEAR):
                a, b = by_lens[index - len(LINEAR)]
                column += [fx * a + skew * b, fy * b]
            else:
                column += {FX: [xd, zero], FY: [zero, yd], CX: [one, zero], CY: [zero, one], SKEW: [yd, zero]}[index]
        # Pixels by the point in the camera's frame.
        u_q = [fx * a + skew * b for a, b in zip(xd_q, yd_q)]
        v_q = [fy * b for b in yd_q]
        # R exp(w) P: dq = R (w x P), with P = (X, Y, 0).
        turned = [
            [Y * r[i][2] for i in range(3)],
            [-X * r[i][2] for i in range(3)],
            [X * r[i][1] - Y * r[i][0] for i in range(3)],
        ]
        at = len(free)
        for k in range(3):
            d = turned[k]
            columns[at + k] += [
                u_q[0] * d[0] + u_q[1] * d[1] + u_q[2] * d[2],
                v_q[0] * d[0] + v_q[1] * d[1] + v_q[2] * d[2],
            ]
            columns[at + 3 + k] += [u_q[k], v_q[k]]
    return residuals, columns


def cost(problem, state):
    """Sum of squared residuals, view by view."""
    camera, poses = state
    parts = []
    for view, pose in zip(problem.views, poses):
        seen = rows(problem.ctx, problem.lens, camera, pose, view, problem.free, False)
        if seen is None:
            return None
        parts.append(dot(problem.ctx, seen[0], seen[0]))
    return parts


class Normal:
    """Normal equations of all views: A (intrinsics), B and C (a view's coupling and pose), gradients, cost."""

    def __init__(self, problem, state):
        ctx, n = problem.ctx, len(problem.free)
        camera, poses = state
        self.ctx, self.n = ctx, n
        self.a = [[ctx.mpf(0)] * n for _ in range(n)]
        self.gradient = [ctx.mpf(0)] * n
        self.views, self.cost = [], ctx.mpf(0)
        for view, pose in zip(problem.views, poses):
            seen = rows(ctx, problem.lens, camera, pose, view, problem.free)
            if seen is None:
                self.cost = ctx.inf
                return
            residuals, columns = seen
            square = [[dot(ctx, columns[i], columns[j]) if j <= i else None for j in range(n + 6)] for i in range(n + 6)]
            right = [dot(ctx, column, residuals) for column in columns]
            for i in range(n):
                self.gradient[i] += right[i]
                for j in range(i + 1):
                    self.a[i][j] += square[i][j]
                    self.a[j][i] = self.a[i][j]
            b = [[square[n + k][i] for k in range(6)] for i in range(n)]
            c = [[square[n + max(k, l)][n + min(k, l)] for l in range(6)] for k in range(6)]
            self.views.append((b, c, right[n:]))
            self.cost += dot(ctx, residuals, residuals)

    def solve(self, damping=0):
        """The step of (H + damping diag H) d = -g by eliminating the poses, or None; and the Schur complement."""
        ctx, n = self.ctx, self.n
        more = 1 + ctx.mpf(damping)
        schur = [[x * more if i == j else x for j, x in enumerate(row)] for i, row in enumerate(self.a)]
        right = [-g for g in self.gradient]
        eliminated = []
        for b, c, gradient in self.views:
            damped = [[x * more if i == j else x for j, x in enumerate(row)] for i, row in enumerate(c)]
            lower = cholesky(ctx, damped)
            if lower is None:
                return None
            w = [forward(ctx, lower, row) for row in b]
            z = forward(ctx, lower, [-g for g in gradient])
            for i in range(n):
                right[i] -= dot(ctx, w[i], z)
                for j in range(i + 1):
                    schur[i][j] -= dot(ctx, w[i], w[j])
                    schur[j][i] = schur[i][j]
            eliminated.append((lower, w, z))
        lower = cholesky(ctx, schur)
        if lower is None:
            return None
        step = backward(ctx, lower, forward(ctx, lower, right))
        poses = []
        for factor, w, z in eliminated:
            poses.append(backward(ctx, factor, [z[k] - dot(ctx, [w[i][k] for i in range(n)], step) for k in range(6)]))
        return step, poses, schur

    def largest_cosine(self):
        """The gradient without units: the largest cosine between the residuals and a column of the Jacobian."""
        ctx = self.ctx
        pairs = [(g, self.a[i][i]) for i, g in enumerate(self.gradient)]
        for _, c, gradient in self.views:
            pairs += [(g, c[k][k]) for k, g in enumerate(gradient)]
        return max(abs(g) / ctx.sqrt(h * self.cost) for g, h in pairs)


def moved(problem, state, step, poses):
    """The state after a step."""
    ctx = problem.ctx
    camera = list(state[0])
    for index, d in zip(problem.free, step):
        camera[index] += d
    return camera, [
        (product(ctx, r, exponential(ctx, d[:3])), [a + b for a, b in zip(t, d[3:])]) for (r, t), d in zip(state[1], poses)
    ]


# --- minima ---------------------------------------------------------------------------------------------------------------------


def levenberg_marquardt(problem, state):
    """A minimum, or where the search ended: state, cost, whether it converged."""
    iterations = SEARCH if problem.model == "brown-conrady" else LONG_SEARCH
    normal, damping = Normal(problem, state), 1e-3
    for _ in range(iterations):
        if not normal.cost < problem.ctx.inf:
            return state, normal.cost, False
        solved = normal.solve(damping) if damping < 1e12 else None
        if solved is None:
            damping *= 10
            if damping >= 1e12:
                return state, normal.cost, False
            continue
        trial = moved(problem, state, *solved[:2])
        parts = cost(problem, trial) if trial[0][FX] > 0 and trial[0][FY] > 0 else None
        if parts is None or not sum(parts) < normal.cost:
            # No lower cost to be had at rounding level: this is the bottom.
            if damping >= 1e6 or (damping <= 1e-6 and normal.largest_cosine() < 1e-9):
                return state, normal.cost, normal.largest_cosine() < 1e-6
            damping *= 10
            continue
        gain = 1 - sum(parts) / normal.cost
        state, normal, damping = trial, Normal(problem, trial), max(damping / 10, 1e-12)
        if gain < 1e-13 and damping < 1e-4:
            return state, normal.cost, True
    return state, normal.cost, False


def in_context(problem, state):
    """A state of coarser numbers in the problem's own; held values are the file's."""
    ctx = problem.ctx
    camera = [problem.held.get(i, ctx.mpf(x)) for i, x in enumerate(state[0])]
    return camera, [(orthonormal(ctx, [[ctx.mpf(x) for x in row] for row in r]), [ctx.mpf(x) for x in t]) for r, t in state[1]]


def size_of(problem, state, step, poses):
    """Largest change: of a parameter or a distance relative to its value, of a rotation in rad."""
    ctx = problem.ctx
    sizes = [abs(d / state[0][index]) for index, d in zip(problem.free, step)]
    for (_, t), d in zip(state[1], poses):
        distance = ctx.sqrt(dot(ctx, t, t))
        sizes += [abs(w) for w in d[:3]] + [abs(x) / distance for x in d[3:]]
    return max(sizes)


def gauss_newton(problem, state, below):
    """Undamped steps until one is smaller than `below`; then it has contracted, so the Hessian is positive: a minimum."""
    sizes = []
    for _ in range(400):
        normal = Normal(problem, state)
        step, poses, schur = normal.solve()
        sizes.append(size_of(problem, state, step, poses))
        state = moved(problem, state, step, poses)
        if sizes[-1] < below:
            return state, Normal(problem, state), sizes
    raise ArithmeticError(f"no convergence: {[mpmath.nstr(s, 3) for s in sizes[-3:]]}")


# --- starts from far away -------------------------------------------------------------------------------------------------------


def pose_alone(problem, camera, view, pose, iterations=12):
    """A few damped steps of one pose with the camera held: pose and cost."""
    ctx, damping = problem.ctx, 1e-3
    seen = rows(ctx, problem.lens, camera, pose, view, [])
    best = dot(ctx, seen[0], seen[0]) if seen else ctx.inf
    for _ in range(iterations):
        if seen is None:
            break
        residuals, columns = seen
        square = [[dot(ctx, a, b) for b in columns] for a in columns]
        for k in range(6):
            square[k][k] *= 1 + damping
        lower = cholesky(ctx, square)
        if lower is None:
            break
        d = backward(ctx, lower, forward(ctx, lower, [-dot(ctx, a, residuals) for a in columns]))
        trial = (product(ctx, pose[0], exponential(ctx, d[:3])), [a + b for a, b in zip(pose[1], d[3:])])
        after = rows(ctx, problem.lens, camera, trial, view, [])
        value = dot(ctx, after[0], after[0]) if after else ctx.inf
        if value < best:
            pose, seen, best, damping = trial, after, value, damping / 10
        else:
            damping *= 10
    return pose, best


def random_start(problem, stream):
    """A camera drawn over all that people have, and for each view the best of five poses: facing, and tilted four ways."""
    ctx = problem.ctx
    width, height = problem.data["image_size"]
    is_fisheye = problem.model in FISHEYES
    shortest, longest = (0.15, 1) if is_fisheye else (0.4, 6)
    focal = width * math.exp(stream.uniform(math.log(shortest), math.log(longest)))
    drawn = dict.fromkeys(problem.names, 0.0)
    drawn["fx"], drawn["fy"] = focal, focal * stream.uniform(0.8, 1.25)
    drawn["cx"], drawn["cy"] = (side * (0.5 + stream.uniform(-0.2, 0.2)) for side in (width, height))
    if problem.model == "double-sphere":
        drawn["xi"], drawn["alpha"] = stream.uniform(-0.3, 0.3), stream.uniform(0.3, 0.7)
    else:
        drawn["k1"] = stream.uniform(-0.2, 0.2)
    camera = [problem.held.get(i, drawn[name]) for i, name in enumerate(problem.names)]
    far, facing = problem.start("far")
    factor = camera[FX] / far[FX]
    poses = []
    for view, (r, t) in zip(problem.views, facing):
        if is_fisheye:
            r, t = swung(ctx, r, t, factor)
        else:
            t = [t[0], t[1], t[2] * factor]
        candidates = []
        for tilt in [(0, 0), (0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5)]:
            turn = exponential(ctx, [tilt[0], tilt[1], stream.uniform(-0.2, 0.2)])
            start = (product(ctx, r, turn), t)
            candidates.append(pose_alone(problem, camera, view, start))
        poses.append(min(candidates, key=lambda c: c[1])[0])
    return camera, poses


def swung(ctx, r, t, factor):
    """A pose of an equidistant fisheye for another whose focal length is `factor` times as long: so much farther, and nearer the axis."""
    aside = ctx.sqrt(t[0] * t[0] + t[1] * t[1])
    angle = ctx.atan2(aside, t[2])
    if aside == 0:
        return r, [factor * x for x in t]
    swing = (min(angle / factor, ctx.pi * 0.6) - angle) / aside
    turn = exponential(ctx, [-t[1] * swing, t[0] * swing, 0 * swing])
    return product(ctx, turn, r), [factor * dot(ctx, row, t) for row in turn]


# --- certification --------------------------------------------------------------------------------------------------------------


def digits(x, count=CERTIFIED_DIGITS):
    return mpmath.nstr(x, count, strip_zeros=False, min_fixed=-6, max_fixed=9)


def log_relative_error(a, b):
    return min(-mpmath.log10(abs(x / y - 1)) if x != y else mpmath.inf for x, y in zip(a, b))


def parameters(problem, state):
    return [state[0][index] for index in problem.free]


def certify(data, starts):
    """The object `certified` of a problem's file, after so many starts from far away."""
    fp = Problem(mpmath.fp, data)
    far = levenberg_marquardt(fp, fp.start("far"))
    near = levenberg_marquardt(fp, fp.start("near"))
    stream = random.Random("certify " + data["id"])
    drawn = [levenberg_marquardt(fp, random_start(fp, stream)) for _ in range(starts)]

    ends = [end for end in [near, far] + drawn if end[2]]
    best = min(ends, key=lambda end: end[1])
    ctx = mpmath.mp
    # From the near start with 60 digits, from the best of the others with 40.
    others = [end for end in [far] + drawn if end[2]]
    found = []
    for precision, end in zip(DIGITS, [min(others, key=lambda end: end[1]), near]):
        ctx.dps = precision
        problem = Problem(ctx, data)
        found.append((problem, *gauss_newton(problem, in_context(problem, end[0]), ctx.mpf(10) ** (8 - precision))))
    (_, coarse, _, _), (problem, state, normal, sizes) = found
    agree = log_relative_error(parameters(problem, coarse), parameters(problem, state))
    if agree < 30:
        raise ArithmeticError(f"the minima found from both sides agree to {mpmath.nstr(agree, 4)} digits only")

    least = normal.cost
    if best[1] < float(least) * (1 - 1e-9):
        raise ArithmeticError(f"a start ended lower: {best[1]} < {mpmath.nstr(least, 17)}")
    same = lambda end: end[2] and end[1] < float(least) * (1 + 1e-7)
    higher = [end[1] / float(least) for end in drawn if end[2] and not same(end)]

    if cost_by_differences(problem, state, normal) > ctx.mpf(10) ** -30 or normal.largest_cosine() > ctx.mpf(10) ** -30:
        raise ArithmeticError("the gradient is not zero")

    derivatives = jacobian_by_differences(problem, state)
    if derivatives > ctx.mpf(10) ** -25:
        raise ArithmeticError(f"the derivatives are not those of the equations: {mpmath.nstr(derivatives, 3)}")

    chance = (least / ctx.mpf(data["noise_px"]) ** 2 - problem.freedom) / ctx.sqrt(2 * problem.freedom)
    return values(problem, state, normal) | {
        "evidence": {
            "agreement_of_40_and_60_digits": mpmath.nstr(agree, 3),
            "last_relative_step": mpmath.nstr(sizes[-1], 2),
            "gradient": mpmath.nstr(normal.largest_cosine(), 2),
            "gradient_by_differences": mpmath.nstr(cost_by_differences(problem, state, normal), 2),
            # Certificates of version 1 do not state it.
            **({} if data["version"] == "1" else {"derivatives_by_differences": mpmath.nstr(derivatives, 2)}),
            "standard_deviations_of_cost_from_its_expectation": mpmath.nstr(chance, 3),
            "near_start_ends_here": same(near),
            "far_start_ends_here": same(far),
            "drawn_starts": len(drawn),
            "drawn_starts_that_end_here": sum(map(same, drawn)),
            "drawn_starts_that_end_higher": len(higher),
            "drawn_starts_without_convergence": sum(not end[2] for end in drawn),
            "next_higher_cost": f"{min(higher):.6g}" if higher else None,
        },
    }


def values(problem, state, normal):
    """What is certified of a minimum."""
    ctx, least = problem.ctx, normal.cost
    schur = normal.solve()[2]
    variance = least / problem.freedom
    lower = cholesky(ctx, schur)
    unit = lambda i: [ctx.mpf(i == j) for j in range(len(schur))]
    deviations = [ctx.sqrt(variance * sum(x * x for x in forward(ctx, lower, unit(i)))) for i in range(len(schur))]
    return {
        "version": int(problem.data["version"]),
        "parameters": dict(zip(problem.data["free"], map(digits, parameters(problem, state)))),
        "standard_deviations": dict(zip(problem.data["free"], map(digits, deviations))),
        "rmse": digits(ctx.sqrt(least / problem.points)),
        "sigma": digits(ctx.sqrt(variance)),
        "sum_of_squares": digits(least),
        "degrees_of_freedom": problem.freedom,
        "poses": [
            {
                "rotation": [[digits(x) for x in row] for row in pose[0]],
                "translation": [digits(x) for x in problem.translation(pose)],
            }
            for pose in state[1]
        ],
    }


def after_steps(data):
    """What is certified after Gauss-Newton steps in 60 digits from the file's values: the same, where they are those of a minimum."""
    ctx = mpmath.mp
    ctx.dps = DIGITS[1]
    problem = Problem(ctx, data)
    stated = {problem.names.index(name): ctx.mpf(value) for name, value in data["certified"]["parameters"].items()}
    camera = [problem.held.get(i, stated.get(i)) for i in range(len(problem.names))]
    poses = []
    for pose in data["certified"]["poses"]:
        r = orthonormal(ctx, [[ctx.mpf(x) for x in row] for row in pose["rotation"]])
        t = [ctx.mpf(x) + r[i][0] * problem.centre[0] + r[i][1] * problem.centre[1] for i, x in enumerate(pose["translation"])]
        poses.append((r, t))
    # From 20 digits; a step more than it takes to have 30.
    state, normal, _ = gauss_newton(problem, (camera, poses), ctx.mpf(10) ** -28)
    return values(problem, state, normal)


def cost_by_differences(problem, state, normal):
    """The gradient once more, from the cost alone by central differences: as a cosine, like `largest_cosine`."""
    ctx = problem.ctx
    base = ctx.mpf(10) ** -18
    total, n = normal.cost, len(problem.free)
    zero_poses = [[ctx.mpf(0)] * 6 for _ in state[1]]
    largest = ctx.mpf(0)

    def slope(diagonal, change):
        h = base * ctx.sqrt(total / diagonal)
        up, down = (sum(cost(problem, moved(problem, state, *change(sign * h)))) for sign in (1, -1))
        return abs(up - down) / (4 * h) / ctx.sqrt(diagonal * total)

    for i in range(n):
        change = lambda h: ([h if j == i else ctx.mpf(0) for j in range(n)], zero_poses)
        largest = max(largest, slope(normal.a[i][i], change))
    for v in range(len(state[1])):
        for k in range(6):
            one = lambda h: [[h if (w, m) == (v, k) else ctx.mpf(0) for m in range(6)] for w in range(len(state[1]))]
            largest = max(largest, slope(normal.views[v][1][k][k], lambda h: ([ctx.mpf(0)] * n, one(h))))
    return largest


def jacobian_by_differences(problem, state):
    """The Jacobian once more, from the residuals by central differences: the largest relative difference of a column of a view.

    It shows what the gradient cannot: the standard deviations hang on the derivatives themselves.
    """
    ctx, n = problem.ctx, len(problem.free)
    largest = ctx.mpf(0)
    norm = lambda column: ctx.sqrt(dot(ctx, column, column))
    for view, pose in zip(problem.views, state[1]):
        columns = rows(ctx, problem.lens, state[0], pose, view, problem.free)[1]
        for i, column in enumerate(columns):
            # By a ten-quintillionth of a pixel or so.
            h = ctx.mpf(10) ** -19 / norm(column)

            def seen(step):
                change = [step if k == i else ctx.mpf(0) for k in range(n + 6)]
                camera, poses = moved(problem, (state[0], [pose]), change[:n], [change[n:]])
                return rows(ctx, problem.lens, camera, poses[0], view, problem.free, False)[0]

            slope = [(up - down) / (2 * h) for up, down in zip(seen(h), seen(-h))]
            largest = max(largest, norm([a - b for a, b in zip(column, slope)]) / norm(column))
    return largest


# --- files ----------------------------------------------------------------------------------------------------------------------


def text_of(certified):
    """JSON; numbers of twenty digits stand as they are, for programs that can read them."""

    def value_of(value):
        if isinstance(value, dict):
            return "{" + ", ".join(f"{json.dumps(k)}: {value_of(v)}" for k, v in value.items()) + "}"
        if isinstance(value, list):
            return "[" + ", ".join(map(value_of, value)) + "]"
        if isinstance(value, str):
            return value
        return json.dumps(value)

    lines = []
    for key, value in certified.items():
        if key in ("parameters", "standard_deviations", "evidence"):
            inner = ",\n   ".join(f"{json.dumps(k)}: {value_of(v)}" for k, v in value.items())
            lines.append(f"{json.dumps(key)}: {{\n   {inner}\n  }}")
        elif key == "poses":
            lines.append('"poses": [\n   ' + ",\n   ".join(map(value_of, value)) + "\n  ]")
        else:
            lines.append(f"{json.dumps(key)}: {value_of(value)}")
    return "{\n  " + ",\n  ".join(lines) + "\n }"


MARK = ',\n "certified": '
EVIDENCE = '"evidence": '


def write(path, text):
    """To a temporary file, which is then renamed: an interruption leaves no half of a file."""
    part = path.with_suffix(".part")
    part.write_text(text)
    part.replace(path)


def main(arguments):
    arguments, starts = list(arguments), STARTS
    if "--starts" in arguments:
        at = arguments.index("--starts")
        starts = int(arguments[at + 1])
        del arguments[at : at + 2]
    names = [a for a in arguments if not a.startswith("-")]
    by_steps = "--steps" in arguments
    if "--sums" in arguments:
        files = sorted(p for p in HERE.iterdir() if p.suffix in (".json", ".py", ".md"))
        sums = [f"{hashlib.sha256(p.read_bytes()).hexdigest()}  {p.name}\n" for p in files]
        write(HERE / "SHA256SUMS", "".join(sums))
        return 0
    paths = [HERE / f"{name}.json" for name in names] or sorted(HERE.glob("*.json"))
    different = 0
    for path in paths:
        before = path.read_text()
        # Numbers are kept as their text: a decimal is what it says, not the double next to it.
        data = json.loads(before, parse_float=str, parse_int=lambda text: text)
        data["image_size"] = [int(side) for side in data["image_size"]]
        if by_steps:
            here = text_of(after_steps(data)).removesuffix("\n }")
            same = before.partition(MARK)[2].startswith(here + ",\n")
            different += not same
            print(f"{path.stem}: {'steps stay at every digit' if same else 'STEPS LEAD ELSEWHERE'}", flush=True)
            continue
        head = before.partition(MARK)[0].removesuffix("\n}\n")
        text = f"{head}{MARK}{text_of(certify(data, starts))}\n}}\n"
        if "--check" in arguments:
            # The evidence counts searches in double precision, which may end elsewhere on another machine.
            same = text.partition(EVIDENCE)[0] == before.partition(EVIDENCE)[0] and EVIDENCE in before
            different += not same
            print(f"{path.stem}: {'every digit as in the file' if same else 'DIFFERS'}", flush=True)
        else:
            write(path, text)
            print(f"{path.stem}: certified", flush=True)
    return int(different > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Which observations do the reference problems hold? Draws them; `certify.py` then adds the certified values.

    python3 make.py                 writes every problem that has changed, without certified values
    python3 make.py --check [NAME]  compares the files with what would be written

Standard library only. The random numbers are those of `random.Random(seed).random()`, which Python promises to keep, turned into
normal ones by Box and Muller. Pixels are rounded to 1/256 px, so that the last bits of sines and logarithms do not matter; such a
number has eight decimals at most and is exact in binary too: a program in double precision reads what was certified, not something
next to it. Nothing here is imported by `certify.py`.
"""

import json
import math
import pathlib
import random
import sys

VERSION = 1
HERE = pathlib.Path(__file__).resolve().parent
NAMES = ["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"]
LINEAR = ["fx", "fy", "cx", "cy"]
# Pixels are multiples of 1/256 px.
PARTS_OF_PIXEL, DECIMALS = 256, 8


# --- the virtual camera -----------------------------------------------------------------------------------------------------


def project(camera, rotation, translation, point):
    """The pixel of a target point, or None behind the camera. The equations are those of adapters/PROTOCOL.md."""
    q = [rotation[i][0] * point[0] + rotation[i][1] * point[1] + translation[i] for i in range(3)]
    if q[2] <= 0:
        return None
    x, y = q[0] / q[2], q[1] / q[2]
    s = x * x + y * y
    g = 1 + camera["k1"] * s + camera["k2"] * s**2 + camera["k3"] * s**3
    xd = x * g + 2 * camera["p1"] * x * y + camera["p2"] * (s + 2 * x * x)
    yd = y * g + camera["p1"] * (s + 2 * y * y) + 2 * camera["p2"] * x * y
    return (
        camera["fx"] * xd + camera["skew"] * yd + camera["cx"],
        camera["fy"] * yd + camera["cy"],
    )


def rotation_xyz(degrees):
    """Rz Ry Rx."""
    (a, b, c) = [math.radians(d) for d in degrees]
    ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
    return [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]


def rotation_vector(r):
    """Axis times angle, for angles below pi."""
    angle = math.acos(max(-1.0, min(1.0, (r[0][0] + r[1][1] + r[2][2] - 1) / 2)))
    factor = 0.5 if angle < 1e-9 else angle / (2 * math.sin(angle))
    return [factor * (r[2][1] - r[1][2]), factor * (r[0][2] - r[2][0]), factor * (r[1][0] - r[0][1])]


class Normal:
    """Standard normal numbers (Box and Muller 1958)."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def uniform(self, low, high):
        return low + (high - low) * self.random.random()

    def draw(self):
        radius = math.sqrt(-2 * math.log(1 - self.random.random()))
        return radius * math.cos(2 * math.pi * self.random.random())


# --- targets and poses ------------------------------------------------------------------------------------------------------


def grid(columns, rows, spacing, origin=(0.0, 0.0)):
    """A grid centred at `origin`."""
    return [
        (round(origin[0] + (i - (columns - 1) / 2) * spacing, 6), round(origin[1] + (j - (rows - 1) / 2) * spacing, 6))
        for j in range(rows)
        for i in range(columns)
    ]


def squares(count, side, pitch):
    """Corners of count x count squares: the layout of Zhang's target (2000), 256 points for 8 x 8; sizes are ours."""
    start = -(count - 1) / 2 * pitch - side / 2
    return [
        (round(start + i * pitch + dx, 6), round(-(start + j * pitch + dy), 6))
        for j in range(count)
        for i in range(count)
        for dx, dy in [(0, 0), (side, 0), (side, side), (0, side)]
    ]


def centre(points):
    """Middle of the bounding box."""
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    return ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2)


def pose(degrees, position, points):
    """The target turned by Rz Ry Rx, the middle of its points at `position` in the camera's frame."""
    r, c = rotation_xyz(degrees), centre(points)
    return r, [position[i] - r[i][0] * c[0] - r[i][1] * c[1] for i in range(3)]


def seen_whole(camera, image, view_pose, points):
    """Is every point at least five pixels inside the image?"""
    pixels = [project(camera, *view_pose, p) for p in points]
    return all(p and 5 <= p[0] <= image[0] - 6 and 5 <= p[1] <= image[1] - 6 for p in pixels)


def random_poses(normal, count, camera, image, points, *, tilt, coverage, roll=180.0, shift=0.35, axes=(1, 1)):
    """Poses that keep all points in the image: tilts up to `tilt` degrees, target as wide as `coverage` of the image's height."""
    size = max(max(p[0] for p in points) - min(p[0] for p in points), max(p[1] for p in points) - min(p[1] for p in points))
    poses = []
    while len(poses) < count:
        z = camera["fy"] * size / (normal.uniform(0.8, 1.1) * coverage * image[1])
        x = (normal.uniform(-shift, shift) * image[0] + image[0] / 2 - camera["cx"]) * z / camera["fx"]
        y = (normal.uniform(-shift, shift) * image[1] + image[1] / 2 - camera["cy"]) * z / camera["fy"]
        degrees = [axes[0] * normal.uniform(-tilt, tilt), axes[1] * normal.uniform(-tilt, tilt), normal.uniform(-roll, roll)]
        candidate = pose(degrees, (x, y, z), points)
        if seen_whole(camera, image, candidate, points):
            poses.append(candidate)
    return poses


# --- problems ---------------------------------------------------------------------------------------------------------------


def camera(fx, fy, cx, cy, **others):
    return dict(zip(NAMES, [fx, fy, cx, cy] + [0.0] * 6)) | others


CHAPTER = camera(600.0, 600.0, 326.0, 243.0, k1=-0.18, k2=0.05)
PROBLEMS = []


def problem(level, seed, about, *, image, noise, free, truth, held=None):
    """Registers a function that returns the views: a list of (points, pose), given a stream of numbers."""

    def register(function):
        name = function.__name__.replace("_", "-")
        PROBLEMS.append((name, level, seed, about, image, noise, free, truth, held or {}, function))
        return function

    return register


def fixed(points, places):
    return [(points, pose(degrees, position, points)) for degrees, position in places]


def drawn(normal, count, truth, image, points, **how):
    return [(points, p) for p in random_poses(normal, count, truth, image, points, **how)]


FOUR = [((0, 0, 0), (0, 0, 120)), ((20, 0, 0), (0, 0, 120)), ((0, -20, 0), (0, 0, 120)), ((-15, 15, 10), (0, 0, 120))]


@problem("lower", 1101, "four poses of a 9 x 7 grid, 10 mm: one facing, two tilted by 20 degrees, one compound",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def four_poses(normal):
    return fixed(grid(9, 7, 10.0), FOUR)


ORDINARY = camera(1180.0, 1176.0, 652.0, 471.0, k1=-0.12, k2=0.09, p1=0.0006, p2=-0.0004)


@problem("lower", 1102, "ten views of a 9 x 6 grid, tilted up to 40 degrees, the five-parameter lens without k3",
         image=(1280, 960), noise=0.15, free=LINEAR + ["k1", "k2", "p1", "p2"], truth=ORDINARY)
def ten_views(normal):
    return drawn(normal, 10, ORDINARY, (1280, 960), grid(9, 6, 25.0), tilt=40, coverage=0.7)


PINHOLE = camera(905.0, 911.0, 410.0, 290.0)


@problem("lower", 1103, "five views through a pinhole: no distortion in truth, none estimated",
         image=(800, 600), noise=0.2, free=LINEAR, truth=PINHOLE)
def pinhole(normal):
    return drawn(normal, 5, PINHOLE, (800, 600), grid(7, 5, 30.0), tilt=35, coverage=0.65)


# Round values near those of a lens of that time; points and poses are our own.
DESKTOP = camera(830.0, 832.0, 304.0, 207.0, skew=0.2, k1=-0.23, k2=0.19)


@problem("lower", 1104, "the layout of Zhang (2000): five views of 64 squares, 256 corners each, with skew; an own scene, not his data",
         image=(640, 480), noise=0.3, free=LINEAR + ["skew", "k1", "k2"], truth=DESKTOP)
def zhang_layout(normal):
    return fixed(squares(8, 0.5, 0.875), [
        ((10, -14, 2), (0.1, 0.5, 14.5)), ((-8, 22, -3), (-0.6, 0.4, 15.5)), ((24, 6, 5), (0.5, 0.6, 16.0)),
        ((-20, -12, 1), (-0.2, 0.3, 16.5)), ((2, 30, -8), (0.3, 0.5, 15.0))])


HELD = camera(600.0, 600.0, 326.0, 243.0, k1=-0.18, k2=0.0625)


@problem("lower", 1105, "principal point and k2 held at their true values; fx, fy, k1 estimated from three views",
         image=(640, 480), noise=0.1, free=["fx", "fy", "k1"], truth=HELD, held={"cx": 326.0, "cy": 243.0, "k2": 0.0625})
def held_centre(normal):
    return fixed(grid(9, 7, 10.0), FOUR[1:])


LARGE = camera(1510.0, 1513.0, 967.0, 588.0, k1=-0.21, k2=0.11, p1=-0.0003, p2=0.0007)


@problem("lower", 1106, "twenty views of 100 points: 2000 points",
         image=(1920, 1200), noise=0.1, free=LINEAR + ["k1", "k2", "p1", "p2"],
         truth=LARGE)
def points_2000(normal):
    return drawn(normal, 20, LARGE, (1920, 1200), grid(10, 10, 12.0), tilt=35, coverage=0.8)


WIDE = camera(395.0, 394.0, 392.0, 305.0, k1=-0.27, k2=0.075)


@problem("average", 1201, "wide angle, 90 degrees across, strong barrel distortion, eight views that reach the corners",
         image=(800, 600), noise=0.1, free=LINEAR + ["k1", "k2"], truth=WIDE)
def wide_angle(normal):
    return drawn(normal, 8, WIDE, (800, 600), grid(11, 8, 20.0), tilt=30, coverage=0.95)


TELE = camera(5200.0, 5190.0, 655.0, 470.0, k1=0.3)


@problem("average", 1202, "telephoto, 14 degrees across, twelve views tilted up to 45 degrees, one distortion coefficient",
         image=(1280, 960), noise=0.1, free=LINEAR + ["k1"], truth=TELE)
def tele(normal):
    return drawn(normal, 12, TELE, (1280, 960), grid(9, 6, 5.0), tilt=45, coverage=0.75)


TWO = camera(610.0, 605.0, 318.0, 236.0, k1=-0.1)


@problem("average", 1203, "two views determine four linear parameters exactly, and one distortion coefficient",
         image=(640, 480), noise=0.05, free=LINEAR + ["k1"], truth=TWO)
def two_views(normal):
    return fixed(grid(10, 7, 15.0), [((32, 8, 4), (3, -2, 180)), ((-9, -30, -12), (-4, 3, 175))])


THREE = camera(702.0, 690.0, 331.0, 229.0, skew=1.4)


@problem("average", 1204, "three views and all five linear parameters: as many constraints from the homographies as they need",
         image=(640, 480), noise=0.05, free=LINEAR + ["skew"], truth=THREE)
def three_views(normal):
    return fixed(grid(8, 8, 12.0), [((28, 10, 0), (2, 1, 170)), ((-25, 12, 35), (-3, 2, 180)), ((4, -33, -20), (1, -4, 190))])


DECENTRED = camera(880.0, 884.0, 500.0, 395.0, k1=-0.15, k2=0.06, p1=0.0051, p2=-0.0037)


@problem("average", 1205, "a decentred lens: tangential distortion of several pixels",
         image=(1024, 768), noise=0.1, free=LINEAR + ["k1", "k2", "p1", "p2"],
         truth=DECENTRED)
def tangential(normal):
    return drawn(normal, 6, DECENTRED, (1024, 768), grid(9, 7, 22.0), tilt=35, coverage=0.85)


SKEWED = camera(1040.0, 800.0, 350.0, 295.0, skew=6.0, k1=-0.2)


@problem("average", 1206, "pixels that are no rectangles: a skew of 6 px and a ratio of sides of 1.3",
         image=(720, 576), noise=0.1, free=LINEAR + ["skew", "k1"],
         truth=SKEWED)
def skewed_pixels(normal):
    return drawn(normal, 6, SKEWED, (720, 576), grid(8, 6, 15.0), tilt=35, coverage=0.7)


@problem("average", 1207, "views of 4 to 63 points each, as a detector leaves them",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def ragged_views(normal):
    points = grid(9, 7, 10.0)
    poses = random_poses(normal, 9, CHAPTER, (640, 480), points, tilt=35, coverage=0.8)
    kept = [63, 31, 9, 17, 4, 48, 12, 6, 23]
    views = []
    for count, view_pose in zip(kept, poses):
        order = sorted(range(63), key=lambda _: normal.random.random())
        chosen = sorted(order[:count]) if count > 6 else ([0, 8, 54, 62] if count == 4 else [0, 4, 8, 36, 54, 62])
        views.append(([points[i] for i in chosen], view_pose))
    return views


@problem("average", 1208, "target coordinates of a surveyor's grid: millimetres, the origin 300 m away",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def far_origin(normal):
    return drawn(normal, 6, CHAPTER, (640, 480), grid(9, 7, 10.0, (250000.0, -180000.0)), tilt=35, coverage=0.8)


FINE = camera(3080.0, 3085.0, 2010.0, 1480.0, k1=0.05, k2=-0.04)


@problem("average", 1209, "target in metres, seen through a tilt of up to 50 degrees by a camera of 12 megapixels",
         image=(4000, 3000), noise=0.2, free=LINEAR + ["k1", "k2"],
         truth=FINE)
def metres(normal):
    return drawn(normal, 7, FINE, (4000, 3000), grid(7, 5, 0.03125), tilt=50, coverage=0.7)


RADIAL = camera(480.0, 482.0, 322.0, 236.0, k1=-0.31, k2=0.13, k3=-0.03)


@problem("higher", 1301, "three radial coefficients: k1, k2 and k3 make up for each other",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1", "k2", "k3"], truth=RADIAL)
def three_radial(normal):
    return drawn(normal, 6, RADIAL, (640, 480), grid(9, 7, 10.0), tilt=35, coverage=0.9)


@problem("higher", 1302, "near-degenerate: tilts of two degrees and less; focal length and distance hardly separate",
         image=(640, 480), noise=0.03, free=LINEAR, truth=camera(600.0, 600.0, 326.0, 243.0))
def near_degenerate(normal):
    return fixed(grid(9, 7, 10.0), [
        ((2, 0, 0), (0, 0, 120)), ((0, -2, 0), (2, 1, 122)), ((-1.5, 1.5, 10), (-2, 1, 118)), ((1, 1.5, -20), (1, -2, 121))])


@problem("higher", 1303, "four views of nine points: 72 coordinates, 30 unknowns",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def nine_points(normal):
    return fixed(grid(3, 3, 35.0), [
        ((25, 3, 0), (2, 0, 110)), ((-4, -28, 20), (-3, 1, 115)), ((-22, 18, -35), (0, 2, 112)), ((12, -20, 60), (1, -1, 118))])


@problem("higher", 1304, "noise of two pixels: large residuals, a curved cost",
         image=(640, 480), noise=2.0, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def large_residuals(normal):
    return drawn(normal, 8, CHAPTER, (640, 480), grid(9, 7, 10.0), tilt=40, coverage=0.8)


TEN = camera(560.0, 552.0, 408.0, 289.0, skew=0.8, k1=-0.26, k2=0.11, p1=0.0012, p2=-0.0009, k3=-0.02)


@problem("higher", 1305, "all ten parameters free",
         image=(800, 600), noise=0.1, free=NAMES,
         truth=TEN)
def ten_parameters(normal):
    return drawn(normal, 9, TEN, (800, 600), grid(10, 7, 12.0), tilt=40, coverage=0.9)


BENT = camera(450.0, 450.0, 321.0, 244.0, k1=-0.32, k2=0.14, p1=0.004, p2=-0.003, k3=-0.03)


@problem("higher", 1306, "a wrong model: a lens of five coefficients, of which only k1 is estimated; residuals are systematic",
         image=(640, 480), noise=0.05, free=LINEAR + ["k1"], truth=BENT)
def wrong_model(normal):
    return drawn(normal, 6, BENT, (640, 480), grid(9, 7, 10.0), tilt=35, coverage=0.9)


@problem("higher", 1307, "every target tilted about one axis, the camera's X; the lens alone tells the rest",
         image=(640, 480), noise=0.02, free=LINEAR + ["k1", "k2"], truth=CHAPTER)
def one_axis(normal):
    return drawn(normal, 8, CHAPTER, (640, 480), grid(9, 7, 10.0), tilt=40, coverage=0.8, roll=0.0, axes=(1, 0))


# --- start values -----------------------------------------------------------------------------------------------------------


def digits(value, count):
    """Rounded to significant digits; never -0."""
    return float(f"{value:.{count}g}") + 0.0


def near_start(free, truth, views):
    """The truth: parameters to three digits, poses to nine."""
    return {
        "parameters": {name: digits(truth[name], 3) for name in free},
        "poses": [
            {"rotation_vector": [digits(w, 9) for w in rotation_vector(r)], "translation": [digits(x, 9) for x in t]}
            for _, (r, t) in views
        ],
    }


def far_start(image, free, held, observed):
    """What needs no calibration: a focal length of the image's width, the image's centre, no distortion, every target facing."""
    width, height = image
    guess = camera(float(width), float(width), (width - 1) / 2, (height - 1) / 2)
    values = {name: held.get(name, guess[name]) for name in NAMES}
    poses = []
    for points, pixels in observed:
        n = len(points)
        middle = [sum(p[i] for p in points) / n for i in (0, 1)]
        seen = [sum(p[i] for p in pixels) / n for i in (0, 1)]
        # Similarity pixel = scale rotation point, by complex numbers.
        a = [complex(p[0] - middle[0], p[1] - middle[1]) for p in points]
        b = [complex(p[0] - seen[0], p[1] - seen[1]) for p in pixels]
        ratio = sum(z.conjugate() * w for z, w in zip(a, b)) / sum(abs(z) ** 2 for z in a)
        z = values["fx"] / abs(ratio)
        roll = math.degrees(math.atan2(ratio.imag, ratio.real))
        r = rotation_xyz((0, 0, roll))
        position = [(seen[0] - values["cx"]) * z / values["fx"], (seen[1] - values["cy"]) * z / values["fy"], z]
        t = [position[i] - r[i][0] * middle[0] - r[i][1] * middle[1] for i in range(3)]
        # A far origin needs nine digits, or the target would not lie before the camera.
        vector = [digits(w, 9) for w in rotation_vector(r)]
        poses.append({"rotation_vector": vector, "translation": [digits(x, 9) for x in t]})
    return {"parameters": {name: values[name] for name in free}, "poses": poses}


def in_parts(pixel):
    return round(pixel * PARTS_OF_PIXEL) / PARTS_OF_PIXEL


# --- files ------------------------------------------------------------------------------------------------------------------


def made(entry):
    """The problem as it stands in its file, without certified values."""
    name, level, seed, about, image, noise, free, truth, held, function = entry
    normal = Normal(seed)
    views = function(normal)
    held = {n: held.get(n, 0.0) for n in NAMES if n not in free}
    observed = []
    for points, view_pose in views:
        exact = [project(truth, *view_pose, p) for p in points]
        pixels = [[in_parts(c + noise * normal.draw()) for c in pixel] for pixel in exact]
        observed.append((points, pixels))
    return {
        "id": name,
        "version": VERSION,
        "level": level,
        "about": about,
        "image_size": list(image),
        "free": free,
        "held": held,
        "noise_px": noise,
        "decimals": DECIMALS,
        "seed": seed,
        "starts": {"far": far_start(image, free, held, observed), "near": near_start(free, truth, views)},
        "views": [{"target": [list(p) for p in points], "pixels": pixels} for points, pixels in observed],
    }


def text_of(problem_object):
    """JSON with a line a field, a view's points on two lines."""
    lines = []
    for key, value in problem_object.items():
        if key == "views":
            views = [f'{{"target": {json.dumps(v["target"])},\n   "pixels": {json.dumps(v["pixels"])}}}' for v in value]
            lines.append('"views": [\n  ' + ",\n  ".join(views) + "\n ]")
        elif key == "starts":
            starts = [f'"{kind}": {json.dumps(start)}' for kind, start in value.items()]
            lines.append('"starts": {\n  ' + ",\n  ".join(starts) + "\n }")
        else:
            lines.append(f"{json.dumps(key)}: {json.dumps(value)}")
    return "{\n " + ",\n ".join(lines) + "\n}\n"


def without_certificate(text):
    """The file up to its certified values, which `certify.py` adds at the end."""
    head, mark, _ = text.partition(',\n "certified": ')
    return head + "\n}\n" if mark else text


def write(path, text):
    """To a temporary file, which is then renamed: an interruption leaves no half of a file."""
    part = path.with_suffix(".part")
    part.write_text(text)
    part.replace(path)


def main(arguments):
    check = "--check" in arguments
    names = [a for a in arguments if not a.startswith("-")]
    differing = 0
    for entry in PROBLEMS:
        if names and entry[0] not in names:
            continue
        path, text = HERE / f"{entry[0]}.json", text_of(made(entry))
        same = path.exists() and without_certificate(path.read_text()) == text
        if not same:
            differing += 1
            print(f"{path.name}: {'differs' if check else 'written'}")
            if not check:
                write(path, text)
    if check:
        print("every file is as this script makes it" if not differing else f"{differing} differ")
    return 1 if check and differing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

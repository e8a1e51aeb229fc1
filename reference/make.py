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

from make_lenses import COEFFICIENTS, FISHEYES, image as lens_image

HERE = pathlib.Path(__file__).resolve().parent
LINEAR = ["fx", "fy", "cx", "cy"]
# Pixels are multiples of 1/256 px.
PARTS_OF_PIXEL, DECIMALS = 256, 8


def names_of(camera):
    """Every parameter of a camera's model, in order."""
    return LINEAR + ["skew"] + COEFFICIENTS[camera.get("model", "brown-conrady")]


# --- the virtual camera -----------------------------------------------------------------------------------------------------


def project(camera, rotation, translation, point):
    """The pixel of a target point, or None where the lens has no image of it."""
    q = [rotation[i][0] * point[0] + rotation[i][1] * point[1] + translation[i] for i in range(3)]
    seen = lens_image(camera, q)
    if seen is None:
        return None
    xd, yd = seen
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
    """`model` among the others is the lens's; what is not given is 0."""
    values = dict(zip(LINEAR, [fx, fy, cx, cy])) | others
    return dict.fromkeys(names_of(values), 0.0) | values


CHAPTER = camera(600.0, 600.0, 326.0, 243.0, k1=-0.18, k2=0.05)
PROBLEMS = []


def problem(level, seed, about, *, image, noise, free, truth, held=None, version=1):
    """Registers a function that returns the views: a list of (points, pose), given a stream of numbers."""

    def register(function):
        name = function.__name__.replace("_", "-")
        PROBLEMS.append((name, version, level, seed, about, image, noise, free, truth, held or {}, function))
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
         image=(800, 600), noise=0.1, free=names_of(TEN),
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


# --- problems of version 2: the other lens models --------------------------------------------------------------------------------


def aimed(points, places):
    """Views whose target is centred `off_axis` degrees from the axis, in the direction `around`, at a distance; it faces the camera
    but for a turn of its own."""
    views = []
    for off_axis, around, distance, turn in places:
        aim = product(rotation_xyz((0, 0, around)), product(rotation_xyz((0, off_axis, 0)), rotation_xyz((0, 0, -around))))
        r, c = product(aim, rotation_xyz(turn)), centre(points)
        position = [distance * aim[i][2] for i in range(3)]
        views.append((points, (r, [position[i] - r[i][0] * c[0] - r[i][1] * c[1] for i in range(3)])))
    return views


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


QUOTIENT = camera(255.0, 256.0, 322.0, 238.0, model="rational",
                  k1=0.35, k2=0.25, p1=0.0008, p2=-0.0006, k3=0.03, k4=0.65, k5=0.4, k6=0.09)


@problem("higher", 1401, "the rational model, marks up to 67 degrees from the axis, all eight coefficients free: they make up for each other",
         image=(640, 480), noise=0.02, free=LINEAR + COEFFICIENTS["rational"], truth=QUOTIENT, version=2)
def rational(normal):
    return aimed(grid(11, 8, 10.0), [
        (3, 0, 52, (25, 8, 3)), (8, 80, 55, (-28, 10, -6)), (12, 160, 58, (6, 30, 12)), (10, 245, 54, (9, -27, 170)),
        (13, 320, 64, (-20, -22, 85)), (16, 30, 60, (18, -25, -15)), (16, 150, 68, (-15, 24, 5)), (12, 210, 75, (28, 20, -75)),
        (16, 335, 56, (-30, -5, 5)), (5, 120, 52, (2, -3, 0))])


PRISMS = camera(520.0, 524.0, 409.0, 291.0, model="thin-prism",
                k1=-0.21, k2=0.07, p1=0.0011, p2=-0.0008, s1=0.0025, s2=-0.0013, s3=-0.0031, s4=0.0009)


@problem("higher", 1402, "thin prisms, which look like decentring: s1 to s4 beside p1 and p2",
         image=(800, 600), noise=0.05, free=LINEAR + "k1 k2 p1 p2 s1 s2 s3 s4".split(), truth=PRISMS, version=2)
def thin_prism(normal):
    return drawn(normal, 10, PRISMS, (800, 600), grid(10, 7, 12.0), tilt=40, coverage=0.9)


SCHEIMPFLUG = camera(980.0, 984.0, 505.0, 380.0, model="tilted", k1=-0.16, k2=0.08, tau_x=0.11, tau_y=-0.07)


@problem("higher", 1403, "a sensor tilted by six and four degrees (Scheimpflug): the tilts look like another principal point",
         image=(1024, 768), noise=0.05, free=LINEAR + "k1 k2 tau_x tau_y".split(), truth=SCHEIMPFLUG, version=2)
def tilted_sensor(normal):
    return drawn(normal, 8, SCHEIMPFLUG, (1024, 768), grid(9, 7, 20.0), tilt=40, coverage=0.85)


FISHEYE = camera(228.0, 229.0, 317.0, 244.0, model="kannala-brandt", k1=0.021, k2=-0.012, k3=0.0045, k4=-0.0016)


@problem("average", 1404, "a fisheye of Kannala and Brandt, all four coefficients free, marks up to 80 degrees from the axis",
         image=(640, 480), noise=0.1, free=LINEAR + COEFFICIENTS["kannala-brandt"], truth=FISHEYE, version=2)
def fisheye(normal):
    return aimed(grid(9, 7, 10.0), [
        (2, 0, 45, (22, 6, 4)), (10, 100, 48, (-25, 8, -10)), (25, 10, 52, (8, 25, 20)), (25, 190, 46, (5, -28, 165)),
        (16, 275, 58, (24, 15, -10)), (38, 0, 58, (-12, 10, 8)), (38, 180, 60, (14, -9, -4)), (38, 35, 60, (10, -20, 60))])


WHOLE = camera(146.0, 146.5, 323.0, 241.0, model="kannala-brandt", k1=0.012, k2=-0.0065, k3=0.0021, k4=-0.00032)


@problem("higher", 1405, "a fisheye that sees behind itself: boards around the camera, marks up to 105 degrees from the axis",
         image=(640, 480), noise=0.1, free=LINEAR + COEFFICIENTS["kannala-brandt"], truth=WHOLE, version=2)
def fisheye_behind(normal):
    return aimed(grid(9, 7, 10.0), [
        (3, 0, 45, (25, 6, 4)), (12, 100, 48, (-27, 8, -10)), (28, 200, 46, (8, 28, 20)), (30, 300, 46, (5, -28, 95)),
        (66, 0, 60, (8, 12, 5)), (66, 180, 60, (-8, -12, -5)), (58, 85, 64, (14, -6, 2)), (58, 270, 64, (-12, 9, -3)),
        (68, 35, 64, (10, -15, 40)), (68, 215, 64, (-11, 14, 130))])


BARREL = camera(292.0, 291.0, 325.0, 236.0, model="division", k1=-0.24)


@problem("average", 1406, "the division model: one coefficient, marks up to 60 degrees from the axis",
         image=(640, 480), noise=0.1, free=LINEAR + ["k1"], truth=BARREL, version=2)
def division(normal):
    return aimed(grid(9, 7, 10.0), [
        (2, 0, 58, (22, 6, 4)), (12, 100, 62, (-28, 8, -10)), (13, 10, 72, (8, 27, 20)), (20, 190, 60, (5, -30, 165)),
        (10, 320, 86, (24, 15, -30)), (20, 145, 78, (-20, -18, 10))])


SPHERES = camera(152.0, 151.5, 318.0, 242.0, model="double-sphere", xi=-0.18, alpha=0.57)


@problem("average", 1407, "the double sphere: a fisheye of two coefficients, marks up to 93 degrees from the axis",
         image=(640, 480), noise=0.05, free=LINEAR + ["xi", "alpha"], truth=SPHERES, version=2)
def double_sphere(normal):
    return aimed(grid(9, 7, 10.0), [
        (2, 0, 42, (22, 6, 4)), (12, 100, 45, (-28, 8, -10)), (28, 190, 48, (5, -30, 165)), (26, 275, 60, (24, 15, -10)),
        (55, 20, 62, (-8, 10, 20)), (54, 165, 64, (9, -10, 15)), (46, 215, 72, (-10, 6, -50)), (46, 335, 72, (12, -6, 70))])


@problem("higher", 1408, "two minima: the double sphere at another focal length explains marks up to 83 degrees nearly as well",
         image=(640, 480), noise=0.1, free=LINEAR + ["xi", "alpha"], truth=SPHERES, version=2)
def double_sphere_two_minima(normal):
    return aimed(grid(9, 7, 10.0), [
        (2, 0, 42, (22, 6, 4)), (12, 100, 45, (-28, 8, -10)), (28, 10, 48, (8, 22, 20)), (28, 190, 48, (5, -30, 165)),
        (26, 275, 60, (24, 15, -10)), (40, 20, 60, (-12, 10, 70)), (40, 160, 58, (12, -14, 35))])


# --- problems of version 3: a lens that is solved for the seen point -------------------------------------------------------------


INVERSE = camera(418.0, 420.0, 326.0, 243.0, model="halcon-polynomial", k1=0.25, k2=0.04, p1=0.0006, p2=-0.0009, k3=-0.01)


@problem("higher", 1501, "HALCON's polynomial, from the seen point to the ideal one: five coefficients, marks up to 48 degrees from the axis",
         image=(640, 480), noise=0.05, free=LINEAR + COEFFICIENTS["halcon-polynomial"], truth=INVERSE, version=3)
def halcon_polynomial(normal):
    return aimed(grid(9, 7, 10.0), [
        (2, 0, 68, (25, 8, 3)), (4, 80, 72, (-28, 10, -6)), (6, 175, 76, (6, 30, 12)), (5, 260, 82, (9, -27, 170)),
        (28, 31, 128, (-12, -16, 8)), (26, 148, 132, (15, -18, -8)), (29, 217, 132, (-14, 15, 8)), (24, 328, 124, (20, 14, -8))])


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


def far_start(image, free, held, observed, model):
    """What needs no calibration: a focal length of the image's width, the image's centre, no distortion, every target facing.

    Of a fisheye: the equidistant one that sees 180 degrees across the image, and targets that face it from their own directions.
    """
    width, height = image
    is_fisheye = model in FISHEYES
    focal = digits(width / math.pi, 3) if is_fisheye else float(width)
    guess = camera(focal, focal, (width - 1) / 2, (height - 1) / 2, model=model)
    if model == "double-sphere":
        # Neither xi nor alpha: a lens between the pinhole (alpha = 0) and the stereographic image (alpha = 1/2).
        guess["alpha"] = 0.5
    values = {name: held.get(name, guess[name]) for name in names_of(guess)}
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
        if is_fisheye:
            around, off_axis = math.degrees(math.atan2(position[1], position[0])), math.hypot(position[0], position[1]) / z
            aim = product(rotation_xyz((0, math.degrees(off_axis), 0)), rotation_xyz((0, 0, -around)))
            aim = product(rotation_xyz((0, 0, around)), aim)
            r, position = product(aim, r), [z * aim[i][2] for i in range(3)]
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
    name, version, level, seed, about, image, noise, free, truth, held, function = entry
    normal = Normal(seed)
    views = function(normal)
    model = truth.get("model", "brown-conrady")
    held = {n: held.get(n, 0.0) for n in names_of(truth) if n not in free}
    if version > 1 and not all(seen_whole(truth, image, view_pose, points) for points, view_pose in views):
        raise ValueError(f"{name}: a mark lies outside the image")
    observed = []
    for points, view_pose in views:
        exact = [project(truth, *view_pose, p) for p in points]
        pixels = [[in_parts(c + noise * normal.draw()) for c in pixel] for pixel in exact]
        observed.append((points, pixels))
    return {
        "id": name,
        "version": version,
        "level": level,
        "about": about,
        "image_size": list(image),
        # Version 1 has one model and does not name it.
        **({"model": model} if version > 1 else {}),
        "free": free,
        "held": held,
        "noise_px": noise,
        "decimals": DECIMALS,
        "seed": seed,
        "starts": {"far": far_start(image, free, held, observed, model), "near": near_start(free, truth, views)},
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

"""Draws the photographs of this folder and marks.csv: python draw.py, with opencv-python 4.7 or later and NumPy.

OpenCV draws each board; the photograph is its mean over the rays of 8 x 8 places of a pixel, each through the inverse of the
pinhole and the pose, so that projectPoints says where the corners are.
"""

import pathlib

import cv2
import numpy as np

SIZE = (480, 360)
K = np.array([[450.0, 0, 240], [0, 450.0, 180], [0, 0, 1]])
PER_MM, MARGIN_MM, PLACES = 16, 12, 8
HERE = pathlib.Path(__file__).parent
ARUCO = cv2.aruco


def board(squares, square, marker, name, legacy):
    drawn = ARUCO.CharucoBoard(squares, square, marker, ARUCO.getPredefinedDictionary(getattr(ARUCO, name)))
    drawn.setLegacyPattern(legacy)
    return drawn


SCENES = [
    ("whole", board((7, 5), 30.0, 22.0, "DICT_4X4_50", False), (0.3, -0.4, 0.2), (5.0, 3.0, 230.0)),
    ("part", board((7, 5), 30.0, 22.0, "DICT_4X4_50", False), (-0.2, 0.3, 3.0), (75.0, -20.0, 215.0)),
    ("legacy", board((5, 6), 20.0, 15.0, "DICT_6X6_250", True), (0.4, 0.2, -1.2), (2.0, -3.0, 165.0)),
]


def photograph(drawn, rotation, middle):
    columns, rows = drawn.getChessboardSize()
    side = drawn.getSquareLength()
    size_mm = np.array([columns * side, rows * side])
    image = drawn.generateImage(tuple(int(PER_MM * x) for x in size_mm), marginSize=0)
    image = cv2.copyMakeBorder(image, *[MARGIN_MM * PER_MM] * 4, cv2.BORDER_CONSTANT, value=255)
    turned = cv2.Rodrigues(np.array(rotation))[0]
    moved = np.array(middle) - turned @ np.append(0.5 * size_mm, 0.0)
    board_from_pixel = np.linalg.inv(K @ np.column_stack([turned[:, 0], turned[:, 1], moved]))
    u, v = np.meshgrid(np.arange(SIZE[0], dtype=float), np.arange(SIZE[1], dtype=float))
    total = np.zeros(u.shape)
    for place in np.ndindex(PLACES, PLACES):
        du, dv = (np.array(place) + 0.5) / PLACES - 0.5
        x, y, w = np.tensordot(board_from_pixel, np.stack([u + du, v + dv, np.ones_like(u)]), 1)
        at = [((a / w + MARGIN_MM) * PER_MM - 0.5).astype(np.float32) for a in (x, y)]
        total += cv2.remap(image, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=110)
    pixels, _ = cv2.projectPoints(drawn.getChessboardCorners(), np.array(rotation), moved, K, None)
    return np.round(30 + total / PLACES**2 * 0.75).astype(np.uint8), pixels.reshape(-1, 2)


with open(HERE / "marks.csv", "w") as table:
    table.write("photo,mark,u,v\n")
    for name, drawn, rotation, middle in SCENES:
        image, pixels = photograph(drawn, rotation, middle)
        cv2.imwrite(str(HERE / f"{name}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        for mark, (u, v) in enumerate(pixels):
            table.write(f"{name},{mark},{u:.4f},{v:.4f}\n")

"""Writes the tables of this folder: python write.py, with opencv-python 4.7 or later.

A line is a marker, in the order of the numbers: its inner cells row by row from the top left, white 1 and black 0, the
first the highest of the binary digits that the hexadecimal number has. The tables are those of OpenCV's predefined dictionaries
(https://docs.opencv.org/4.x/d1/d21/aruco__dictionary_8hpp.html; Garrido-Jurado et al. 2014, 2016; the AprilTag families
of Olson 2011 and Wang & Olson 2016).
The smaller ones of OpenCV are the first lines of those with 1000 markers, which this script checks.
"""

import pathlib

import cv2

FAMILIES = [
    "4X4_1000", "5X5_1000", "6X6_1000", "7X7_1000", "ARUCO_ORIGINAL", "ARUCO_MIP_36h12",
    "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10", "APRILTAG_36h11",
]


def lines(name):
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
    side = dictionary.markerSize
    width = (side * side + 3) // 4
    for marker in range(len(dictionary.bytesList)):
        cells = cv2.aruco.Dictionary.getBitsFromByteList(dictionary.bytesList[marker : marker + 1], side)
        number = int("".join(str(int(cell)) for cell in cells.flatten()), 2)
        yield f"{number:0{width}x}\n"


for name in FAMILIES:
    table = list(lines(name))
    if name.endswith("_1000"):
        for count in (50, 100, 250):
            assert list(lines(name.replace("1000", str(count)))) == table[:count]
    (pathlib.Path(__file__).parent / f"{name.lower()}.txt").write_text("".join(table))

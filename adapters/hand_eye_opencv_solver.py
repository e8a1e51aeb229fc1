"""OpenCV's hand-eye methods behind `calibench gate hand-eye`.

    pip install "opencv-python-headless<5"
    calibench gate hand-eye --solver "python3 adapters/hand_eye_opencv_solver.py park"

Methods of calibrateHandEye: tsai, park, horaud, andreff, daniilidis; of calibrateRobotWorldHandEye: shah, li. For a fixed camera the
robot's poses are inverted, as OpenCV's documentation says. Nothing is checked here that OpenCV does not check itself; where it fails it logs
so and returns the identity, which counts as a refusal. The Python package of OpenCV 5.0 has the names of the methods and not the functions.
"""

import json
import sys

import cv2
import numpy as np

HAND_EYE = {
    "tsai": cv2.CALIB_HAND_EYE_TSAI,
    "park": cv2.CALIB_HAND_EYE_PARK,
    "horaud": cv2.CALIB_HAND_EYE_HORAUD,
    "andreff": cv2.CALIB_HAND_EYE_ANDREFF,
    "daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}
ROBOT_WORLD = {"shah": cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH, "li": cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI}


def matrix(pose):
    whole = np.eye(4)
    whole[:3, :3] = pose["rotation"]
    whole[:3, 3] = pose["translation"]
    return whole


def parts(poses):
    return [pose[:3, :3] for pose in poses], [pose[:3, 3] for pose in poses]


def solve(problem, method):
    robot = [matrix(pose) for pose in problem["base_from_gripper"]]
    camera = [matrix(pose) for pose in problem["cam_from_target"]]
    if problem["set_up"] == "eye-to-hand":
        robot = [np.linalg.inv(pose) for pose in robot]
    if method in HAND_EYE:
        return cv2.calibrateHandEye(*parts(robot), *parts(camera), method=HAND_EYE[method])
    gripper_from_base = [np.linalg.inv(pose) for pose in robot]
    found = cv2.calibrateRobotWorldHandEye(*parts(camera), *parts(gripper_from_base), method=ROBOT_WORLD[method])
    rotation, translation = found[2], np.ravel(found[3])
    return rotation.T, -rotation.T @ translation


def answer(problem, method):
    try:
        rotation, translation = solve(problem, method)
    except cv2.error as error:
        return {"status": "refused", "message": str(error).strip().splitlines()[-1]}
    rotation, translation = np.asarray(rotation), np.ravel(translation)
    if np.array_equal(rotation, np.eye(3)) and not translation.any():
        return {"status": "refused", "message": "the identity, which OpenCV returns where it logs that it failed"}
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
        return {"status": "not_converged", "message": "not finite"}
    return {"status": "ok", "x": {"rotation": rotation.tolist(), "translation": translation.tolist()}}


if __name__ == "__main__":
    known = [*HAND_EYE, *ROBOT_WORLD]
    if len(sys.argv) != 2 or sys.argv[1] not in known:
        sys.exit("usage: hand_eye_opencv_solver.py METHOD, one of " + ", ".join(known))
    for line in sys.stdin:
        problem = json.loads(line)
        print(json.dumps({"id": problem["id"], **answer(problem, sys.argv[1])}), flush=True)

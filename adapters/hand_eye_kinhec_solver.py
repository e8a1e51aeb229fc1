"""KinHEC's reference solvers behind `calibench gate hand-eye`.

    pip install kinhec
    calibench gate hand-eye --solver "python3 adapters/hand_eye_kinhec_solver.py park_martin"

KinHEC (MIT licence) has closed forms of A X = X B, which take the motions between all pairs of stations here, of A X = Y B, and a
refinement of each, `refine` and `refine_world`, begun at park_martin and shah. It states no covariance.
"""

import json
import sys

import numpy as np
from kinhec.solvers import AXXB_SOLVERS, AXYB_SOLVERS, refine_lm, refine_lm_axyb


def matrix(pose):
    whole = np.eye(4)
    whole[:3, :3] = pose["rotation"]
    whole[:3, 3] = pose["translation"]
    return whole


def motions(robot, camera):
    pairs = [(i, j) for i in range(len(robot)) for j in range(i + 1, len(robot))]
    of_robot = [np.linalg.inv(robot[j]) @ robot[i] for i, j in pairs]
    of_camera = [camera[j] @ np.linalg.inv(camera[i]) for i, j in pairs]
    return np.array(of_robot), np.array(of_camera)


def solve(problem, method):
    robot = [matrix(pose) for pose in problem["base_from_gripper"]]
    camera = [matrix(pose) for pose in problem["cam_from_target"]]
    if problem["set_up"] == "eye-to-hand":
        robot = [np.linalg.inv(pose) for pose in robot]
    if method in AXXB_SOLVERS or method == "refine":
        of_robot, of_camera = motions(robot, camera)
        x = AXXB_SOLVERS.get(method, AXXB_SOLVERS["park_martin"])(of_robot, of_camera)
        return refine_lm(of_robot, of_camera, x) if method == "refine" else x
    # G X = Y C^-1.
    a, b = np.array(robot), np.array([np.linalg.inv(pose) for pose in camera])
    x, y = AXYB_SOLVERS.get(method, AXYB_SOLVERS["shah"])(a, b)
    return refine_lm_axyb(a, b, x, y)[0] if method == "refine_world" else x


def answer(problem, method):
    try:
        x = np.asarray(solve(problem, method))
    except (ValueError, np.linalg.LinAlgError) as error:
        return {"status": "refused", "message": str(error)}
    if not np.isfinite(x).all():
        return {"status": "not_converged", "message": "not finite"}
    return {"status": "ok", "x": {"rotation": x[:3, :3].tolist(), "translation": x[:3, 3].tolist()}}


if __name__ == "__main__":
    known = [*AXXB_SOLVERS, *AXYB_SOLVERS, "refine", "refine_world"]
    if len(sys.argv) != 2 or sys.argv[1] not in known:
        sys.exit("usage: hand_eye_kinhec_solver.py METHOD, one of " + ", ".join(known))
    for line in sys.stdin:
        problem = json.loads(line)
        print(json.dumps({"id": problem["id"], **answer(problem, sys.argv[1])}), flush=True)

"""mrcal's side of the comparison: its refinement alone, from the closed form that it is given.

mrcal holds the distortion as a whole or not at all: p1 and p2 are estimated too.
"""

import sys
from pathlib import Path

import mrcal
import numpy as np

from serve import numbers, serve

FOLDER = Path(sys.argv[1])


def make(row):
    count = int(row.split("-")[1])
    pairs = numbers(FOLDER, f"views-{count}").reshape(count, 7, 9, 4)
    start = numbers(FOLDER, f"start-{count}")
    poses = start[6:].reshape(count, 12)
    # Its board begins at a corner and has the pitch 10; ours is centred.
    corner = np.r_[pairs[0, 0, 0, :2], 0]
    rotations = poses[:, :9].reshape(-1, 3, 3)
    translations = poses[:, 9:] + rotations @ corner
    frames = np.array([np.r_[mrcal.r_from_R(r.copy()), t] for r, t in zip(rotations, translations)])
    observations = np.ascontiguousarray(np.concatenate([pairs[..., 2:], np.ones((count, 7, 9, 1))], axis=-1))
    indices = np.array([[i, 0, -1] for i in range(count)], dtype=np.int32)
    intrinsics = np.array([[*start[:4], 0, 0, 0, 0]])

    def run():
        found = intrinsics.copy()
        mrcal.optimize(
            intrinsics=found,
            extrinsics_rt_fromref=np.zeros((0, 6)),
            frames_rt_toref=frames.copy(),
            points=None,
            observations_board=observations,
            indices_frame_camintrinsics_camextrinsics=indices,
            observations_point=None,
            indices_point_camintrinsics_camextrinsics=None,
            lensmodel="LENSMODEL_OPENCV4",
            imagersizes=np.array([[640, 480]], dtype=np.int32),
            calibration_object_spacing=10.0,
            do_optimize_calobject_warp=False,
            do_apply_outlier_rejection=False,
            do_apply_regularization=False,
            verbose=False,
        )
        return found

    return run, lambda found: found[0, [0, 1, 2, 3, 4, 5]]


if __name__ == "__main__":
    serve(make)

"""mrcal behind `calibench gate`.

    apt-get install python3-mrcal
    calibench gate --solver "/usr/bin/python3 adapters/mrcal_solver.py"

Its OPENCV4 and OPENCV5 lenses, without regularization, board warp and outliers: the gate's boards are flat, and its noise Gaussian but where a scene
says otherwise. mrcal frees all coefficients of a lens together and takes marks of one lattice, of which views may miss some. It searches from where
it is put: the starting values are those of `minimal_solver.py`. The covariance is `s^2 (J^T J)^-1` from the Jacobian that mrcal gives.
"""

# First, because it sets the number of threads.
from minimal_solver import NAMES, Unsupported, main, start, views_of

import mrcal
import numpy as np

CORE = ["fx", "fy", "cx", "cy"]
LENSES = {"LENSMODEL_OPENCV4": ["k1", "k2", "p1", "p2"], "LENSMODEL_OPENCV5": ["k1", "k2", "p1", "p2", "k3"]}


def lens_of(problem):
    free = set(problem["free"])
    for lens, coefficients in LENSES.items():
        others = set(NAMES) - set(CORE) - set(coefficients)
        if free == {*CORE, *coefficients} and all(problem["held"].get(name, 0.0) == 0.0 for name in others):
            return lens, [*CORE, *coefficients]
    raise Unsupported("mrcal frees fx, fy, cx, cy, k1, k2, p1 and p2 together, or those and k3")


def lattice_of(views):
    """Origin and spacing of the lattice all marks lie on, and its size in columns and rows."""
    marks = np.concatenate([target for target, _ in views])
    steps = np.concatenate([np.diff(np.unique(marks[:, axis])) for axis in (0, 1)])
    if len(steps) == 0:
        raise Unsupported("the marks are no lattice")
    origin, spacing = marks.min(axis=0), steps.min()
    cells = (marks - origin) / spacing
    if np.abs(cells - cells.round()).max() > 1e-9:
        raise Unsupported("the marks are no lattice")
    columns, rows = cells.max(axis=0).round().astype(int) + 1
    return origin, spacing, columns, rows


def observations_of(views, lattice):
    """(view, row, column, (u, v, weight)); a weight below 0 is a mark that the view misses."""
    origin, spacing, columns, rows = lattice
    seen = np.zeros((len(views), rows, columns, 3))
    seen[..., 2] = -1.0
    for view, (target, pixels) in enumerate(views):
        column, row = ((target - origin) / spacing).round().astype(int).T
        seen[view, row, column, :2] = pixels
        seen[view, row, column, 2] = 1.0
    return seen


def inputs_of(problem, views, lens, names):
    """What `mrcal.optimize` takes: poses of the lattice's first mark, in radians and lattice units of length."""
    lattice = lattice_of(views)
    values, poses = start(problem, views, problem["held"])
    by_name = dict(zip(NAMES, values))
    corner = np.append(lattice[0], 0.0)
    frames = [np.append(pose[:3], pose[3:] + mrcal.R_from_r(pose[:3]) @ corner) for pose in poses]
    indices = np.array([[view, 0, -1] for view in range(len(views))], dtype=np.int32)
    return {
        "intrinsics": np.array([[by_name[name] for name in names]]),
        "extrinsics_rt_fromref": np.zeros((0, 6)),
        "frames_rt_toref": np.array(frames),
        "points": None,
        "observations_board": observations_of(views, lattice),
        "indices_frame_camintrinsics_camextrinsics": indices,
        "observations_point": None,
        "indices_point_camintrinsics_camextrinsics": None,
        "lensmodel": lens,
        "imagersizes": np.array([problem["image_size"]], dtype=np.int32),
        "calobject_warp": None,
        "calibration_object_spacing": lattice[1],
        "do_optimize_intrinsics_core": True,
        "do_optimize_intrinsics_distortions": True,
        "do_optimize_extrinsics": False,
        "do_optimize_frames": True,
        "do_optimize_calobject_warp": False,
        "do_apply_regularization": False,
        "do_apply_outlier_rejection": False,
    }


def covariance_of(inputs, unknowns):
    """`s^2 (J^T J)^-1` of the intrinsics. mrcal's unknowns are scaled; so are its derivatives."""
    _, residuals, jacobian, _ = mrcal.optimizer_callback(**inputs)
    freedom = np.count_nonzero(inputs["observations_board"][..., 2] > 0) * 2 - unknowns
    if freedom <= 0:
        raise ValueError("fewer measurements than unknowns")
    dense = jacobian.toarray()
    inverse = np.linalg.inv(dense.T @ dense)
    scales = np.ones(len(inverse))
    mrcal.unpack_state(scales, **inputs)
    count = inputs["intrinsics"].shape[1]
    scaled = inverse * np.outer(scales, scales) * (residuals @ residuals / freedom)
    return scaled[:count, :count]


def solve(problem):
    lens, names = lens_of(problem)
    views = views_of(problem)
    inputs = inputs_of(problem, views, lens, names)
    found = mrcal.optimize(**inputs, verbose=False)
    unknowns = len(names) + 6 * len(views)
    order = [names.index(name) for name in problem["free"]]
    corner = np.append(lattice_of(views)[0], 0.0)
    rotations = [mrcal.R_from_r(frame[:3]) for frame in inputs["frames_rt_toref"]]
    marks = sum(len(pixels) for _, pixels in views)
    return {
        "status": "ok",
        "parameters": {name: float(inputs["intrinsics"][0, i]) for name, i in zip(problem["free"], order)},
        "poses": [
            {"rotation": r.tolist(), "translation": (frame[3:] - r @ corner).tolist()}
            for r, frame in zip(rotations, inputs["frames_rt_toref"])
        ],
        "covariance": {"parameters": problem["free"], "matrix": covariance_of(inputs, unknowns)[np.ix_(order, order)].tolist()},
        "rmse": float(np.sqrt(np.sum(found["x"] ** 2) / marks)),
    }


if __name__ == "__main__":
    main(solve)

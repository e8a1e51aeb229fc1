"""COLMAP's bundle adjustment behind `calibench gate`.

    pip install pycolmap pyceres
    calibench gate --solver "python3 adapters/colmap_solver.py"

COLMAP's camera FULL_OPENCV, its cost and its search, to machine precision, with the target's points held. It frees all coefficients of a lens
together; those that are to be held are held here by the manifold of Ceres, as its own examples of adjustments made to measure do. COLMAP has no
start from a target: the starting values are those of `minimal_solver.py`. The covariance is that of Ceres, times `s^2`.
"""

# First, because it sets the number of threads.
from minimal_solver import NAMES, Unsupported, main, rotation_matrix, start, views_of

import numpy as np
import pyceres
import pycolmap

ORDER = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]


def camera_of(problem, values):
    if "skew" in problem["free"] or problem["held"].get("skew", 0.0) != 0.0:
        raise Unsupported("COLMAP's camera has no skew")
    by_name = dict(zip(NAMES, values))
    width, height = problem["image_size"]
    params = [by_name.get(name, 0.0) for name in ORDER]
    return pycolmap.Camera(model="FULL_OPENCV", width=width, height=height, params=params, camera_id=1)


def scene_of(camera, poses, views):
    """The views as a reconstruction."""
    scene = pycolmap.Reconstruction()
    scene.add_camera_with_trivial_rig(camera)
    tracks = {}
    for number, (pose, (target, pixels)) in enumerate(zip(poses, views), start=1):
        marks = pycolmap.Point2DList([pycolmap.Point2D(pixel) for pixel in pixels])
        image = pycolmap.Image(name=str(number), camera_id=1, image_id=number, points2D=marks)
        place = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation_matrix(pose[:3])), pose[3:])
        scene.add_image_with_trivial_frame(image, place)
        for index, point in enumerate(map(tuple, target)):
            tracks.setdefault(point, []).append(pycolmap.TrackElement(number, index))
    for (x, y), track in tracks.items():
        if len(track) == 1:
            raise Unsupported("COLMAP adjusts points that two images see, or more")
        scene.add_point3D(np.array([x, y, 0.0]), pycolmap.Track(track))
    return scene


def adjuster_of(scene):
    config, options = pycolmap.BundleAdjustmentConfig(), pycolmap.BundleAdjustmentOptions()
    for number in scene.images:
        config.add_image(number)
    for point in scene.points3D:
        config.add_constant_point(point)
    options.min_track_length = 0
    options.print_summary = False
    options.refine_principal_point = True
    search = options.ceres.solver_options
    search.max_num_iterations = 200
    search.function_tolerance = search.gradient_tolerance = search.parameter_tolerance = 1e-16
    search.num_threads = 1
    return pycolmap.create_default_ceres_bundle_adjuster(options, config, scene)


def covariance_of(adjustment, camera, cost, unknowns):
    """Of all twelve parameters; those that are held have none."""
    freedom = adjustment.num_residuals() - unknowns
    if freedom <= 0:
        raise ValueError("fewer measurements than unknowns")
    found = pyceres.Covariance(pyceres.CovarianceOptions())
    if not found.compute([(camera.params, camera.params)], adjustment):
        raise ValueError("the covariance is rank deficient")
    return np.array(found.get_covariance_block(camera.params, camera.params)) * (2.0 * cost / freedom)


def solve(problem):
    views = views_of(problem)
    values, poses = start(problem, views, problem["held"])
    scene = scene_of(camera_of(problem, values), poses, views)
    adjuster = adjuster_of(scene)
    camera, free = scene.cameras[1], [ORDER.index(name) for name in problem["free"]]
    held = [i for i in range(len(ORDER)) if i not in free]
    # Ceres does not own it, so it must live as long as the problem.
    manifold = pyceres.SubsetManifold(len(ORDER), held)
    adjuster.problem.set_manifold(camera.params, manifold)
    summary = adjuster.solve()
    cost = summary.ceres_summary.final_cost
    unknowns = len(free) + 6 * len(views)
    covariance = covariance_of(adjuster.problem, camera, cost, unknowns)[np.ix_(free, free)]
    converged = summary.termination_type == pycolmap.BundleAdjustmentTerminationType.CONVERGENCE
    placed = [scene.images[number].cam_from_world() for number in range(1, len(views) + 1)]
    return {
        "status": "ok" if converged else "not_converged",
        "parameters": {name: float(camera.params[i]) for name, i in zip(problem["free"], free)},
        "poses": [{"rotation": p.rotation.matrix().tolist(), "translation": p.translation.tolist()} for p in placed],
        "covariance": {"parameters": problem["free"], "matrix": covariance.tolist()},
        "rmse": float(np.sqrt(2.0 * cost / sum(len(pixels) for _, pixels in views))),
        "message": summary.brief_report(),
    }


if __name__ == "__main__":
    main(solve)

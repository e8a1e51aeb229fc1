"""calibench: a test bench for camera calibration.

A virtual camera whose truth is known photographs a target, a calibrator recovers the camera, and every number is held against truth and theory.
The numbers are those of the Rust library, to the last bit.

Conventions: pixel (0, 0) is the centre of the top-left pixel, u right, v down; camera axes x right, y down, z forward; points of a target lie
in Z = 0; a pose takes target coordinates to camera coordinates; residual = predicted - observed; RMSE is per point.

    >>> import calibench
    >>> scene = calibench.Scene.example()
    >>> pixels = scene.observe(0.1, calibench.Stream(seed=1, scenario="example"))
    >>> result = calibench.calibrate(scene.points, pixels, image_size=(640, 480))
    >>> abs(result.camera.fx - scene.camera.fx) < 4 * result.standard_deviations["fx"]
    True
"""

from ._native import (
    Board,
    Calibration,
    Camera,
    Covariance,
    RectifyMap,
    Report,
    RmseDistribution,
    Scene,
    Stream,
    __version__,
    calibrate,
    compare_models,
    cramer_rao,
    digits,
    errors_of,
    fit_views,
    format_names,
    gate_properties,
    locate,
    looking_at_centre,
    read_camera,
    read_corners,
    run_study,
    write_camera,
    write_corners,
)
from .certified import certified_problems
from .errors import (
    ArrayError,
    BoardError,
    BoundError,
    CalibenchError,
    CalibrationError,
    DetectError,
    FormatError,
    RectifyError,
    SceneError,
    SettingsError,
    StudyError,
    UndistortError,
    ViewError,
)
from .gate import Answer, Problem, gate, run_gate

__all__ = [
    "Answer",
    "ArrayError",
    "Board",
    "BoardError",
    "BoundError",
    "CalibenchError",
    "Calibration",
    "CalibrationError",
    "Camera",
    "Covariance",
    "DetectError",
    "FormatError",
    "Problem",
    "RectifyError",
    "RectifyMap",
    "Report",
    "RmseDistribution",
    "Scene",
    "SceneError",
    "SettingsError",
    "Stream",
    "StudyError",
    "UndistortError",
    "ViewError",
    "__version__",
    "calibrate",
    "certified_problems",
    "compare_models",
    "cramer_rao",
    "digits",
    "errors_of",
    "fit_views",
    "format_names",
    "gate",
    "gate_properties",
    "locate",
    "looking_at_centre",
    "read_camera",
    "read_corners",
    "run_gate",
    "run_study",
    "write_camera",
    "write_corners",
]

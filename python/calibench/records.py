"""Small results: dataclasses of numbers, names and arrays. Pixel (0, 0) is the centre of the top-left pixel."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._native import Calibration, Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Warning:
    """Something to know before trusting the numbers."""

    kind: str
    """Its name in the Rust library, such as ``Correlated``."""
    message: str
    """What it says, and what to do."""
    numbers: dict[str, Any]
    """Its fields by name."""


@dataclass(frozen=True)
class Certificate:
    """How the cost of the minimum compares with that of free homographies behind the same lens, in which nothing is ambiguous."""

    holds: bool
    """Whether the excess can be chance, at a false-alarm rate of 1e-6."""
    rmse_px: float
    """RMSE per point of the minimum, px; with a robust loss the root of the mean loss of its marks."""
    floor_rmse_px: float
    """That of free homographies, px."""
    excess: float
    """Cost above theirs, in variances of a pixel coordinate."""
    freedom: int
    """Degrees of freedom of the excess."""
    floor_freedom: int
    """Degrees of freedom of the homographies' fit."""
    p_value: float
    """Probability of such an excess by chance."""


@dataclass(frozen=True)
class WeakComponent:
    """A member of the combination that the data say least about."""

    unknown: str
    """A parameter, or ``tilt``, ``roll``, ``lateral-position``, ``distance``."""
    weight: float
    """Its share, signed for parameters."""


@dataclass(frozen=True)
class Conditioning:
    """How well the data separate the parameters."""

    smallest_eigenvalue: float
    """Part of the information about the weakest combination that is left when all else is unknown: 1 is perfect, 0 not identifiable."""
    condition_number: float
    """Largest over smallest eigenvalue of that matrix."""
    weakest: tuple[WeakComponent, ...]
    """The weakest combination, strongest member first."""


@dataclass(frozen=True)
class ProfileInterval:
    """An interval by the profile of the cost."""

    parameter: str
    coverage: float
    """Probability with which such intervals contain the true value."""
    low: float | None
    """Lower end; ``None`` where the cost never rises enough."""
    high: float | None
    """Upper end; ``None`` where the cost never rises enough."""
    linear: tuple[float, float]
    """The linear interval: estimate -+ t standard deviations (Student 1908)."""


@dataclass(frozen=True)
class Prior:
    """A parameter known beforehand."""

    parameter: str
    mean: float
    standard_deviation: float


@dataclass(frozen=True)
class BoardShape:
    """The estimated shape of a board that is not flat: ``bow_x (1 - x^2) + bow_y (1 - y^2) + twist x y``, x and y from -1 to 1."""

    bow_x: float
    """In the target's unit, as the next two."""
    bow_y: float
    twist: float
    standard_deviations: tuple[float, float, float]
    """Of the three; 0 where none was estimated."""
    region: tuple[tuple[float, float], tuple[float, float]]
    """Least and greatest X and Y of all marks."""


@dataclass(frozen=True)
class Errors:
    """An estimate against the truth, by parameter and jointly."""

    error: dict[str, float]
    """Estimate - truth."""
    standard_deviation: dict[str, float]
    """Predicted."""
    z: dict[str, float]
    """Error in standard deviations."""
    chi_squared: float
    """``e^T P^-1 e``, the normalised estimation error squared."""
    p_value: float
    """Probability that chance makes it larger."""


@dataclass(frozen=True)
class ComparedModel:
    """A lens model and how it predicts views that were left out."""

    model: str
    coefficients: str
    """Those that were estimated, separated by commas."""
    hold_out_px: float | None
    """Error of a coordinate on views that were left out, px; ``None`` where the lens cannot be
    calibrated without a part of the views, or does not reach a mark of that part."""
    bic: float
    """Schwarz's criterion: the least is best, 10 more is very strong evidence against (Kass & Raftery 1995)."""
    correlation: float
    """Of a mark's residual with the next one's: 0 for noise."""
    is_behind: bool
    """Whether it comes behind the others whatever its criterion: a coefficient lies where the model is not defined, or there are as many
    unknowns as measurements."""
    calibration: Calibration
    """The fit to all views."""


@dataclass(frozen=True)
class Fit:
    """A calibration from detected marks, and what it rests on."""

    calibration: Calibration
    """Of the kept views, in order."""
    kept: tuple[int, ...]
    """Indices of the kept views."""
    left_out: tuple[tuple[int, str], ...]
    """Index and reason of each view that was left out."""
    pixels: tuple[Array, ...]
    """What was fitted, one array (N, 2) a kept view, px: the bias of imaged discs taken off (Heikkila 2000)."""
    largest_bias_px: float | None
    """The largest such bias, px; ``None`` for corners and for discs of unknown diameter."""


@dataclass(frozen=True)
class Located:
    """Where a board stands before a known camera."""

    rotation: Array
    """(3, 3), camera from target."""
    translation: Array
    """(3,), in the target's unit."""
    residuals: Array
    """(N, 2), predicted - observed, px."""


@dataclass(frozen=True)
class CameraFile:
    """A camera as a file holds it, with pixel (0, 0) at the centre of the first pixel whatever the file's origin is."""

    camera: Camera
    format: str
    """The format it was read in, one of `format_names`."""
    image_size: tuple[int, int] | None = None
    """Width and height, px."""
    name: str | None = None
    free: tuple[str, ...] = ()
    """The parameters that are rows of `covariance`."""
    covariance: Array | None = None
    """(n, n) of the parameters in `free`."""
    degrees_of_freedom: int | None = None
    """Behind the noise that scales the covariance."""
    rotation: Array | None = None
    """(3, 3), camera from reference."""
    translation: Array | None = None
    """(3,), camera from reference."""
    notes: tuple[str, ...] = ()
    """What the file says that is not kept, and what had to be assumed."""


@dataclass(frozen=True)
class Written:
    """What was written of a camera."""

    format: str
    converted: tuple[str, ...]
    """What was converted."""
    lost: tuple[str, ...]
    """What the file does not keep."""


@dataclass(frozen=True)
class Corners:
    """The marks of one photograph."""

    points: Array
    """(N, 2), on the target, in its unit."""
    pixels: Array
    """(N, 2), px."""
    weights: Array | None = None
    """(N,), factors of the residuals; ``None`` where all are 1."""


@dataclass(frozen=True)
class Check:
    """One property of a solver on one scene, as the gate judged it."""

    property: str
    scenario: str
    verdict: str
    """``held``, ``not judged``, ``accepted``, ``FAILED`` or ``GRAVE``: a confident wrong answer."""
    evidence: str
    """What was seen, with numbers."""
    problems: int
    """Number of problems behind it."""


@dataclass(frozen=True)
class Estimated:
    """A number with its interval, at the study's confidence."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Statistic:
    """What the converged trials of a cell say of one quantity; ``None`` where too few have it."""

    unit: str
    count: int
    """Trials that have a value."""
    mean: Estimated | None
    """Of an error, the bias."""
    sd: Estimated | None
    rms: Estimated | None
    """Root mean square; of an error, about the truth."""
    predicted_sd: float | None
    """What the Cramer-Rao bound says."""
    ratio: Estimated | None
    """`sd` over `predicted_sd`."""


@dataclass(frozen=True)
class StudyCell:
    """The results of one combination of levels."""

    name: str
    labels: tuple[str, ...]
    """Of its levels, one a factor."""
    trials: int
    outcomes: dict[str, int]
    """Trials by how they ended: ``converged``, or why not."""
    statistics: dict[str, Statistic]
    """By the name of the quantity: parameters, ``rmse`` and others."""


@dataclass(frozen=True)
class Study:
    """A Monte Carlo study that was run."""

    name: str
    question: str
    confidence: float
    """Of the intervals."""
    cells: tuple[StudyCell, ...]
    trials: dict[str, Any] = field(repr=False)
    """The columns of `trials.csv` by their names there, in order: arrays, and a list of outcomes."""

    def to_frame(self) -> Any:
        """The trials as a DataFrame of pandas, one row a trial; its ``to_parquet`` writes them as Parquet."""
        return import_module("pandas").DataFrame(self.trials)


@dataclass(frozen=True)
class CertifiedProblem:
    """A problem whose solution is known to twenty digits."""

    name: str
    level: str
    """``lower``, ``average`` or ``higher``, as NIST's StRD divides its regression problems."""
    about: str
    """What is particular to it."""
    image_size: tuple[int, int]
    model: str
    """The lens model: ``brown-conrady``, ``rational``, ``thin-prism``, ``tilted``, ``kannala-brandt``, ``division``, ``double-sphere`` or
    ``halcon-polynomial``."""
    points: tuple[Array, ...]
    """One array (N, 2) a view, on the target."""
    pixels: tuple[Array, ...]
    """One array (N, 2) a view, px."""
    free: tuple[str, ...]
    """The parameters to estimate."""
    hold: dict[str, float]
    """The values of the others."""
    noise_px: float
    """Standard deviation of the noise that was drawn."""
    starts: dict[str, Any] = field(repr=False)
    """``far`` and ``near``: `parameters` by name, and `poses` as rotation vector (rad) and translation."""
    parameters: dict[str, float] = field(repr=False)
    """Certified values of the free parameters at the least sum of squares."""
    standard_deviations: dict[str, float] = field(repr=False)
    """Certified, first order."""
    rmse_px: float = field(repr=False)
    """Certified, ``sqrt(sum |r|^2 / N)``."""
    sigma_px: float = field(repr=False)
    """Certified, ``sqrt(sum |r|^2 / (2 N - p))``."""
    sum_of_squares: float = field(repr=False)
    """Certified, px^2."""
    degrees_of_freedom: int = field(repr=False)

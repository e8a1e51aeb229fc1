"""Does a solver deserve trust? The gate asks it problems of known truth and judges its answers.

In a test file of a solver's project, one test a property::

    @calibench.gate(samples="quick")
    def test_my_solver(problem):
        return my_solver(problem.points, problem.pixels, problem.free, problem.hold)
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ._native import Calibration, Report, gate_builtin, gate_command, gate_properties, gate_solver
from .errors import CalibenchError

Array = NDArray[np.float64]
Samples = int | Literal["quick", "thorough"]

_SAMPLES = {"quick": 128, "thorough": 8192}


@dataclass(frozen=True)
class Problem:
    """What a solver is asked."""

    id: str
    """A number that tells nothing of what it is asked for."""
    image_size: tuple[int, int]
    """Width and height, px."""
    points: list[Array]
    """One array (N, 2) a view: points of the target's plane Z = 0."""
    pixels: list[Array]
    """One array (N, 2) a view, px. Broken input may have another length, or NaN."""
    free: tuple[str, ...]
    """Parameters to estimate, among ``fx fy cx cy skew k1 k2 p1 p2 k3``."""
    hold: dict[str, float]
    """Values of the others. The answer must keep them."""


@dataclass(frozen=True)
class Answer:
    """What a solver says. What it does not state is not judged."""

    parameters: Mapping[str, float] = field(default_factory=dict)
    """Every free parameter by name; needed where the status is ``ok``."""
    status: Literal["ok", "refused", "not_converged", "unsupported"] = "ok"
    rotations: Iterable[Array] | None = None
    """One (3, 3) a view, camera from target."""
    translations: Iterable[Array] | None = None
    """One (3,) a view, camera from target, in the target's unit."""
    covariance: Array | None = None
    """(n, n), in the order of `covariance_of`."""
    covariance_of: tuple[str, ...] | None = None
    """Names of its rows; those of the problem's `free` where it is not stated."""
    standard_deviations: Mapping[str, float] | None = None
    rmse: float | None = None
    """``sqrt(sum |r|^2 / N)`` over all N points, px."""
    warnings: tuple[str, ...] = ()
    """An answer with a warning is flagged, not silent."""
    message: str | None = None
    """Why there is no estimate."""


Solver = Callable[[Problem], "Answer | Calibration | Mapping[str, Any]"]


def run_gate(
    solver: Solver | str | None = None,
    *,
    samples: Samples = "quick",
    seed: int = 1,
    false_alarms: float = 1e-3,
    accept: Iterable[str] = (),
    median_time: float | None = None,
    timeout: float = 20.0,
    jobs: int = 1,
) -> Report:
    """Judges a solver.

    Args:
        solver: a function from `Problem` to `Answer`, to a `Calibration`, or to a dict of the protocol's fields (`adapters/PROTOCOL.md`); or
            the command of a program that speaks the protocol; ``None`` is this library's solver.
        samples: draws of the noise a scene: 128 (``quick``) show every gross fault, 8192 (``thorough``) a bias of a tenth of a standard
            deviation.
        seed: of the noise.
        false_alarms: chance that a correct solver fails the run, over all checks together (Holm 1979).
        accept: properties whose failure is known and does not fail the run.
        median_time: longest median time for a problem, s; without it time is told and not judged.
        timeout: s that a program may take for a problem; a function is waited for.
        jobs: copies of a program that run at the same time.

    A ``CalibenchError`` of a function is a refusal; any other exception is a finding.
    """
    options = {
        "samples": _SAMPLES[samples] if isinstance(samples, str) else samples,
        "seed": seed,
        "false_alarms": false_alarms,
        "accept": list(accept),
        "median_time": median_time,
    }
    if solver is None:
        return gate_builtin(options)
    if isinstance(solver, str):
        return gate_command(solver, timeout, jobs, options)
    function = solver
    return gate_solver(getattr(function, "__name__", "solver"), lambda raw: answered(function, Problem(**raw)), options)


def gate(
    *,
    samples: Samples = "quick",
    seed: int = 1,
    false_alarms: float = 1e-3,
    accept: Iterable[str] = (),
    median_time: float | None = None,
) -> Callable[[Solver], Callable[..., None]]:
    """Turns a function that answers a `Problem` into one pytest test a property; the options are those of `run_gate`.

    The solver is asked once, in process, when the first of the tests runs. A property that fails names every finding; one that the solver does
    not state is skipped. ``pytest --gate-samples thorough`` and ``--gate-seed`` take the place of `samples` and `seed`.
    """
    import pytest

    accepted = tuple(accept)

    @cache
    def report(solver: Solver, samples: Samples, seed: int) -> Report:
        return run_gate(solver, samples=samples, seed=seed, false_alarms=false_alarms, accept=accepted, median_time=median_time)

    def decorate(solver: Solver) -> Callable[..., None]:
        def test(gate_property: str, pytestconfig: Any) -> None:
            chosen = pytestconfig.getoption("gate_samples", None) or samples
            chosen_seed = pytestconfig.getoption("gate_seed", None)
            judged = report(solver, chosen, seed if chosen_seed is None else chosen_seed)
            checks = [check for check in judged.checks if check.property == gate_property]
            findings = [check for check in checks if check.verdict in ("FAILED", "GRAVE")]
            if all(check.verdict == "not judged" for check in checks):
                pytest.skip("; ".join(sorted({check.evidence for check in checks})) or "nothing to judge")
            if findings:
                pytest.fail("\n".join(f"{c.verdict} {c.scenario}: {c.evidence}" for c in findings), pytrace=False)

        test.__name__ = test.__qualname__ = getattr(solver, "__name__", "test_solver")
        test.__doc__ = solver.__doc__
        test.__module__ = solver.__module__
        marked: Callable[..., None] = pytest.mark.parametrize("gate_property", gate_properties())(test)
        return marked

    return decorate


def answered(solver: Solver, problem: Problem) -> dict[str, Any]:
    """What a solver says to a problem, in the words of the protocol (`adapters/PROTOCOL.md`)."""
    try:
        answer = solver(problem)
    except CalibenchError as error:
        answer = Answer(status="refused", message=str(error))
    if isinstance(answer, Calibration):
        answer = _of_calibration(answer)
    said = _of_answer(answer, problem) if isinstance(answer, Answer) else dict(answer)
    return {"id": problem.id} | {name: _plain(value) for name, value in said.items() if value is not None}


def _of_calibration(result: Calibration) -> Answer:
    """A correlation between two coefficients stands in the covariance already: it flags nothing."""
    return Answer(
        parameters=result.camera.parameters,
        status="ok" if result.is_usable else "not_converged",
        rotations=result.rotations,
        translations=result.translations,
        covariance=result.covariance.intrinsics,
        covariance_of=result.free,
        rmse=result.rmse_px,
        warnings=tuple(warning.message for warning in result.warnings if warning.kind != "Correlated"),
        message=None if result.termination == "converged" else result.termination,
    )


def _of_answer(answer: Answer, problem: Problem) -> dict[str, Any]:
    said = {name: getattr(answer, name) for name in ("parameters", "status", "standard_deviations", "rmse", "warnings", "message")}
    if answer.rotations is not None and answer.translations is not None:
        poses = zip(answer.rotations, answer.translations, strict=True)
        said["poses"] = [{"rotation": r, "translation": np.ravel(t)} for r, t in poses]
    if answer.covariance is not None:
        said["covariance"] = {"parameters": answer.covariance_of or problem.free, "matrix": answer.covariance}
    return said


def _plain(value: Any) -> Any:
    """Numbers, text, lists and dicts, whatever NumPy has made of them."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value

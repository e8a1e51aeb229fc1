"""Does a solver deserve trust? The gate asks it problems of known truth and judges its answers.

In a test file of a solver's project, one test a property::

    @calibench.gate(samples="quick")
    def test_my_solver(problem):
        return my_solver(problem.points, problem.pixels, problem.free, problem.hold)
"""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from operator import index
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ._native import Calibration, Report, gate_builtin, gate_command, gate_properties, gate_solver
from .errors import CalibenchError, SettingsError

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
    model: str
    """The lens model: ``brown-conrady``, or one that was named when the solver was judged."""
    points: list[Array]
    """One array (N, 2) a view: points of the target's plane Z = 0."""
    pixels: list[Array]
    """One array (N, 2) a view, px. Broken input may have another length, or NaN."""
    free: tuple[str, ...]
    """Parameters to estimate; among ``fx fy cx cy skew k1 k2 p1 p2 k3`` for Brown-Conrady's lens."""
    hold: dict[str, float]
    """Values of the model's others. The answer must keep them."""


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
    pose_covariances: Iterable[Array] | None = None
    """One (6, 6) a view, marginal: of the rotation vector of ``R_answered = exp([w]x) R_true``, rad, then of the translation in the target's unit,
    both along the camera's axes; `Covariance.poses` is that."""


Solver = Callable[[Problem], "Answer | Calibration | Mapping[str, Any]"]


def run_gate(
    solver: Solver | str | None = None,
    *,
    samples: Samples = "quick",
    seed: int = 1,
    false_alarms: float = 1e-3,
    accept: str | Iterable[str] = (),
    median_time: float | None = None,
    models: str | Iterable[str] = (),
    scenes: str | Iterable[str] = (),
    timeout: float = 20.0,
    jobs: int = 1,
) -> Report:
    """Judges a solver.

    Args:
        solver: a function from `Problem` to `Answer`, to a `Calibration`, or to a dict of the protocol's fields, those of `Answer`'s; or
            the command of a program that speaks the protocol; ``None`` is this library's solver.
        samples: draws of the noise a scene: 128 (``quick``) show every gross fault, 8192 (``thorough``) a bias of a tenth of a standard
            deviation.
        seed: of the noise.
        false_alarms: chance that a correct solver fails the run, over all checks together (Holm 1979).
        accept: properties whose failure is known and does not fail the run.
        median_time: longest median time for a problem, s; without it time is told and not judged.
        models: lens models whose scenes are asked; if none is named those that a program says it knows, all of them for this library's solver,
            and ``brown-conrady`` for a function.
        scenes: names of the only scenes to ask, as reports have them.
        timeout: s that a program may take for a problem; a function is waited for.
        jobs: copies of a program that run at the same time.

    A ``CalibenchError`` of a function is a refusal; any other exception is a finding.
    """
    options = {
        "samples": _samples(samples),
        "seed": _whole("seed", seed, 0),
        "false_alarms": false_alarms,
        "accept": _names("accept", accept),
        "median_time": median_time,
        "models": _names("models", models),
        "scenes": _names("scenes", scenes),
    }
    if solver is None:
        return gate_builtin(options)
    if isinstance(solver, str):
        if not solver.strip():
            raise SettingsError("solver: an empty command starts no program", "EmptyCommand")
        return gate_command(solver, timeout, _whole("jobs", jobs, 1), options)
    if not callable(solver):
        raise TypeError(f"solver = {solver!r}: expected a function, the command of a program, or None for this library's solver")
    function = solver
    return gate_solver(getattr(function, "__name__", "solver"), lambda raw: answered(function, Problem(**raw)), options)


def _whole(name: str, value: object, least: int) -> int:
    """A whole number of an argument, from `least` to what 64 bits hold."""
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        raise SettingsError(f"{name} = {value!r}: expected a whole number", "Argument", {"argument": name, "value": value}) from None
    if not least <= number < 2**64:
        wanted = f"expected a whole number from {least} on" if number < least else "expected a whole number below 2^64"
        raise SettingsError(f"{name} = {number}: {wanted}", "Argument", {"argument": name, "value": number})
    return number


def _samples(samples: object) -> int:
    if isinstance(samples, str):
        if samples not in _SAMPLES:
            raise SettingsError(f"samples = {samples!r}: expected quick, thorough or a whole number", "Argument", {"argument": "samples", "value": samples})
        return _SAMPLES[samples]
    return _whole("samples", samples, 1)


def _names(argument: str, names: str | Iterable[str]) -> list[str]:
    """The names of an argument; a text is one name."""
    listed = [names] if isinstance(names, str) else list(names)
    if wrong := [name for name in listed if not isinstance(name, str)]:
        raise SettingsError(f"{argument}: {wrong[0]!r} is no name", "Argument", {"argument": argument, "value": wrong[0]})
    return listed


def gate(
    solver: Solver | None = None,
    /,
    *,
    samples: Samples = "quick",
    seed: int = 1,
    false_alarms: float = 1e-3,
    accept: str | Iterable[str] = (),
    median_time: float | None = None,
    models: str | Iterable[str] = (),
    scenes: str | Iterable[str] = (),
) -> Callable[[Solver], Callable[..., None]]:
    """Turns a function that answers a `Problem` into one pytest test a property; the options are those of `run_gate`.

    The solver is asked once, in process, when the first of the tests runs. A property that fails names every finding; one that the solver does
    not state is skipped. ``pytest --gate-samples thorough`` and ``--gate-seed`` take the place of `samples` and `seed`. Marks of the function,
    such as skipif, are those of its tests.

    The function takes a `Problem` and nothing else: no fixtures, no ``self``. Where it needs more, let a test of your own call `run_gate`.
    """
    import pytest

    if solver is not None:
        raise TypeError("calibench.gate is called before it decorates: write @calibench.gate(), with options between the parentheses")
    _samples(samples), _whole("seed", seed, 0)
    asked: dict[str, Any] = {"models": tuple(_names("models", models)), "scenes": tuple(_names("scenes", scenes))}
    terms: dict[str, Any] = {"false_alarms": false_alarms, "accept": tuple(_names("accept", accept)), "median_time": median_time}

    @cache
    def report(solver: Solver, samples: Samples, seed: int) -> Report:
        return run_gate(solver, samples=samples, seed=seed, **terms, **asked)

    def decorate(solver: Solver) -> Callable[..., None]:
        _takes_a_problem(solver)

        def test(gate_property: str, pytestconfig: Any) -> None:
            chosen = pytestconfig.getoption("gate_samples", None)
            chosen_seed = pytestconfig.getoption("gate_seed", None)
            judged = report(solver, samples if chosen is None else chosen, seed if chosen_seed is None else chosen_seed)
            checks = [check for check in judged.checks if check.property == gate_property]
            findings = [check for check in checks if check.verdict in ("FAILED", "GRAVE")]
            if all(check.verdict == "not judged" for check in checks):
                pytest.skip("; ".join(sorted({check.evidence for check in checks})) or "nothing to judge")
            if findings:
                pytest.fail("\n".join(f"{c.verdict} {c.scenario}: {c.evidence}" for c in findings), pytrace=False)

        test.__name__ = test.__qualname__ = getattr(solver, "__name__", "test_solver")
        test.__doc__ = solver.__doc__
        test.__module__ = solver.__module__
        test.pytestmark = list(getattr(solver, "pytestmark", []))  # type: ignore[attr-defined]
        marked: Callable[..., None] = pytest.mark.parametrize("gate_property", gate_properties())(test)
        return marked

    return decorate


def _takes_a_problem(solver: Any) -> None:
    """Refuses what cannot be asked when it is decorated, not test by test."""
    name = getattr(solver, "__qualname__", repr(solver))
    if not callable(solver):
        raise TypeError(f"calibench.gate decorates a function of a problem, not {solver!r}")
    if inspect.iscoroutinefunction(solver) or inspect.isgeneratorfunction(solver):
        raise TypeError(f"{name}: calibench.gate asks plain functions; one that is async or yields gives no answer when it is called")
    needed = [
        parameter.name
        for parameter in inspect.signature(solver).parameters.values()
        if parameter.default is parameter.empty and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    ]
    if len(needed) != 1:
        raise TypeError(
            f"{name}({', '.join(needed)}): calibench.gate decorates a function that takes a problem and nothing else: a method has self besides, and"
            " fixtures are not filled in; let a test of your own call calibench.run_gate(lambda problem: ...)"
        )


def answered(solver: Solver, problem: Problem) -> dict[str, Any]:
    """What a solver says to a problem, in the words of the protocol (`adapters/PROTOCOL.md`)."""
    try:
        answer: object = solver(problem)
    except CalibenchError as error:
        answer = Answer(status="refused", message=str(error))
    except Exception as error:
        _show(error)
        raise
    if isinstance(answer, Calibration):
        answer = _of_calibration(answer)
    if not isinstance(answer, Answer | Mapping):
        raise TypeError(f"returned {_shortly(answer)}, expected Answer, Calibration or dict")
    said = _of_answer(answer, problem) if isinstance(answer, Answer) else dict(answer)
    return {"id": problem.id} | {name: _plain(value) for name, value in said.items() if value is not None}


def _shortly(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{type(value).__name__} {text[:80]}..."


_shown: set[tuple[str, int]] = set()
"""Where solvers have raised: the whole way there is shown once."""


def _show(error: Exception) -> None:
    """The traceback of a solver's exception, the first time it is raised at that place; reports have its text."""
    frames = traceback.extract_tb(error.__traceback__)
    place = (frames[-1].filename, frames[-1].lineno or 0)
    if place not in _shown:
        _shown.add(place)
        print("".join(traceback.format_exception(error)), end="", file=sys.stderr)


def _of_calibration(result: Calibration) -> Answer:
    """A correlation between two coefficients stands in the covariance already, and that a minimum is not certified is said of every lens but
    Brown-Conrady's: neither flags anything.
    """
    unflagged = {"Correlated"} if result.camera.model == "brown-conrady" else {"Correlated", "NotCertified"}
    return Answer(
        parameters=result.camera.parameters,
        status="ok" if result.is_usable else "not_converged",
        rotations=result.rotations,
        translations=result.translations,
        covariance=result.covariance.intrinsics,
        covariance_of=result.free,
        rmse=result.rmse_px,
        warnings=tuple(warning.message for warning in result.warnings if warning.kind not in unflagged),
        message=None if result.termination == "converged" else result.termination,
        pose_covariances=result.covariance.poses,
    )


def _of_answer(answer: Answer, problem: Problem) -> dict[str, Any]:
    said = {name: getattr(answer, name) for name in ("parameters", "status", "standard_deviations", "rmse", "warnings", "message")}
    if (answer.rotations is None) != (answer.translations is None):
        stated, missing = ("rotations", "translations") if answer.translations is None else ("translations", "rotations")
        raise ValueError(f"an Answer with {stated} and no {missing}: a pose is one of each")
    if answer.rotations is not None and answer.translations is not None:
        poses = zip(answer.rotations, answer.translations, strict=True)
        said["poses"] = [{"rotation": r, "translation": np.ravel(t)} for r, t in poses]
    if answer.covariance is not None:
        said["covariance"] = {"parameters": answer.covariance_of or problem.free, "matrix": answer.covariance}
    if answer.pose_covariances is not None:
        said["pose_covariances"] = list(answer.pose_covariances)
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

"""The certified problems as data, and the digits that the solver shares with them."""

from pathlib import Path

import pytest

import calibench

REFERENCE = Path(__file__).resolve().parents[2] / "reference"
PROBLEMS = calibench.certified_problems()
BROWN = [problem for problem in PROBLEMS if problem.model == "brown-conrady"]
OTHERS = [problem for problem in PROBLEMS if problem.model != "brown-conrady"]


def test_every_problem_of_the_source_tree_is_there() -> None:
    assert {problem.name for problem in PROBLEMS} == {path.stem for path in REFERENCE.glob("*.json")}
    levels = [problem.level for problem in PROBLEMS]
    assert len(BROWN) == 22 and {problem.model for problem in OTHERS} == {
        "rational", "thin-prism", "tilted", "kannala-brandt", "division", "double-sphere", "halcon-polynomial"
    }
    assert levels == sorted(levels, key=["lower", "average", "higher"].index) and set(levels) == {"lower", "average", "higher"}


@pytest.mark.parametrize("problem", BROWN, ids=lambda problem: problem.name)
def test_a_polished_calibration_has_the_certified_digits(problem: calibench.records.CertifiedProblem) -> None:
    result = calibench.calibrate(
        problem.points, problem.pixels, free=problem.free, hold=problem.hold, image_size=problem.image_size, polish=True
    )
    assert result.degrees_of_freedom == problem.degrees_of_freedom
    parameters = [calibench.digits(result.camera.parameters[name], value) for name, value in problem.parameters.items()]
    deviations = [calibench.digits(result.standard_deviations[name], sd) for name, sd in problem.standard_deviations.items()]
    assert min(parameters) >= LEAST_DIGITS
    # Standard deviations come from equations formed in double precision.
    assert min(deviations) >= 6.0 and calibench.digits(result.rmse_px, problem.rmse_px) >= 9.0


@pytest.mark.parametrize("problem", OTHERS, ids=lambda problem: problem.name)
def test_a_calibration_of_another_lens_has_six_certified_digits(problem: calibench.records.CertifiedProblem) -> None:
    result = calibench.calibrate(
        problem.points, problem.pixels, model=problem.model, free=problem.free, hold=problem.hold, image_size=problem.image_size
    )
    assert result.camera.model == problem.model and result.degrees_of_freedom == problem.degrees_of_freedom
    assert min(calibench.digits(result.camera.parameters[name], value) for name, value in problem.parameters.items()) >= 6.0
    assert calibench.digits(result.rmse_px, problem.rmse_px) >= 9.0


# The snapshot of certified-digits has 15 of every problem, within 1.
LEAST_DIGITS = 14.0


def test_digits_are_counted_from_the_relative_error() -> None:
    assert calibench.digits(600.0, 600.0) == 15.0 and calibench.digits(float("nan"), 600.0) == 0.0
    assert calibench.digits(600.0006, 600.0) == pytest.approx(6.0, abs=1e-9)

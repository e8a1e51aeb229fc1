"""The gate in Python: functions, programs, the decorator for pytest and the command."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import calibench

ROOT = Path(__file__).resolve().parents[2]
TEST_FILE = """
import calibench

def solve(problem):
    return calibench.calibrate(
        problem.points, problem.pixels, free=problem.free, hold=problem.hold, image_size=problem.image_size
    )

@calibench.gate(samples=32)
def test_right(problem):
    return solve(problem)

@calibench.gate(samples=32)
def test_wrong(problem):
    result = solve(problem)
    parameters = result.camera.parameters
    parameters["fx"] += 3.0 * result.standard_deviations.get("fx", 0.0)
    return calibench.Answer(parameters, covariance=result.covariance.intrinsics)
"""


def ours(problem: calibench.Problem) -> calibench.Calibration:
    return calibench.calibrate(
        problem.points, problem.pixels, free=problem.free, hold=problem.hold, image_size=problem.image_size
    )


def verdicts(report: calibench.Report) -> list[tuple[str, str, str, str]]:
    """What was found; times are another every time."""
    return [(c.property, c.scenario, c.verdict, c.evidence) for c in report.checks if c.property != "time"]


def test_this_librarys_solver_is_judged_alike_in_rust_and_in_python() -> None:
    builtin, python = calibench.run_gate(samples=8), calibench.run_gate(ours, samples=8)
    assert builtin.held and python.held and builtin.problems == python.problems > 300
    assert verdicts(builtin) == verdicts(python)
    assert python.solver == "ours" and "ours" in python.to_text()
    assert python.to_json().startswith("{") and "<testsuite" in python.to_junit() and "<html" in python.to_html()


def test_an_exception_of_a_solver_is_a_finding_and_a_refusal_is_none() -> None:
    def broken(problem: calibench.Problem) -> calibench.Answer:
        raise KeyError("no such solver")

    report = calibench.run_gate(broken, samples=1)
    assert not report.held
    assert any("no such solver" in check.evidence for check in report.checks)

    def refusing(problem: calibench.Problem) -> calibench.Answer:
        raise calibench.CalibrationError("no")

    # Who refuses everything is not trusted, but breaks no protocol and is no confident wrong answer.
    refused = calibench.run_gate(refusing, samples=1)
    assert not refused.held and refused.verdict == "FAILED"
    assert {c.property for c in refused.checks if c.verdict == "FAILED"} == {"exactness"}


@pytest.mark.parametrize(
    "answer",
    [lambda problem: {"status": "ok"}, lambda problem: {"statsu": 1}, lambda problem: calibench.Answer({"fx": float("nan")})],
    ids=["without parameters", "no answer", "not finite"],
)
def test_an_answer_that_is_none_is_a_finding(answer: Callable[[calibench.Problem], dict]) -> None:
    report = calibench.run_gate(answer, samples=1)
    assert any(check.property == "protocol" and check.verdict == "FAILED" for check in report.checks)


def test_wrong_options_are_refused() -> None:
    for options in ({"samples": 0}, {"false_alarms": 0.0}, {"accept": ["speed"]}, {"samples": 10**9}):
        with pytest.raises(ValueError):
            calibench.run_gate(**options)


def test_the_decorator_makes_one_test_a_property(tmp_path: Path) -> None:
    (tmp_path / "test_solver.py").write_text(TEST_FILE)
    command = [sys.executable, "-m", "pytest", "-rfs", "--no-header", "-p", "no:cacheprovider", str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    properties = calibench.gate_properties()
    assert run.returncode == 1
    failed = [line for line in run.stdout.splitlines() if line.startswith("FAILED test_solver.py")]
    assert not any("test_right" in line for line in failed)
    assert "FAILED test_solver.py::test_wrong[bias]" in run.stdout
    # What is wrong stands in the message: the scene, the parameter and by how much.
    assert "FAILED four-pose: largest bias fx of 3.06 standard deviations" in run.stdout
    collected = subprocess.run([*command, "--collect-only", "-q"], capture_output=True, text=True, cwd=tmp_path)
    assert collected.stdout.count("::test_right[") == len(properties)
    more = subprocess.run([*command, "-k", "test_right and bias", "--gate-samples", "2", "--gate-seed", "5"], capture_output=True, text=True)
    assert "1 passed" in more.stdout, more.stdout


def gate_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "calibench", "gate", *arguments], capture_output=True, text=True)


def test_the_command_judges_programs_with_the_exit_codes_of_the_rust_command(tmp_path: Path) -> None:
    solver = f"{sys.executable} {ROOT / 'adapters/minimal_solver.py'}"
    trusted = gate_command(solver, "--samples", "1", "--json", str(tmp_path / "report.json"))
    assert trusted.returncode == 0, trusted.stdout + trusted.stderr
    assert "minimal_solver.py" in trusted.stdout and (tmp_path / "report.json").stat().st_size > 1000
    assert gate_command("cat", "--samples", "1", "--timeout", "2").returncode == 1
    assert gate_command("--samples", "none").returncode == 2
    assert gate_command("--accept", "speed").returncode == 2
    assert gate_command("--samples", "1").returncode == 0

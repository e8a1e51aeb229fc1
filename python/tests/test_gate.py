"""The gate in Python: functions, programs, the decorator for pytest and the command."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
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
        problem.points,
        problem.pixels,
        model=problem.model,
        free=problem.free,
        hold=problem.hold,
        image_size=problem.image_size,
    )


def verdicts(report: calibench.Report) -> list[tuple[str, str, str, str]]:
    """What was found; times are another every time."""
    return [(c.property, c.scenario, c.verdict, c.evidence) for c in report.checks if c.property != "time"]


def test_this_librarys_solver_is_judged_alike_in_rust_and_in_python() -> None:
    models = ("brown-conrady", "division", "kannala-brandt")
    builtin, python = calibench.run_gate(samples=8, models=models), calibench.run_gate(ours, samples=8, models=models)
    assert builtin.held and python.held and builtin.problems == python.problems > 300
    assert verdicts(builtin) == verdicts(python)
    assert python.solver == "ours" and "ours" in python.to_text()
    assert python.to_json().startswith("{") and "<testsuite" in python.to_junit() and "<html" in python.to_html()


def test_pose_covariances_in_degrees_are_found() -> None:
    def degrees(problem: calibench.Problem) -> calibench.Answer:
        result = ours(problem)
        unit = np.diag([180.0 / np.pi] * 3 + [1.0] * 3)
        covariances = [unit @ covariance @ unit for covariance in result.covariance.poses]
        return calibench.Answer(
            result.camera.parameters,
            rotations=result.rotations,
            translations=result.translations,
            covariance=result.covariance.intrinsics,
            pose_covariances=covariances,
        )

    report = calibench.run_gate(degrees, samples=4, scenes="four-pose")
    assert {check.property for check in report.checks if check.verdict in ("FAILED", "GRAVE")} == {"pose-covariance"}


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
    for options in ({"samples": 0}, {"false_alarms": 0.0}, {"accept": ["speed"]}, {"samples": 10**9}, {"models": ["pin"]}, {"scenes": ["moon"]}):
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


def test_a_program_names_the_lenses_it_knows(tmp_path: Path) -> None:
    program = tmp_path / "greets.py"
    program.write_text("""
import json, sys
print(json.dumps({"protocol": 2, "models": ["division"]}), flush=True)
for line in sys.stdin:
    print(json.dumps({"id": json.loads(line)["id"], "status": "refused"}), flush=True)
""")
    report = calibench.run_gate(f"{sys.executable} {program}", samples=1)
    assert {check.scenario for check in report.checks} == {"division"} and not report.held


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
    one = gate_command("--samples", "1", "--models", "division,rational", "--scene", "division")
    assert one.returncode == 0 and "HELD on the scenes asked" in one.stdout


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--samples", "-5"], "samples = -5: expected a whole number from 1 on"),
        (["--samples", "0"], "samples = 0"),
        (["--samples", "some"], "samples = 'some': expected quick, thorough or a whole number"),
        (["--seed", "-1"], "seed = -1: expected a whole number from 0 on"),
        (["--seed", str(2**64)], "expected a whole number below 2^64"),
        (["cat", "--jobs", "-1"], "jobs = -1: expected a whole number from 1 on"),
        (["cat", "--jobs", "0"], "jobs = 0"),
        (["cat", "--jobs", "1000000000"], "expected 1 to 1024"),
        (["cat", "--timeout", "nan"], "timeout must be a positive number"),
        (["--median-time", "-1"], "median_time = -1: expected a positive number"),
        ([""], "an empty command"),
        (["  "], "an empty command"),
        (["--json", "/no/such/directory/report.json"], "there is no directory /no/such/directory"),
        (["--html", "/"], "a directory"),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(arguments: list[str], text: str) -> None:
    done = gate_command(*arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert text in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr


def test_a_report_that_cannot_be_written_after_the_run_leaves_the_verdict(tmp_path: Path) -> None:
    # The program itself takes the directory away.
    folder = tmp_path / "reports"
    folder.mkdir()
    done = gate_command(f"rm -r {folder}; exit 1", "--samples", "1", "--json", str(folder / "a.json"))
    assert done.returncode == 3 and "NOT TRUSTED" in done.stdout.upper()
    assert f"calibench: {folder / 'a.json'}: No such file or directory" in done.stderr


def test_options_of_wrong_kind_are_named() -> None:
    for options, text in (
        ({"samples": "fast"}, "samples = 'fast': expected quick, thorough or a whole number"),
        ({"samples": 2.5}, "samples = 2.5"),
        ({"seed": -1}, "seed = -1"),
        ({"seed": "one"}, "seed = 'one'"),
        ({"accept": "speed"}, 'no property "speed"'),
        ({"accept": [3]}, "accept: 3 is no name"),
        ({"median_time": float("nan")}, "median_time = NaN"),
    ):
        with pytest.raises(ValueError, match=text):
            calibench.run_gate(**options)
    assert "bias" not in [c.property for c in calibench.run_gate(samples=1, accept="bias", scenes="four-pose").checks if c.verdict == "FAILED"]
    with pytest.raises(TypeError, match="solver = 5: expected a function"):
        calibench.run_gate(5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="empty command"):
        calibench.run_gate("")


def test_an_answer_of_another_kind_is_told_and_half_a_pose_is_a_finding() -> None:
    report = calibench.run_gate(lambda problem: None, samples=1, scenes=["four-pose"])  # type: ignore[arg-type, return-value]
    assert any("returned None, expected Answer, Calibration or dict" in check.evidence for check in report.checks)

    def half(problem: calibench.Problem) -> calibench.Answer:
        return calibench.Answer(ours(problem).camera.parameters, rotations=ours(problem).rotations)

    found = calibench.run_gate(half, samples=1, scenes=["four-pose"])
    assert not found.held and any("rotations and no translations" in check.evidence for check in found.checks)


def test_the_traceback_of_a_solver_is_shown_once(capfd: pytest.CaptureFixture[str]) -> None:
    def broken(problem: calibench.Problem) -> calibench.Answer:
        raise KeyError("fx")

    assert not calibench.run_gate(broken, samples=2).held
    told = capfd.readouterr().err
    assert told.count("Traceback (most recent call last)") == 1 and 'raise KeyError("fx")' in told and "KeyError: 'fx'" in told


def refused_decorations() -> list[tuple[str, Callable[[], object], str]]:
    class Tests:
        def test_method(self, problem: calibench.Problem) -> None: ...

    async def test_async(problem: calibench.Problem) -> None: ...

    def test_fixture(problem: calibench.Problem, tmp_path: Path) -> None: ...

    def test_nothing() -> None: ...

    return [
        ("method", lambda: calibench.gate()(Tests.test_method), "test_method\\(self, problem\\): .* a method has self"),  # type: ignore[arg-type]
        ("async", lambda: calibench.gate()(test_async), "plain functions"),  # type: ignore[arg-type]
        ("fixture", lambda: calibench.gate()(test_fixture), "test_fixture\\(problem, tmp_path\\)"),  # type: ignore[arg-type]
        ("nothing", lambda: calibench.gate()(test_nothing), "test_nothing\\(\\)"),  # type: ignore[arg-type]
        ("no function", lambda: calibench.gate()(3), "not 3"),  # type: ignore[arg-type]
        ("no parentheses", lambda: calibench.gate(ours), "write @calibench.gate\\(\\)"),
    ]


@pytest.mark.parametrize(("name", "decorate", "text"), refused_decorations(), ids=lambda value: value if isinstance(value, str) else "")
def test_what_cannot_be_asked_is_refused_where_it_is_decorated(name: str, decorate: Callable[[], object], text: str) -> None:
    with pytest.raises(TypeError, match=text):
        decorate()


def test_marks_are_kept_and_options_of_the_command_line_are_checked(tmp_path: Path) -> None:
    (tmp_path / "test_marked.py").write_text("""
import calibench, pytest

@calibench.gate(samples=1)
@pytest.mark.skipif(True, reason="not here")
def test_marked(problem):
    raise SystemExit("it was asked")

@pytest.mark.skipif(True, reason="nor here")
@calibench.gate(samples=1)
def test_marked_above(problem):
    raise SystemExit("it was asked")
""")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert run.returncode == 0 and f"{2 * len(calibench.gate_properties())} skipped" in run.stdout
    for option, value in (("--gate-samples", "0"), ("--gate-samples", "-1"), ("--gate-seed", "-1"), ("--gate-seed", "x")):
        wrong = subprocess.run([*command, f"{option}={value}"], capture_output=True, text=True, cwd=tmp_path)
        assert wrong.returncode == 4 and f"'{value}': expected" in wrong.stderr and "Traceback" not in wrong.stderr, wrong.stderr

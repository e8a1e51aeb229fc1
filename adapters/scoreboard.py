"""Public calibrators before one judge: which are trusted, how many digits they reach, how long they take.

    pip install calibench
    python3 adapters/scoreboard.py [NAME...] [--write README.md]

Each is installed from PyPI into a virtual environment of its own below target/scoreboard and only run. All go through the same pipe. What cannot
be installed is named and left out. A row is repeated by its name: `python3 adapters/scoreboard.py opencv-5`.
"""

import argparse
import json
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import calibench

ADAPTERS = Path(__file__).resolve().parent
VENVS = ADAPTERS.parent / "target/scoreboard"
BEGIN, END = "<!-- begin scoreboard -->", "<!-- end scoreboard -->"


@dataclass(frozen=True)
class Entry:
    """A calibrator, how it is run, and what is fair to say of it."""

    name: str
    packages: tuple[str, ...]
    """To be installed, the calibrator first."""
    adapter: str
    licence: str
    note: str


ENTRIES = [
    Entry("calibench", ("calibench", "numpy"), "calibench_solver.py", "MIT or Apache-2.0", "whose gate this is; not polished"),
    Entry("opencv-4", ("opencv-python-headless<5", "numpy"), "opencv_solver.py", "Apache-2.0",
          "200 iterations to machine precision; its binding takes points in single precision"),
    Entry("opencv-5", ("opencv-python-headless>=5", "numpy"), "opencv_solver.py", "Apache-2.0",
          "200 iterations to machine precision; its binding takes points in single precision"),
    Entry("scipy", ("scipy", "numpy"), "scipy_solver.py", "BSD-3-Clause", "a general solver: start and camera are the adapter's"),
    Entry("lensboy", ("lensboy", "numpy"), "lensboy_solver.py", "not stated in the package",
          "its OpenCV model without warp and outliers; made for richer lenses, states no covariance"),
    Entry("vision-calibration", ("vision-calibration",), "vision_calibration_solver.py", "MIT",
          "200 iterations, no robust loss; states no covariance; an alpha release"),
]


@dataclass(frozen=True)
class Score:
    """A row of the table."""

    entry: Entry
    version: str
    report: calibench.Report
    digits: list[float]
    """The least digits of each certified problem that was answered."""

    def row(self):
        failed = sorted({check.property for check in self.report.checks if check.verdict in ("FAILED", "GRAVE")})
        unsupported = sum("not supported" in check.evidence for check in self.report.checks)
        verdict = "trusted" if self.report.held else f"not trusted: {', '.join(failed)}"
        if unsupported:
            verdict += f" ({unsupported} scenes not supported)"
        problems = len(calibench.certified_problems())
        digits = f"{median(self.digits):.1f} ({len(self.digits)} of {problems})" if self.digits else f"none of {problems}"
        milliseconds = 1e3 * self.report.seconds / self.report.problems
        cells = [self.entry.name, self.version, verdict, digits, f"{milliseconds:.2g}", self.entry.licence, self.entry.note]
        return f"| {' | '.join(cells)} |"


def installed(entry):
    """The interpreter of the calibrator's environment, and its version; `None` if it cannot be installed."""
    venv = VENVS / entry.name
    python = venv / "bin/python"
    if entry.name == "calibench":
        return Path(sys.executable), calibench.__version__
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    pip = [python, "-m", "pip", "--disable-pip-version-check"]
    done = subprocess.run([*pip, "install", "--quiet", *entry.packages], capture_output=True, text=True)
    if done.returncode != 0:
        last = done.stderr.strip().splitlines()[-1]
        print(f"SKIPPED {entry.name}: cannot be installed: {last}", file=sys.stderr)
        return None
    listed = json.loads(subprocess.run([*pip, "list", "--format", "json"], check=True, capture_output=True).stdout)
    name = entry.packages[0].split("<")[0].split(">")[0]
    return python, next(package["version"] for package in listed if package["name"] == name)


def digits_reached(command):
    """The least digits over the parameters of every certified problem that the program answers."""
    problems = {problem.name: problem for problem in calibench.certified_problems()}
    lines = "".join(line_of(problem) + "\n" for problem in problems.values())
    said = subprocess.run(shlex.split(command), input=lines, capture_output=True, text=True, timeout=1800).stdout
    answers = [json.loads(line) for line in said.splitlines()]
    return [
        min(calibench.digits(answer["parameters"][name], value) for name, value in problems[answer["id"]].parameters.items())
        for answer in answers
        if answer["status"] == "ok"
    ]


def line_of(problem):
    """A certified problem in the protocol's words."""
    views = [{"target": p.tolist(), "pixels": q.tolist()} for p, q in zip(problem.points, problem.pixels)]
    fields = {"id": problem.name, "image_size": problem.image_size, "views": views, "free": problem.free, "held": problem.hold}
    return json.dumps(fields)


def score(entry, samples):
    found = installed(entry)
    if found is None:
        return None
    python, version = found
    command = f"{python} {ADAPTERS / entry.adapter}"
    report = calibench.run_gate(command, samples=samples, timeout=60.0)
    return Score(entry, version, report, digits_reached(command))


def table(scores):
    head = ["calibrator", "version", "the gate says", "certified digits, median (answered)", "ms a problem", "licence", "fairness"]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|", *(score.row() for score in scores)]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(entry.name for entry in ENTRIES)} [default: all]")
    parser.add_argument("--samples", type=int, default=128, help="samples a scene")
    parser.add_argument("--write", type=Path, help="puts the table between its marks in this file")
    given = parser.parse_args()
    chosen = [entry for entry in ENTRIES if not given.names or entry.name in given.names]
    scores = []
    for entry in chosen:
        print(f"{entry.name} ...", file=sys.stderr, flush=True)
        scores.append(score(entry, given.samples))
    text = table([found for found in scores if found is not None])
    print(text)
    if given.write:
        before, rest = given.write.read_text().split(BEGIN)
        given.write.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()

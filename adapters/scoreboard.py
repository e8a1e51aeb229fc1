"""Public calibrators before one judge: which are trusted, how many digits they reach, whether they find the right minimum, how long they take.

    pip install ./python
    python3 adapters/scoreboard.py [NAME...] [--write]

Each is installed from PyPI into a virtual environment of its own below target/scoreboard, or is Debian's, and only run. All go through the same
pipe. What cannot be installed is named and left out. A row is repeated by its name: `python3 adapters/scoreboard.py opencv-5`.
"""

import argparse
import csv
import json
import resource
import shlex
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import calibench

ADAPTERS = Path(__file__).resolve().parent
VENVS = ADAPTERS.parent / "target/scoreboard"
DEBIAN = "debian:"
DETERMINED = 0.02
"""Bound of sd(fx)/fx below which data determine the camera, as in the experiment global-minimum."""
ROWS, PAGE = ADAPTERS.parent / "golden/scoreboard.csv", ADAPTERS / "SCOREBOARD.md"
TIMED_ON = "tangential"
"""The certified problem that every row answers, on which all are timed."""
REPEATED = 201
"""How often a problem is answered to time it."""
SAMPLES, FIRST = 32, 1000
"""Samples a scene, and scenes of a family, of the page's rows."""
OURS = f"{sys.executable} {ADAPTERS / 'calibench_solver.py'}"
SCENES = "cargo run --release --quiet --bin global-minimum-scenes --"
BEGIN, END = "<!-- begin scoreboard -->", "<!-- end scoreboard -->"


@dataclass(frozen=True)
class Entry:
    """A calibrator, how it is run, and what is fair to say of it."""

    name: str
    packages: tuple[str, ...]
    """To be installed, the calibrator first; of Debian's where it starts with `debian:`."""
    adapter: str
    licence: str
    note: str
    first: int = 50
    """At most so many scenes of each family of the experiment global-minimum."""


ENTRIES = [
    Entry("calibench", ("calibench", "numpy"), "calibench_solver.py", "MIT or Apache-2.0", "whose gate this is; not polished"),
    Entry("opencv-4", ("opencv-python-headless<5", "numpy"), "opencv_solver.py", "Apache-2.0",
          "200 iterations to machine precision; its binding takes points in single precision"),
    Entry("opencv-5", ("opencv-python-headless>=5", "numpy"), "opencv_solver.py", "Apache-2.0",
          "200 iterations to machine precision; its binding takes points in single precision"),
    Entry("scipy", ("scipy", "numpy"), "scipy_solver.py", "BSD-3-Clause",
          "a general solver: start and camera are the adapter's, the finite differences SciPy's; not asked for the right minimum, since fifty views take it minutes", first=0),
    Entry("lensboy", ("lensboy", "numpy"), "lensboy_solver.py", "not stated in the package",
          "its OpenCV model without warp and outliers; its convergence cannot be set; made for richer lenses, states no covariance"),
    Entry("colmap", ("pycolmap", "pyceres", "numpy"), "colmap_solver.py", "BSD-3-Clause",
          "its bundle adjustment, made for scenes; start and held coefficients are the adapter's"),
    Entry("mrcal", ("debian:python3-mrcal",), "mrcal_solver.py", "Apache-2.0",
          "frees all coefficients of a lens together, so that few scenes can be asked; start and covariance are the adapter's"),
    Entry("vision-calibration", ("vision-calibration",), "vision_calibration_solver.py", "MIT",
          "200 iterations, no robust loss; states no covariance; an alpha release"),
]


@dataclass(frozen=True)
class Timed:
    """Processor time of a problem, beside that of this library on the same one."""

    problem: str
    milliseconds: float
    ours: float


@dataclass(frozen=True)
class Score:
    """A row of the table."""

    entry: Entry
    version: str
    report: calibench.Report
    digits: dict[str, float]
    """The least digits of each certified problem that was answered."""
    timed: Timed | None
    """Processor time of a problem; `None` where none was answered."""
    endings: Counter
    """How it ended on the scenes of the experiment global-minimum that determine the camera."""

    def row(self):
        checks = self.report.checks
        failed = sorted({check.property for check in checks if check.verdict in ("FAILED", "GRAVE")})
        unsupported = sum("not supported" in check.evidence for check in checks)
        asked = self.endings.total() - self.endings["unsupported"]
        return {
            "calibrator": self.entry.name,
            "version": self.version,
            "the gate says": "trusted" if self.report.held else f"not trusted: {', '.join(failed)}",
            "scenes not supported": str(unsupported),
            "certified digits, median": f"{median(self.digits.values()):.1f}" if self.digits else "-",
            "certified problems answered": f"{len(self.digits)} of {len(certified_problems())}",
            "right minimum": f"{self.endings['right']} of {asked}" if asked else "-",
            "processor ms a problem": two_digits(self.timed.milliseconds) if self.timed else "-",
            "timed on": self.timed.problem if self.timed else "-",
            "calibench's ms on it": two_digits(self.timed.ours) if self.timed else "-",
            "licence": self.entry.licence,
            "fairness": self.entry.note,
        }


def two_digits(number):
    """As people write it: 170, not 1.7e+02."""
    return f"{float(f'{number:.2g}'):g}"


def installed(entry):
    """The interpreter of the calibrator's environment, and its version; `None` if it cannot be installed."""
    venv = VENVS / entry.name
    python = venv / "bin/python"
    if entry.name == "calibench":
        return Path(sys.executable), calibench.__version__
    if entry.packages[0].startswith(DEBIAN):
        return of_debian(entry)
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


def of_debian(entry):
    """The system's interpreter and the package's version; `None` if it is not there."""
    package = entry.packages[0].removeprefix(DEBIAN)
    asked = ["dpkg-query", "--show", "--showformat", "${Version}", package]
    try:
        done = subprocess.run(asked, capture_output=True, text=True)
    except FileNotFoundError:
        done = None
    if done is None or done.returncode != 0 or not done.stdout:
        print(f"SKIPPED {entry.name}: apt-get install {package}", file=sys.stderr)
        return None
    return Path("/usr/bin/python3"), done.stdout


def endings_of(entry, command, most, scenes):
    """How the program ends on the first scenes of each family whose data determine the camera."""
    if most == 0:
        return Counter()
    VENVS.mkdir(parents=True, exist_ok=True)
    out = VENVS / f"{entry.name}.csv"
    peer = ["--peer", entry.name, "--solver", command, "--jobs", "2", "--first", str(min(entry.first, most)), "--out", str(out)]
    subprocess.run([*shlex.split(scenes), *peer], check=True, cwd=ADAPTERS.parent)
    with open(out, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return Counter(row["ending"] for row in rows if float(row["bound"]) < DETERMINED)


def certified_problems():
    """The certified problems of Brown-Conrady's lens, which every calibrator of the table knows."""
    return [problem for problem in calibench.certified_problems() if problem.model == "brown-conrady"]


def digits_reached(command):
    """The least digits over the parameters of every certified problem that the program answers."""
    problems = {problem.name: problem for problem in certified_problems()}
    lines = "".join(line_of(problem) + "\n" for problem in problems.values())
    said = subprocess.run(shlex.split(command), input=lines, capture_output=True, text=True, timeout=1800).stdout
    # A greeting has no number of a problem.
    answers = [answer for answer in map(json.loads, said.splitlines()) if "id" in answer]
    return {
        answer["id"]: min(
            calibench.digits(answer["parameters"][name], value) for name, value in problems[answer["id"]].parameters.items()
        )
        for answer in answers
        if answer["status"] == "ok"
    }


def line_of(problem):
    """A certified problem in the protocol's words."""
    views = [{"target": p.tolist(), "pixels": q.tolist()} for p, q in zip(problem.points, problem.pixels)]
    fields = {"id": problem.name, "image_size": problem.image_size, "views": views, "free": problem.free, "held": problem.hold}
    return json.dumps(fields)


def timed(command, answered):
    """The processor time of a problem: of the one that all rows are timed on, or of the first that is answered where that is not."""
    problems = {problem.name: problem for problem in certified_problems()}
    name = next((name for name in (TIMED_ON, *problems) if name in answered), None)
    if name is None:
        return None
    line = line_of(problems[name])
    return Timed(name, processor_ms(command, line), processor_ms(OURS, line))


def processor_ms(command, line):
    """Processor time of the problem of a line: of many less that of one, over their difference."""
    taken = []
    for count in (1, REPEATED):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(shlex.split(command), input=(line + "\n") * count, capture_output=True, text=True, timeout=1800)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return 1e3 * (taken[1] - taken[0]) / (REPEATED - 1)


def score(entry, samples, first, scenes):
    found = installed(entry)
    if found is None:
        return None
    python, version = found
    command = f"{python} {ADAPTERS / entry.adapter}"
    # All rows answer the same questions, whatever else a program knows.
    report = calibench.run_gate(command, samples=samples, models=["brown-conrady"], timeout=60.0)
    digits = digits_reached(command)
    return Score(entry, version, report, digits, timed(command, digits), endings_of(entry, command, first, scenes))


def table(rows):
    """The rows for a page."""
    lines = [rows[0].keys(), ["---"] * len(rows[0]), *(row.values() for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def written(rows):
    """Puts the rows in the places of those of the same name, and writes them and the page."""
    known = {}
    if ROWS.exists():
        with open(ROWS, newline="") as file:
            known = {row["calibrator"]: row for row in csv.DictReader(file)}
    known |= {row["calibrator"]: row for row in rows}
    ordered = [known[entry.name] for entry in ENTRIES if entry.name in known]
    with open(ROWS, "w", newline="") as file:
        writer = csv.DictWriter(file, ordered[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(ordered)
    before, rest = PAGE.read_text().split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{table(ordered)}{END}{rest.split(END)[1]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(entry.name for entry in ENTRIES)} [default: all]")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="samples a scene")
    first = "at most so many scenes of a family of the experiment global-minimum; 0: none are asked"
    parser.add_argument("--first", type=int, default=FIRST, help=first)
    parser.add_argument("--scenes", default=SCENES, help="the command that asks about them [default: %(default)s]")
    parser.add_argument("--write", action="store_true", help="puts the rows into golden/scoreboard.csv and adapters/SCOREBOARD.md")
    given = parser.parse_args()
    known = [entry.name for entry in ENTRIES]
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"no calibrator {', '.join(unknown)}; there are: {', '.join(known)}")
    if given.samples < 1 or given.first < 0:
        parser.error("--samples is at least 1, --first at least 0")
    if given.write and (given.samples, given.first, given.scenes) != (SAMPLES, FIRST, SCENES):
        parser.error(f"--write writes what the page says: --samples {SAMPLES}, --first {FIRST} and the usual --scenes")
    rows = []
    for entry in ENTRIES:
        if given.names and entry.name not in given.names:
            continue
        print(f"{entry.name} ...", file=sys.stderr, flush=True)
        found = score(entry, given.samples, given.first, given.scenes)
        rows += [found.row()] if found else []
        if found and given.write:
            written(rows[-1:])
    if rows:
        print(table(rows), end="")


if __name__ == "__main__":
    main()

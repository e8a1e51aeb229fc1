"""``python -m calibench gate 'COMMAND'``: judges a program that speaks the gate's protocol.

Exit codes: 0 trusted, 1 not trusted, 2 wrong usage, 3 interrupted.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from . import __version__
from .gate import run_gate


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m calibench", description="A test bench for camera calibration.")
    parser.add_argument("--version", action="version", version=f"calibench {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True)
    gate = verbs.add_parser("gate", help="judges a solver: this library's, or any program that speaks the protocol")
    gate.add_argument("command", nargs="?", help="reads problems, writes answers, one JSON object a line [default: this library's solver]")
    gate.add_argument("--samples", default="quick", help="samples a scene: quick (128), thorough (8192) or a number")
    gate.add_argument("--seed", type=int, default=1, help="seed of the noise")
    gate.add_argument("--false-alarms", type=float, default=1e-3, metavar="RATE", help="chance that a correct solver fails the run")
    gate.add_argument("--accept", action="append", default=[], metavar="PROPERTY", help="a property whose failure is known; may be repeated")
    gate.add_argument("--median-time", type=float, metavar="SECONDS", help="longest median time for a problem")
    gate.add_argument("--timeout", type=float, default=20.0, metavar="SECONDS", help="that the program may take for a problem")
    gate.add_argument("--jobs", type=int, default=1, metavar="N", help="copies of the program that run at the same time")
    for form in ("json", "junit", "html"):
        gate.add_argument(f"--{form}", type=Path, metavar="FILE", help=f"writes the report as {form}")
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; the exit code."""
    given = _arguments().parse_args(arguments)
    try:
        report = run_gate(
            given.command,
            samples=given.samples if given.samples in ("quick", "thorough") else int(given.samples),
            seed=given.seed,
            false_alarms=given.false_alarms,
            accept=given.accept,
            median_time=given.median_time,
            timeout=given.timeout,
            jobs=given.jobs,
        )
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 3
    except ValueError as error:
        print(f"calibench: {error}", file=sys.stderr)
        return 2
    for path, text in ((given.json, report.to_json), (given.junit, report.to_junit), (given.html, report.to_html)):
        if path is not None:
            path.write_text(text(), encoding="utf-8")
    print(report.to_text(shutil.get_terminal_size().columns if sys.stdout.isatty() else 132), end="")
    if not report.held:
        print(report.details(), file=sys.stderr)
    return 0 if report.held else 1


if __name__ == "__main__":
    sys.exit(main())

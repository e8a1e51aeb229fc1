"""``python -m calibench gate 'COMMAND'``: judges a program that speaks the gate's protocol.

Exit codes: 0 trusted, 1 not trusted, 2 wrong usage, 3 interrupted, or a report that could not be written.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Callable
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
    gate.add_argument("--models", default="", metavar="NAMES", help="lens models that are asked [default: those that the program says it knows]")
    gate.add_argument("--scene", action="append", default=[], metavar="SCENE", help="the only scene to ask; may be repeated")
    gate.add_argument("--timeout", type=float, default=20.0, metavar="SECONDS", help="that the program may take for a problem")
    gate.add_argument("--jobs", type=int, default=1, metavar="N", help="copies of the program that run at the same time")
    for form in ("json", "junit", "html"):
        gate.add_argument(f"--{form}", type=Path, metavar="FILE", help=f"writes the report as {form}")
    return parser


def _cannot_be_written(paths: list[Path]) -> str | None:
    """Why one of the files could not be written after the run, as far as that can be seen before."""
    for path in paths:
        if path.is_dir():
            return f"{path}: a directory"
        if not path.parent.is_dir():
            return f"{path}: there is no directory {path.parent}"
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            return f"{path}: not writable"
    return None


def _write(reports: list[tuple[Path, Callable[[], str]]]) -> bool:
    """Whether every report could be written; those that could not be are named."""
    written = True
    for path, text in reports:
        try:
            path.write_text(text(), encoding="utf-8")
        except OSError as error:
            print(f"calibench: {path}: {error.strerror or error}", file=sys.stderr)
            written = False
    return written


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; the exit code."""
    given = _arguments().parse_args(arguments)
    files: list[Path] = [path for path in (given.json, given.junit, given.html) if path is not None]
    if refused := _cannot_be_written(files):
        print(f"calibench: {refused}", file=sys.stderr)
        return 2
    try:
        report = run_gate(
            given.command,
            samples=int(given.samples) if given.samples.lstrip("+-").isdecimal() else given.samples,
            seed=given.seed,
            false_alarms=given.false_alarms,
            accept=given.accept,
            median_time=given.median_time,
            models=[name for name in given.models.split(",") if name],
            scenes=given.scene,
            timeout=given.timeout,
            jobs=given.jobs,
        )
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 3
    except ValueError as error:
        print(f"calibench: {error}", file=sys.stderr)
        return 2
    print(report.to_text(shutil.get_terminal_size().columns if sys.stdout.isatty() else 132), end="")
    if not report.held:
        print(report.details(), file=sys.stderr)
    reports = ((given.json, report.to_json), (given.junit, report.to_junit), (given.html, report.to_html))
    if not _write([(path, text) for path, text in reports if path is not None]):
        return 3
    return 0 if report.held else 1


if __name__ == "__main__":
    sys.exit(main())

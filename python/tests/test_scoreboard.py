"""The scoreboard of adapters/: its script runs, and its rows are of programs that are there."""

import csv
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ADAPTERS = Path(__file__).resolve().parents[2] / "adapters"


def test_this_librarys_row_is_measured_through_the_pipe_of_all_others() -> None:
    command = [sys.executable, str(ADAPTERS / "scoreboard.py"), "calibench", "--samples", "1", "--first", "0"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    row = done.stdout.splitlines()[-1].split(" | ")
    assert row[0] == "| calibench" and row[2] == "trusted" and row[5] == "22 of 22"


    # Timed on the problem of all others, and beside itself.
    assert row[8] == "tangential" and 0.2 < float(row[7]) / float(row[9]) < 5.0


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["opencv"], "no calibrator opencv; there are: calibench, opencv-4"),
        (["calibench", "--first", "0", "--write"], "--write writes what the page says"),
        (["calibench", "--samples", "1", "--write"], "--write writes what the page says"),
        (["calibench", "--samples", "0"], "--samples is at least 1"),
        (["calibench", "--first", "-1"], "--first at least 0"),
    ],
)
def test_what_the_page_does_not_say_is_not_written(arguments: list[str], text: str) -> None:
    done = subprocess.run([sys.executable, str(ADAPTERS / "scoreboard.py"), *arguments], capture_output=True, text=True)
    assert done.returncode == 2 and text in done.stderr, done.stderr


def test_every_row_of_the_page_is_timed_on_one_problem_beside_this_library() -> None:
    with open(ADAPTERS.parent / "golden/scoreboard.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) >= 7 and {row["timed on"] for row in rows} == {"tangential"}
    assert all(float(row["processor ms a problem"]) > 0.0 and float(row["calibench's ms on it"]) > 0.0 for row in rows)


def test_every_entry_has_its_adapter() -> None:
    spec = importlib.util.spec_from_file_location("scoreboard", ADAPTERS / "scoreboard.py")
    assert spec is not None and spec.loader is not None
    scoreboard = importlib.util.module_from_spec(spec)
    sys.modules["scoreboard"] = scoreboard
    spec.loader.exec_module(scoreboard)
    assert all((ADAPTERS / entry.adapter).is_file() for entry in scoreboard.ENTRIES)
    assert len({entry.name for entry in scoreboard.ENTRIES}) == len(scoreboard.ENTRIES)

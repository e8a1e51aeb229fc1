"""The scoreboard of adapters/: its script runs, and its rows are of programs that are there."""

import importlib.util
import subprocess
import sys
from pathlib import Path

ADAPTERS = Path(__file__).resolve().parents[2] / "adapters"


def test_this_librarys_row_is_measured_through_the_pipe_of_all_others() -> None:
    command = [sys.executable, str(ADAPTERS / "scoreboard.py"), "calibench", "--samples", "1", "--first", "0"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    row = done.stdout.splitlines()[-1].split(" | ")
    assert row[0] == "| calibench" and row[2] == "trusted" and row[5] == "22 of 22"


def test_every_entry_has_its_adapter() -> None:
    spec = importlib.util.spec_from_file_location("scoreboard", ADAPTERS / "scoreboard.py")
    assert spec is not None and spec.loader is not None
    scoreboard = importlib.util.module_from_spec(spec)
    sys.modules["scoreboard"] = scoreboard
    spec.loader.exec_module(scoreboard)
    assert all((ADAPTERS / entry.adapter).is_file() for entry in scoreboard.ENTRIES)
    assert len({entry.name for entry in scoreboard.ENTRIES}) == len(scoreboard.ENTRIES)

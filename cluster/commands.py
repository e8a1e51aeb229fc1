"""The lines of `calibench study commands`, for the scripts of engines: one a shard, and the one that joins them.

CALIBENCH names the program if it is not on the path. Each line runs with one thread; a shard that was begun before is continued.
"""

import os
import shlex
import subprocess

CALIBENCH = os.environ.get("CALIBENCH", "calibench")


class Shard:
    """One part of a study: its folder, and the commands that begin and continue it."""

    def __init__(self, line: str):
        words = shlex.split(line)
        self.folder = words[words.index("--out") + 1]
        self.begin = [CALIBENCH, "--threads", "1", *words[1:]]
        self.proceed = [CALIBENCH, "--threads", "1", "study", "resume", self.folder]

    def in_shell(self) -> str:
        """One line of a shell that begins the part, or continues it if it was begun."""
        manifest = shlex.quote(f"{self.folder}/manifest.json")
        return f"if [ -f {manifest} ]; then {shlex.join(self.proceed)}; else {shlex.join(self.begin)}; fi"


def _lines(spec: str, out: str, count: int, *options: str) -> list[str]:
    command = [CALIBENCH, "study", "commands", spec, "--shards", str(count), "--out", out, *options]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()


def shards(spec: str, out: str, count: int) -> list[Shard]:
    """The parts of a study."""
    return [Shard(line) for line in _lines(spec, out, count)]


def merge(spec: str, out: str, count: int) -> list[str]:
    """The command that joins them into OUT/whole."""
    (line,) = _lines(spec, out, count, "--merge")
    return [CALIBENCH, *shlex.split(line)[1:]]

"""Answers requests line by line, as this library's own side does (main.rs): `time ROW SECONDS` and `answer ROW FILE`."""

import sys
import time
from pathlib import Path

import numpy as np

# Long enough for the clock, and for what calling from Python costs to be small: groups of calls are timed together.
GROUP_SECONDS = 20e-6


def numbers(folder, name):
    """The raw numbers of a problem."""
    return np.fromfile(Path(folder) / name, dtype="<f8")


def serve(make):
    """`make(row)` returns the work of a row and the function that turns its result into numbers."""
    works = {}
    for line in sys.stdin:
        request, row, argument = line.split()
        if row not in works:
            works[row] = make(row)
        run, answer = works[row]
        if request == "time":
            reply = repr(seconds(run, float(argument)))
        else:
            np.asarray(answer(run()), dtype="<f8").tofile(argument)
            reply = "done"
        print(reply, flush=True)


def seconds(run, budget):
    """Seconds of one call: the median over about `budget` seconds of calls."""

    def timed(times):
        start = time.perf_counter()
        for _ in range(times):
            run()
        return time.perf_counter() - start

    group = min(max(1, int(GROUP_SECONDS / timed(1)) + 1), 1000)
    groups = []
    start = time.perf_counter()
    while not groups or time.perf_counter() - start < budget:
        groups.append(timed(group) / group)
    return float(np.median(groups))

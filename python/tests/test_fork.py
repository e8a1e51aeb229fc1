"""A process that was forked after a large calibration has none of the library's threads: it says so instead of waiting for ever."""

import os
import subprocess
import sys

import pytest

FORKED = """
import os, sys, numpy as np, calibench
scene = calibench.Scene.example()
stream = calibench.Stream(seed=1, scenario="fork")
poses = [calibench.looking_at_centre(tuple(stream.uniform(3, -30.0, 30.0)), 150.0) for _ in range(100)]
many = calibench.Scene(scene.camera, (640, 480), scene.points, [r for r, _ in poses], [t for _, t in poses])
pixels = many.observe(0.1, stream)
calibench.calibrate(many.points, pixels)
child = os.fork()
if child == 0:
    small = calibench.calibrate(scene.points, pixels[:4])
    assert small.termination == "converged"
    for call in (
        lambda: calibench.calibrate(many.points, pixels),
        lambda: calibench.run_gate(samples=1),
        lambda: calibench.run_gate("cat", samples=1),
        lambda: calibench.run_gate(lambda problem: None, samples=1),
        lambda: calibench.compare_models(many.points, pixels),
        lambda: calibench.fit_views(calibench.Board("circles:9x7:10mm"), pixels),
        lambda: calibench.run_study("name = 'a'"),
    ):
        try:
            call()
            os._exit(1)
        except calibench.CalibenchError as error:
            assert error.kind == "Forked" and "spawn" in str(error), error
    os._exit(0)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
calibench.calibrate(many.points, pixels)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system forks nothing")
def test_a_forked_process_says_that_it_has_no_threads() -> None:
    subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED], check=True, timeout=60)

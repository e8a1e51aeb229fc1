"""Ctrl-C in a long call raises at once, and the interpreter goes on."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

STUDY = (Path(__file__).resolve().parents[2] / "studies/four-pose.toml").read_text().replace("per_cell = 20000", "per_cell = 2000000")
LONG = """
import sys, time, numpy as np, calibench
scene = calibench.Scene.example()
stream = calibench.Stream(seed=1, scenario="long")
poses = [calibench.looking_at_centre(tuple(stream.uniform(3, -30.0, 30.0)), 150.0) for _ in range(400)]
many = calibench.Scene(scene.camera, (640, 480), scene.points, [r for r, _ in poses], [t for _, t in poses])
pixels = many.observe(0.1, stream)
print("ready", flush=True)
try:
    while True:
        {call}
except KeyboardInterrupt:
    print("heard", flush=True)
"""

CALLS = {
    "calibrate": "calibench.calibrate(many.points, pixels, intervals=0.95, polish=True)",
    "compare_models": "calibench.compare_models(many.points, pixels)",
    "gate": "calibench.run_gate(samples=2000)",
    "study": "calibench.run_study(STUDY)",
    "gate of a function": "calibench.run_gate(lambda problem: calibench.Answer(status='refused'), samples=2000)",
}


@pytest.mark.skipif(os.name == "nt", reason="a process of Windows is sent no Ctrl-C alone")
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_an_interrupt_is_heard(call: str) -> None:
    process = subprocess.Popen([sys.executable, "-c", LONG.replace("{call}", call.replace("STUDY", repr(STUDY)))], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.5)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=30)
    assert said == "heard\n" and process.returncode == 0

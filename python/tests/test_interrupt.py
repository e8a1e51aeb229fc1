"""Ctrl-C in a long call raises at once, and the interpreter goes on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

# A shell that starts the tests in its background has SIGINT ignored, and what they start would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

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


def last_words(process: subprocess.Popen[str], timeout_s: float) -> tuple[str, str]:
    """Output and errors until the end; a process that does not end is killed, so that none is left behind a test that failed."""
    try:
        return process.communicate(timeout=timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        raise


@pytest.mark.skipif(os.name == "nt", reason="a process of Windows is sent no Ctrl-C alone")
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_an_interrupt_is_heard(call: str) -> None:
    process = subprocess.Popen([sys.executable, "-c", LONG.replace("{call}", call.replace("STUDY", repr(STUDY)))], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.5)
    process.send_signal(signal.SIGINT)
    said, _ = last_words(process, 30)
    assert said == "heard\n" and process.returncode == 0


def running(word: str) -> list[str]:
    """Command lines of processes that have the word in theirs, but for this one."""
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and int(process.name) != os.getpid():
            try:
                line = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                state = (process / "stat").read_text().rsplit(")", 1)[1].split()[0]
            except OSError:
                continue
            if word in line and state != "Z":
                found.append(line)
    return found


COMMAND = [sys.executable, "-m", "calibench", "gate", "--samples", "1", "--jobs", "3"]
FUNCTION = """
import calibench
try:
    calibench.run_gate("{program}", samples=1, jobs=3)
except KeyboardInterrupt:
    print("heard", flush=True)
    import time
    time.sleep(0.5)
"""
# That does not answer, that starts others, that ends at once and is started again, that hears no signal but one.
PROGRAMS = {
    "sleeps": "sleep {seconds}",
    "starts others": "(sleep {seconds} & sleep {seconds}) | cat",
    "ends at once": "sleep 0.7{seconds}; exit 1",
    "ignores": "trap '' INT TERM HUP; while true; do sleep {seconds}; done",
}


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
@pytest.mark.parametrize("after", [0.3, 0.9])
@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS.keys())
@pytest.mark.parametrize("way", ["command", "function"])
def test_no_program_is_left_after_an_interrupt(way: str, program: str, after: float) -> None:
    # A number of seconds that is in nobody else's command line.
    seconds = f"72{os.getpid():07d}"
    program = program.replace("{seconds}", seconds)
    command = [*COMMAND, program] if way == "command" else [sys.executable, "-c", FUNCTION.replace("{program}", program)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    begun = time.monotonic()
    while not [line for line in running(seconds) if sys.executable not in line] and time.monotonic() - begun < 10:
        time.sleep(0.01)
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    said, told = last_words(process, 20)
    assert (said, process.returncode) == (("", 3) if way == "command" else ("heard\n", 0)), told
    time.sleep(0.1)
    assert running(seconds) == []

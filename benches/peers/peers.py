"""How fast is this library beside its peers? Runs all sides alternately on the same problems and prints a table.

    just peers                      # everything, with what installs: see benches/peers/run
    just peers --write benches/peers/README.md    # also puts the tables between the markers there
    just peers --only "4 views" --write FILE      # puts the rows of this name among those that stand there

One process a side, all held to one processor; in every round each side works on a row for a while in turn, and says the median time of one
repetition. The table has the medians of those over the rounds, and of the ratios of a round their median and quartiles: what slows the
machine for a while slows both.
"""

import argparse
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

from reference import UNITS, Reference

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
OURS = ROOT / "target/release/peers"
VIEWS = [4, 20, 100, 500, 2000]
WIDE_VIEWS = [4, 20, 100]
BEGIN, END = "<!-- peers: begin -->", "<!-- peers: end -->"


def rows(arguments):
    """Our row, the peer, its row, and what the row is called."""
    found = []
    for n in VIEWS:
        found.append((f"calibrate-{n}", "OpenCV", f"calibrate-{n}", f"calibrate, {n} views"))
    for n in [4, 20, 100] + ([500] if arguments.full else []):
        found.append((f"calibrate-{n}", "OpenCV", f"deviations-{n}", f"the same with deviations, {n} views"))
    for kind, name in [("wide", "fisheye, k1 to k4"), ("rational", "rational, k1 to k6, p1, p2")]:
        for n in WIDE_VIEWS:
            found.append((f"{kind}-{n}", "OpenCV", f"{kind}-{n}", f"{name}, {n} views"))
    for peer in ["mrcal", "Ceres"]:
        for n in VIEWS:
            found.append((f"calibrate-{n}", peer, f"refine-{n}", f"its refinement alone, {n} views"))
    for n in VIEWS:
        found.append((f"calibrate-{n}", "Python", f"calibrate-{n}", f"the same called from Python, {n} views"))
    found += [
        ("homography", "OpenCV", "homography", "homography, 63 points"),
        ("affine", "OpenCV", "affine", "affine map, 9 points"),
        ("points", "OpenCV", "points", "10⁶ points corrected"),
        ("points", "OpenCV", "points-iterated", "the same, its iterated form"),
    ]
    for size in ["640x480", "4000x3000"]:
        shown = size.replace("x", " × ")
        found.append((f"remap-{size}", "OpenCV", f"remap-{size}", f"rectify by a map, {shown}"))
        found.append((f"undistort-{size}", "OpenCV", f"undistort-{size}", f"rectify without a map, {shown}"))
    found += [
        ("grid", "OpenCV", "grid", "circle grid 9 × 7, 640 × 480"),
        ("dots", "OpenCV", "dots-components", "nine dots, 1571 × 1053, by components"),
        ("dots", "OpenCV", "dots-blobs", "nine dots, 1571 × 1053, by its blob detector"),
    ]
    return found


class Side:
    """A program that answers requests."""

    def __init__(self, command, threads=1, cpus=None):
        one = {name: str(threads) for name in ["RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"]}
        pin = (lambda: os.sched_setaffinity(0, cpus)) if cpus and hasattr(os, "sched_setaffinity") else None
        self.start = lambda: subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ | one, cwd=HERE,
            preexec_fn=pin,
        )
        self.process = self.start()

    def renewed(self):
        """Starts the process again: where its pages come to lie makes a tenth of a calibration's time."""
        self.process.kill()
        self.process.wait()
        self.process = self.start()
        return self

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        reply = self.process.stdout.readline().strip()
        if not reply:
            raise RuntimeError(f"no answer to {' '.join(map(str, words))}")
        return reply

    def time(self, row, budget):
        return float(self.ask("time", row, budget))

    def answer(self, row, path):
        self.ask("answer", row, path)
        return np.fromfile(path, dtype="<f8")

    def peak_mib(self):
        """Peak memory of the process so far."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024


def peers(folder, cpus):
    """The sides that are there, by name, and their versions."""
    sides, versions = {}, {}

    def add(name, command, version):
        said = subprocess.run(version, capture_output=True, text=True, cwd=HERE)
        if said.returncode == 0:
            sides[name] = lambda: Side(command, cpus=cpus)
            versions[name] = said.stdout.strip()
        else:
            print(f"SKIPPED {name}: not to be had here", file=sys.stderr)

    opencv = [sys.executable, str(HERE / "opencv_peer.py"), str(folder)]
    add("OpenCV", opencv, opencv + ["version"])
    python = [sys.executable, str(HERE / "python_peer.py"), str(folder)]
    add("Python", python, python + ["version"])
    debian = "/usr/bin/python3"
    if os.path.exists(debian):
        version = ["sh", "-c", f"{debian} -c 'import mrcal' && dpkg-query -W -f '${{Version}}' python3-mrcal"]
        add("mrcal", [debian, str(HERE / "mrcal_peer.py"), str(folder)], version)
    ceres = ROOT / "target/peers/ceres_peer"
    if ceres.exists():
        version = ["sh", "-c", "dpkg-query -W -f '${Version}' libceres-dev"]
        add("Ceres", [str(ceres), str(folder)], version)
    return sides, {name: v.split("-")[0].split("+")[0] for name, v in versions.items()}


def alternate(first, second, budget, rounds):
    """Seconds of both sides, round by round; who begins changes."""
    times = np.empty((rounds, 2))
    for k in range(rounds):
        for side in (0, 1) if k % 2 == 0 else (1, 0):
            times[k, side] = [first, second][side](budget)
    return times


def shown(seconds):
    """Milliseconds with three digits."""
    return f"{1e3 * seconds:.3g}" if seconds < 0.9995 else f"{1e3 * seconds:.0f}"


def exactness(x, unit):
    return f"{x:.1e} {unit}" if x < 1e-2 else f"{x:.2g} {unit}"


def quartiles(ratios):
    low, middle, high = np.percentile(ratios, [25, 50, 75])
    digits = 0 if middle >= 10 else 1 if middle >= 3 else 2
    return f"{middle:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"


def compare(arguments, folder, cpus):
    reference = Reference(folder)
    available, versions = peers(folder, cpus)
    ours = Side([str(OURS), "serve"], cpus=cpus)
    started, lines = {}, []
    for own, peer, theirs, name in rows(arguments):
        if peer not in available or arguments.only not in name:
            continue
        side = started.setdefault(peer, None) or available[peer]()
        started[peer] = side
        errors = [
            exactness(reference.measure(own, one.answer(row, folder / "answer")), UNITS[own.partition("-")[0]])
            for one, row in [(ours, own), (side, theirs)]
        ]
        if peer == "mrcal":
            errors[1] = "estimates p1, p2 too"
        slow = side.time(theirs, 0) > 2.0
        rounds = 3 if slow else arguments.rounds
        fresh = ours.renewed if own.startswith(("calibrate", "wide", "rational")) else lambda: ours
        times = alternate(
            lambda b: fresh().time(own, b), lambda b: side.time(theirs, b), arguments.seconds, rounds
        )
        mine, other = np.median(times, axis=0)
        ratio = quartiles(times[:, 1] / times[:, 0])
        lines.append(f"| {name} | {shown(mine)} | {peer} | {shown(other)} | {ratio} | {errors[0]} | {errors[1]} |")
        print(lines[-1], file=sys.stderr)
    head = [
        "| row | ours, ms | peer | peer, ms | peer / ours | ours off by | peer off by |",
        "|---|---|---|---|---|---|---|",
    ]
    return head + lines, versions


def own_rows(arguments, folder, cpus):
    """Two threads against one, and what the covariance adds."""
    ours = Side([str(OURS), "serve"], cpus=cpus)
    pair = Side([str(OURS), "serve"], threads=2)
    lines = ["| row | ours, ms | one thread / two | covariance / whole |", "|---|---|---|---|"]
    for n in VIEWS:
        if arguments.only not in f"calibrate, {n} views":
            continue
        row = f"calibrate-{n}"
        two = alternate(
            lambda b: ours.renewed().time(row, b), lambda b: pair.renewed().time(row, b), arguments.seconds, arguments.rounds
        )
        part = alternate(
            lambda b: ours.time(row, b), lambda b: ours.time(f"covariance-{n}", b), arguments.seconds, arguments.rounds
        )
        lines.append(
            f"| calibrate, {n} views | {shown(np.median(two[:, 0]))} | {quartiles(two[:, 0] / two[:, 1])} "
            f"| {quartiles(part[:, 1] / part[:, 0])} |"
        )
        print(lines[-1], file=sys.stderr)
    return lines


def memory(folder, cpus):
    """Peak memory at 2000 views, of fresh processes."""
    available, _ = peers(folder, cpus)
    told = []
    for name, start, row in [("ours", lambda: Side([str(OURS), "serve"], cpus=cpus), "calibrate-2000")] + [
        (name, start, "calibrate-2000" if name == "OpenCV" else "refine-2000") for name, start in available.items()
    ]:
        side = start()
        side.time(row, 0)
        told.append(f"{name} {side.peak_mib():.0f}")
    return "Peak memory of the process after 2000 views, MiB: " + ", ".join(told) + "."


def machine():
    """The machine by its kind."""
    flags = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    kind = platform.machine().replace("_", "-")
    wide = " with AVX2" if " avx2 " in flags else ""
    return f"{len(os.sched_getaffinity(0))} cores, {kind}{wide}"


def write(path, text):
    """Puts the text between the markers of a file."""
    page = Path(path).read_text()
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    Path(path).write_text(page[:begin] + "\n" + text + "\n" + page[end:])


def merge(path, lines, order):
    """Puts rows among those that stand in a file's first table, in the order of all; the others stay as they are."""
    page = Path(path).read_text()
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    standing = page[begin:end].strip("\n").split("\n")
    first = next(k for k, line in enumerate(standing) if line.startswith("|---")) + 1
    last = next(k for k in range(first, len(standing)) if not standing[k].startswith("|"))
    by_name = {cells(line): line for line in standing[first:last] + lines}
    places = {(name, peer): k for k, (_, peer, _, name) in enumerate(order)}
    rows_of_all = sorted(by_name, key=lambda name: places.get(name, len(places)))
    standing[first:last] = [by_name[name] for name in rows_of_all]
    Path(path).write_text(page[:begin] + "\n" + "\n".join(standing) + "\n" + page[end:])


def cells(line):
    """What a row is called, and its peer."""
    parts = [cell.strip() for cell in line.split("|")]
    return parts[1], parts[3]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", metavar="FILE", help="put the tables between the markers of this file; with --only the rows")
    parser.add_argument("--rounds", type=int, default=15, help="rounds a row")
    parser.add_argument("--seconds", type=float, default=0.1, help="seconds of work a side and round")
    parser.add_argument("--only", default="", metavar="TEXT", help="only rows whose name has this")
    parser.add_argument("--full", action="store_true", help="also OpenCV's standard deviations at 500 views: minutes")
    arguments = parser.parse_args()
    folder = ROOT / "target/peers/problems"
    subprocess.run([OURS, "export", folder], check=True)
    cpus = {max(os.sched_getaffinity(0))} if hasattr(os, "sched_getaffinity") else None
    table, versions = compare(arguments, folder, cpus)
    own = own_rows(arguments, folder, cpus)
    if arguments.only:
        print("\n".join([*table, "", *own]))
        if arguments.write:
            merge(arguments.write, table[2:], rows(arguments))
        return
    named = ", ".join(f"{name} {version}" for name, version in versions.items())
    text = "\n".join(
        [
            f"One thread on {machine()}; {named}. Medians of {arguments.rounds} rounds in which the sides take turns; of the ratio "
            "also the quartiles.",
            "",
            *table,
            "",
            *own,
            "",
            memory(folder, cpus),
        ]
    )
    print(text)
    if arguments.write:
        write(arguments.write, text)


if __name__ == "__main__":
    main()

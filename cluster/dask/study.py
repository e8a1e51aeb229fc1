#!/usr/bin/env python3
"""A study on a Dask cluster, one shard a task, merged at the end.

    python3 cluster/dask/study.py SPEC.toml OUT --shards 8                          # on this machine
    python3 cluster/dask/study.py SPEC.toml OUT --shards 8 --scheduler tcp://host:8786   # OUT on a shared file system
    python3 cluster/dask/study.py SPEC.toml OUT --shards 8 --trials parquet                # as for study run

Each task runs cluster/run-shard, the same line that a Slurm job runs; Ray or a shell loop would do as well. A task that died
is continued by running the same line again. No result depends on the number of shards or workers.
"""

import argparse
import os
import pathlib
import subprocess
import sys

from dask.distributed import Client, LocalCluster

HELPER = pathlib.Path(__file__).resolve().parent.parent / "run-shard"


def run_shard(helper: str, spec: str, out: str, index: int, count: int, trials: str) -> str:
    """Runs one shard; its output if it fails."""
    command = [helper, spec, out, str(index), str(count), "--trials", trials]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"shard {index}/{count} ended with {done.returncode}: {done.stderr.strip()}")
    return f"{out}/shard-{index}-of-{count}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("spec")
    parser.add_argument("out")
    parser.add_argument("--shards", type=int, required=True)
    parser.add_argument("--scheduler", help="address of a running scheduler")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="local workers without --scheduler")
    parser.add_argument("--trials", default="csv", help="file of the trials: csv, or parquet")
    arguments = parser.parse_args()

    cluster = arguments.scheduler or LocalCluster(
        n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None
    )
    with Client(cluster) as client:
        spec, out = (str(pathlib.Path(p).resolve()) for p in (arguments.spec, arguments.out))
        tasks = [
            client.submit(run_shard, str(HELPER), spec, out, index, arguments.shards, arguments.trials, pure=False)
            for index in range(arguments.shards)
        ]
        parts = client.gather(tasks)
    calibench = os.environ.get("CALIBENCH", "calibench")
    return subprocess.run([calibench, "study", "merge", *parts, "--out", f"{out}/whole"]).returncode


if __name__ == "__main__":
    sys.exit(main())

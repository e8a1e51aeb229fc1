#!/usr/bin/env python3
"""A study on a Ray cluster, one shard a task, merged at the end.

    python3 cluster/ray/study.py SPEC.toml OUT --shards 8                           # on this machine
    python3 cluster/ray/study.py SPEC.toml OUT --shards 8 --address HOST:6379       # OUT on a shared file system

Each task runs a line of `calibench study commands`; one that died is tried again, and goes on where it was. No result depends on the number of
shards or workers.
"""

import argparse
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import commands  # noqa: E402
import ray  # noqa: E402

TRIES = 3


def run_shard(begin: list[str], proceed: list[str], folder: str) -> str:
    """Begins or continues one shard; its folder."""
    command = proceed if (pathlib.Path(folder) / "manifest.json").exists() else begin
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{folder} ended with {done.returncode}: {done.stderr.strip()}")
    return folder


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("spec")
    parser.add_argument("out")
    parser.add_argument("--shards", type=int, required=True)
    parser.add_argument("--address", help="address of a running cluster")
    parser.add_argument("--workers", type=int, help="processors to use without --address [default: all]")
    arguments = parser.parse_args()
    spec, out = (str(pathlib.Path(p).resolve()) for p in (arguments.spec, arguments.out))

    local = {} if arguments.address else {"num_cpus": arguments.workers, "include_dashboard": False}
    ray.init(address=arguments.address, log_to_driver=False, **local)
    task = ray.remote(num_cpus=1, max_retries=TRIES, retry_exceptions=True)(run_shard)
    parts = commands.shards(spec, out, arguments.shards)
    ray.get([task.remote(part.begin, part.proceed, part.folder) for part in parts])
    ray.shutdown()
    return subprocess.run(commands.merge(spec, out, arguments.shards)).returncode


if __name__ == "__main__":
    sys.exit(main())

"""A fleet on a dask cluster, this machine's or any other that shares the folder (pip install dask distributed).

    python examples/fleet/on_dask.py FLEET.yaml OUT SHARDS [SCHEDULER]      # without one: a LocalCluster

Exit status: that of `gapscope fleet merge`, 1 where a unit failed."""
import os
import subprocess
import sys

from distributed import Client, LocalCluster

GAPSCOPE = os.environ.get("GAPSCOPE", "gapscope")


def run_shard(shard: str, out: str) -> int:
    """Exit status; 1: a unit failed, and merge tells of it. A worker that is killed, or does it again, does no harm."""
    return subprocess.run([GAPSCOPE, "fleet", "run", "--jobs", "1", "--quiet", "--shard", shard, out],
                          check=False).returncode


def main(fleet: str, out: str, shards: str, scheduler: str | None = None) -> int:
    subprocess.run([GAPSCOPE, "fleet", "plan", fleet, "--shards", shards, "--out", out], check=True)
    cluster = scheduler or LocalCluster(threads_per_worker=1, dashboard_address=None)
    with Client(cluster) as client:
        parts = [f"{i + 1}/{shards}" for i in range(int(shards))]
        client.gather(client.map(run_shard, parts, out=os.path.abspath(out), pure=False))
    return subprocess.run([GAPSCOPE, "fleet", "merge", out], check=False).returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

"""A Dask cluster on this machine, in a process of its own; ends when its input does.

Usage: python local_cluster.py WORKERS
"""

import sys

from dask import config
from distributed import LocalCluster

# What a cluster does while it waits, many times a second and on all of its processes, costs as much
# as the work of small tests.
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
}

if __name__ == "__main__":
    config.set(QUIET)
    with LocalCluster(
        n_workers=int(sys.argv[1]),
        threads_per_worker=2,
        memory_limit="2GB",
        dashboard_address=None,
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()

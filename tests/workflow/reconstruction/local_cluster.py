"""A Dask cluster on this machine, in a process of its own; ends when its input does.

Usage: python local_cluster.py WORKERS
"""

import sys

from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(
        n_workers=int(sys.argv[1]),
        threads_per_worker=2,
        memory_limit="2GB",
        dashboard_address=None,
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()

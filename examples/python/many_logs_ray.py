#!/usr/bin/env python3
"""A folder of logs -> a folder of Parquet files, by Ray, in the processes of its workers.

    many_logs_ray.py FOLDER OUT [WORKERS]

A task is a log; one that dies with its worker is done again (Ray's own `max_retries`), and writes over what was half written.
"""

import pathlib
import sys

import ray
from one_log import replayed


def main(folder, out, workers="2"):
    logs = sorted(map(str, pathlib.Path(folder).glob("*.mcap")))
    if not logs:
        sys.exit(f"{folder}: no logs")
    pathlib.Path(out).mkdir(parents=True, exist_ok=True)
    here = str(pathlib.Path(__file__).resolve().parent)
    ray.init(num_cpus=int(workers), include_dashboard=False, log_to_driver=False, runtime_env={"env_vars": {"PYTHONPATH": here}})
    task = ray.remote(num_cpus=1, max_retries=3)(replayed)
    told = ray.get([task.remote(log, str(out)) for log in logs])
    print(f"{len(told)} logs, {sum(attitudes for _, attitudes, _, _ in told)} attitudes")
    ray.shutdown()
    sys.exit(1 if any(not attitudes for _, attitudes, _, _ in told) else 0)


if __name__ == "__main__":
    main(*sys.argv[1:4])

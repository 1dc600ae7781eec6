#!/usr/bin/env python3
"""A folder of logs -> a folder of Parquet files, by Dask: a bag of names, and the same as delayed calls.

    many_logs_dask.py FOLDER OUT [processes|threads|ADDRESS]

With an ADDRESS (tcp://...) the workers of a running cluster do it (needs distributed), which see the same folders. A log a task: the
scheduler sees names go out and counts come back, no attitudes.
"""

import pathlib
import sys

import dask
import dask.bag
from one_log import replayed


def main(folder, out, where="processes"):
    logs = sorted(map(str, pathlib.Path(folder).glob("*.mcap")))
    if not logs:
        sys.exit(f"{folder}: no logs")
    pathlib.Path(out).mkdir(parents=True, exist_ok=True)
    if "://" in where:
        from distributed import Client

        client = Client(where)
        client.upload_file(str(pathlib.Path(__file__).with_name("one_log.py")))
        where = client
    # A few logs a task: one is too short for the scheduler's 1 ms.
    bag = dask.bag.from_sequence(logs, partition_size=4).map(replayed, str(out))
    told = bag.compute(scheduler=where)
    # The same, where each call has arguments of its own.
    again = dask.compute(*[dask.delayed(replayed)(log, str(out)) for log in logs[:2]], scheduler=where)
    assert [row[1] for row in again] == [row[1] for row in told[:2]]
    print(f"{len(told)} logs, {sum(attitudes for _, attitudes, _, _ in told)} attitudes")
    sys.exit(1 if any(not attitudes for _, attitudes, _, _ in told) else 0)


if __name__ == "__main__":
    main(*sys.argv[1:4])

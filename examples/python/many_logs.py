#!/usr/bin/env python3
"""A folder of logs -> a folder of Parquet files, on all cores, by the standard library.

    many_logs.py FOLDER OUT [--workers N] [--start fork|spawn|forkserver]

A worker that is killed (by the kernel for want of memory, say) costs what it was doing: a new pool does what is missing, three times at
most. Exit code 1: some logs have no attitude, each with its reason.
"""

import argparse
import concurrent.futures
import multiprocessing
import os
import pathlib
import sys
import warnings

import strapd
from one_log import output_of, replayed

TRIES = 3


def work(log, folder):
    # Losses are in the table that is printed.
    warnings.simplefilter("ignore", strapd.LossWarning)
    return replayed(log, folder)


def all_of(logs, folder, workers, start):
    """What became of each log, in their order."""
    context = multiprocessing.get_context(start)
    for attempt in range(TRIES):
        try:
            with concurrent.futures.ProcessPoolExecutor(workers, mp_context=context) as pool:
                return list(pool.map(work, logs, [folder] * len(logs)))
        except concurrent.futures.process.BrokenProcessPool:
            done = sum(output_of(log, folder).exists() for log in logs)
            print(f"a worker was killed; {done} of {len(logs)} logs are done, try {attempt + 2}", file=sys.stderr)
    sys.exit(f"workers were killed {TRIES} times")


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folder")
    asked.add_argument("out")
    asked.add_argument("--workers", type=int, default=os.cpu_count())
    asked.add_argument("--start", default="spawn", choices=multiprocessing.get_all_start_methods())
    given = asked.parse_args()
    logs = sorted(path for path in pathlib.Path(given.folder).iterdir() if path.suffix in (".mcap", ".ulg", ".bag", ".csv", ".ndjson"))
    if not logs:
        sys.exit(f"{given.folder}: no logs")
    pathlib.Path(given.out).mkdir(parents=True, exist_ok=True)
    told = all_of(logs, given.out, given.workers, given.start)
    for log, attitudes, lost, why in told:
        reason = f" ({' '.join(why.split())})" if why else ""
        print(f"{log}: {attitudes} attitudes{f', lost {lost} samples' if lost else ''}{reason}")
    sys.exit(1 if any(not attitudes for _, attitudes, _, _ in told) else 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Many logs under several drivers: processor time of all processes a log, and wall time, in turn in one run.

    fleet.py [--logs 200] [--seconds 30] [--rounds 2] [--drivers REGEX]

Each driver gives a file of attitudes for each log: MCAP by the command, Parquet by Python. Needs the command; a driver that is not here is
left out, and that is said. Processor time is that of everything below this process; of what Ray starts, which are no children, as it was 50 ms
before its end.
"""

import argparse
import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

RECIPES = pathlib.Path(__file__).resolve().parents[2] / "examples" / "python"


def cpu():
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def ours(pids, marker):
    """Processor seconds of living processes that have the marker in their environment."""
    ticks, total = os.sysconf("SC_CLK_TCK"), {}
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            if marker not in (entry / "environ").read_bytes():
                continue
            fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            total[int(entry.name)] = (int(fields[11]) + int(fields[12])) / ticks
        except OSError:
            continue
    pids.update({pid: max(pids.get(pid, 0.0), spent) for pid, spent in total.items()})


def measured(words, env, detached):
    """Processor seconds and wall seconds of a command with all it starts."""
    before, begun = cpu(), time.perf_counter()
    marker = f"STRAPD_FLEET_RUN={begun}"
    program = subprocess.Popen(words, env={**env, "STRAPD_FLEET_RUN": str(begun)}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    pids = {}
    while program.poll() is None:
        if detached:
            # Those who are nobody's children are looked at while they live.
            ours(pids, marker.encode())
        time.sleep(0.05 if detached else 0.01)
    wall = time.perf_counter() - begun
    if program.returncode not in (0, 3):
        sys.exit(f"{words[:3]}: {program.stderr.read().decode()}")
    return max(cpu() - before, sum(pids.values())), wall


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--logs", type=int, default=200)
    asked.add_argument("--seconds", type=float, default=30)
    asked.add_argument("--rounds", type=int, default=2)
    asked.add_argument("--drivers", default="", help="only those whose names this finds")
    given = asked.parse_args()
    from strapd._command import command

    strapd = command()
    with tempfile.TemporaryDirectory() as place:
        logs, out = pathlib.Path(place) / "logs", pathlib.Path(place) / "out"
        logs.mkdir()
        for seed in range(given.logs):
            words = ["--rate-hz=1000", f"--duration={given.seconds}", "--noise=consumer_imu", f"--seed={seed}"]
            subprocess.run([strapd, "simulate", "random", *words, "--quiet", "-o", logs / f"log{seed:03}.mcap"], check=True)
        size = sum(path.stat().st_size for path in logs.iterdir()) / given.logs
        names = [str(path) for path in sorted(logs.iterdir())]
        stem = f"{out}/{{stem}}.mcap"
        python = [sys.executable, "-W", "ignore"]
        drivers = {
            "one command, all logs": [strapd, "replay", *names, "--quiet", "-o", stem],
            "one command, `--threads 1`": [strapd, "replay", *names, "--quiet", "--threads=1", "-o", stem],
            "`xargs -P2`, a process a log": ["sh", "-c", f"ls {logs}/* | xargs -P2 -I @ {strapd} replay @ --quiet --threads 1 -o '{stem}'"],
            "one process of Python": [*python, "-c", f"import sys; sys.path.insert(0, {str(RECIPES)!r}); from one_log import replayed; [replayed(log, {str(out)!r}) for log in sys.argv[1:]]", *names],
            "`many_logs.py`, 2 processes, fork": [*python, RECIPES / "many_logs.py", logs, out, "--workers=2", "--start=fork"],
            "`many_logs.py`, 2 processes, spawn": [*python, RECIPES / "many_logs.py", logs, out, "--workers=2", "--start=spawn"],
        }
        for name, module, recipe in (("Dask bag, processes", "dask", "dask"), ("Ray tasks, 2 workers", "ray", "ray")):
            try:
                __import__(module)
                drivers[f"{name}"] = [*python, RECIPES / f"many_logs_{recipe}.py", logs, out]
            except ImportError:
                print(f"NOT MEASURED: {module} is not here", file=sys.stderr)
        drivers = {name: words for name, words in drivers.items() if re.search(given.drivers, name)}
        env = {**os.environ, "STRAPD_BIN": strapd}
        spent = {name: [] for name in drivers}
        for _ in range(given.rounds):
            for name, words in drivers.items():
                shutil.rmtree(out, ignore_errors=True)
                out.mkdir()
                spent[name].append(measured([str(word) for word in words], env, "Ray" in name))
                assert len(list(out.iterdir())) == given.logs, name
    samples = int(given.seconds * 1000) + 1
    print(f"{given.logs} logs of {samples} samples ({size / 1e6:.1f} MB), {given.rounds} rounds in turn, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    print("| driver | processor ms a log | wall, s |\n|---|---|---|")
    for name, rounds in spent.items():
        ms = [cpu / given.logs * 1e3 for cpu, _ in rounds]
        wall = [wall for _, wall in rounds]
        print(f"| {name} | {statistics.median(ms):.0f} ({min(ms):.0f} to {max(ms):.0f}) | {min(wall):.1f} to {max(wall):.1f} |")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Times `strapd replay` against its peers on the same logs, run in turn, and prints a Markdown table.

    cargo build --release --bin strapd --example iterate_message_stream
    benches/peers/compare.py --python target/oracles/bin/python LOG.mcap... [--repeats 5]

Fair means:
- every round runs every contender once, one after the other, so that a slow minute of the machine hits all;
  a ratio is taken within a round, and the median of the rounds' ratios is printed;
- `strapd` is charged its whole process, from start to exit, output written and synced;
- `MessageStream` is charged only its loop, with the whole file in memory before the clock starts;
- Python is charged its loop, on the first samples of the log, and scaled to the whole (it needs minutes);
- the file is in the page cache before the first round.

Needs GNU time for the CPU seconds and the peak of resident memory. Standard library only.
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Run:
    """One run of one contender."""

    seconds: float  # what it is charged
    cpu_seconds: float  # whole process, all threads (Python: as the seconds)
    peak_mib: float  # resident, whole process


def measured(command, scratch):
    """Runs a command to its end: standard output, wall seconds, CPU seconds, peak resident MiB."""
    usage = Path(scratch, "usage")
    start = time.perf_counter()
    done = subprocess.run(
        ["/usr/bin/time", "--quiet", "-f", "%U %S %M", "-o", usage, *map(str, command)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    wall = time.perf_counter() - start
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stderr}")
    user, system, kib = usage.read_text().split()
    return done.stdout, wall, float(user) + float(system), int(kib) / 1024


def contenders(arguments, log, scratch):
    """Name -> function that runs it once, in the order of a round; and the number of messages."""
    iterate = ROOT / "target/release/examples/iterate_message_stream"
    messages = json.loads(measured([iterate, log], scratch)[0])["messages"]

    def message_stream(*flags):
        def run():
            out, _, cpu, peak = measured([iterate, log, *flags], scratch)
            return Run(json.loads(out)["seconds"], cpu, peak)

        return run

    def strapd(sink):
        def run():
            # Outputs are new files each time: replacing one would add the time of freeing it.
            target = sink if sink.endswith(":") else str(Path(scratch, sink))
            command = [arguments.strapd, "replay", log, "-o", target, "--force", "--aid", "none", *arguments.replay_flag]
            _, wall, cpu, peak = measured(command, scratch)
            if target != sink:
                os.remove(target)
            return Run(wall, cpu, peak)

        return run

    def python():
        limit = min(arguments.python_messages, messages)
        script = ROOT / "benches/peers/python_replay.py"
        out, _, _, peak = measured([arguments.python, script, log, "--limit", limit], scratch)
        answer = json.loads(out)
        versions.update(answer["versions"])
        scale = messages / answer["messages"]
        return Run(answer["seconds"] * scale, answer["cpu_seconds"] * scale, peak)

    versions = {}
    runs = {
        "`mcap::MessageStream`, iterating only": message_stream(),
        "the same, chunk CRCs checked": message_stream("--check-crc"),
    }
    if arguments.strapd:
        for sink in ("null:", "out.ndjson", "out.mcap"):
            runs[f"`strapd replay -o {sink}`"] = strapd(sink)
    if arguments.python:
        runs["Python `mcap` + `mcap-ros2-support` + numpy"] = python
    return runs, messages, versions


def compare(arguments, log, scratch):
    """Prints the table of one log."""
    runs, messages, versions = contenders(arguments, log, scratch)
    rounds = [{name: run() for name, run in runs.items()} for _ in range(arguments.repeats)]
    baseline = next(iter(runs))

    print(f"\n### {log.name}: {messages:,} messages, {log.stat().st_size / 1e6:,.0f} MB\n")
    print("| | s, median (min - max) | M msg/s | of MessageStream's time | CPU s | peak MiB |")
    print("|---|---|---|---|---|---|")
    for name in runs:
        seconds = [each[name].seconds for each in rounds]
        median = statistics.median(seconds)
        ratio = statistics.median(each[name].seconds / each[baseline].seconds for each in rounds)
        cpu = statistics.median(each[name].cpu_seconds for each in rounds)
        peak = max(each[name].peak_mib for each in rounds)
        print(
            f"| {name} | {median:.3f} ({min(seconds):.3f} - {max(seconds):.3f}) "
            f"| {messages / median / 1e6:.3g} | {ratio:.2f} | {cpu:.2f} | {peak:,.0f} |",
            flush=True,
        )
    if versions:
        print("\n" + ", ".join(f"{name} {number}" for name, number in versions.items()))


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT).stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", type=Path, help="logs of sensor_msgs/msg/Imu on /imu/data_raw")
    parser.add_argument("--strapd", type=Path, default=ROOT / "target/release/strapd")
    parser.add_argument("--without-strapd", action="store_true", help="time the peers alone")
    parser.add_argument("--python", type=Path, help="interpreter with benches/peers/requirements.txt; without it no Python row")
    parser.add_argument("--python-messages", type=int, default=50_000, help="samples given to Python")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--scratch", type=Path, help="folder for outputs; should be on the disk of the logs")
    parser.add_argument("--replay-flag", action="append", default=[], help="passed to strapd replay; may be repeated")
    arguments = parser.parse_args()
    if arguments.without_strapd:
        arguments.strapd = None
    if not shutil.which("/usr/bin/time"):
        sys.exit("/usr/bin/time is missing: install GNU time (Debian package `time`)")

    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    print(f"{cpu}, {os.cpu_count()} cores, {platform.system()} {platform.release()}; {output_of('rustc', '-V')};")
    print(f"strapd {output_of('git', 'describe', '--always', '--dirty')}; {arguments.repeats} rounds")
    with tempfile.TemporaryDirectory(dir=arguments.scratch) as scratch:
        for log in arguments.logs:
            with open(log, "rb") as stream:  # into the page cache
                while stream.read(1 << 24):
                    pass
            compare(arguments, log, scratch)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Faults put into recordings and simulated motions -> which of them `strapd replay` names, as a Markdown table.

    cargo build
    benches/doubts.py SCRATCH_DIR [RECORDING...]      STRAPD=target/debug/strapd SEEDS=1,2

Each recording is cut to its first SECS; motions are those of `strapd simulate` with the noise of a consumer sensor. A
fault is found where a finding of its code is there; the row `none` counts errors and warnings of the data as they are.
"""
import csv
import json
import os
import subprocess
import sys

STRAPD = os.path.abspath(os.environ.get("STRAPD", "target/debug/strapd"))
MOTIONS = ["hand", "arm", "walking", "running", "car", "boat", "drone", "circling"]
GYRO, FORCE = [[f"{of}_{axis}" for axis in "xyz"] for of in ("gyro", "accel")]
HZ, SECS = 100, 60
SEEDS = os.environ.get("SEEDS", "1").split(",")


def run(*arguments):
    return subprocess.run([STRAPD, *arguments], capture_output=True, text=True, check=False).stdout


def rows_of(text):
    """Stamp in ns, rate, force of each row that has both."""
    rows = []
    for row in csv.DictReader(text.splitlines()):
        try:
            values = [[float(row[c]) for c in of] for of in (GYRO, FORCE)]
            rows.append((int(row["stamp_ns"]), *values))
        except (KeyError, ValueError):
            continue
    last = rows[0][0] + SECS * 10**9 if rows else 0
    return [row for row in rows if row[0] <= last]


def scaled(vector, factor):
    return [v * factor for v in vector]


def each(change):
    return lambda rows: [change(n, row, len(rows)) for n, row in enumerate(rows)]


def half_way(gyro, force):
    def change(n, row, count):
        t, w, f = row
        return row if n < count // 2 else (t, scaled(w, gyro), scaled(f, force))

    return each(change)


def spikes(size):
    def change(n, row, _):
        t, w, f = row
        return (t, [w[0] + size, w[1], w[2]], f) if n % 500 == 437 else row

    return each(change)


def batches(rows):
    return [(rows[min(n // 8 * 8 + 7, len(rows) - 1)][0] + n % 8 * 20_000, w, f) for n, (_, w, f) in enumerate(rows)]


def two(rows):
    """The second sensor stands on another axis, and saw what the first does half a minute later."""
    half = len(rows) // 2
    return [
        one
        for (t, w, f), (_, v, g) in zip(rows[:half], rows[half:])
        for one in ((t, w, f), (t + 1_500_000, [v[2], v[0], v[1]], [g[2], g[0], g[1]]))
    ]


DEG = 57.29577951
FAULTS = {
    "none": (lambda rows: rows, ()),
    "x reversed": (each(lambda n, r, _: (r[0], [-r[1][0], *r[1][1:]], r[2])), ("gyro-axes", "gyro-against-gravity")),
    "x and y exchanged": (each(lambda n, r, _: (r[0], [r[1][1], r[1][0], r[1][2]], r[2])), ("gyro-axes", "gyro-against-gravity")),
    "deg/s": (each(lambda n, r, _: (r[0], scaled(r[1], DEG), r[2])), ("gyro-scale", "unit-degrees")),
    "half the range": (each(lambda n, r, _: (r[0], scaled(r[1], 2), r[2])), ("gyro-scale",)),
    "deg/s from half way": (half_way(DEG, 1), ("gyro-unit-change",)),
    "rad/s in deg/s from half way": (half_way(1 / DEG, 1), ("gyro-unit-change",)),
    "g from half way": (half_way(1, 1 / 9.80665), ("accel-unit-change",)),
    "spikes of 3 rad/s": (spikes(3), ("spikes",)),
    "spikes of 8 rad/s": (spikes(8), ("spikes",)),
    "spikes of 30 rad/s": (spikes(30), ("spikes",)),
    "batches of 8": (batches, ("batches",)),
    "two sensors": (two, ("two-sensors",)),
}


def findings(rows, scratch):
    path = os.path.join(scratch, "fault.csv")
    with open(path, "w", encoding="utf-8") as file:
        file.write("stamp_ns," + ",".join(GYRO + FORCE) + "\n")
        for t, w, f in rows:
            file.write(f"{t}," + ",".join(f"{v:.9g}" for v in (*w, *f)) + "\n")
    said = run("replay", "--aid", "auto", "--json", path)
    topics = json.loads(said)["topics"] if said else []
    return {f["code"]: f for topic in topics for f in topic["findings"] if f["severity"] != "note"}


def main():
    scratch, *recordings = sys.argv[1:]
    os.makedirs(scratch, exist_ok=True)
    data = {os.path.basename(path): rows_of(run("cat", "--format", "csv", path)) for path in recordings}
    for motion, seed in ((motion, seed) for motion in MOTIONS for seed in SEEDS):
        path = os.path.join(scratch, f"{motion}-{seed}.csv")
        kind = ["--rate-hz", str(HZ), "--duration", str(SECS), "--noise", "consumer_imu", "--seed", seed]
        run("simulate", motion, *kind, "-o", path, "--force")
        with open(path, encoding="utf-8") as file:
            data[f"{motion} {seed}"] = rows_of(file.read())
    print("| fault | found | not found in | errors of another name |\n|---|---|---|---|")
    for name, (change, codes) in FAULTS.items():
        missed, others = [], {}
        for of, rows in data.items():
            found = findings(change(rows), scratch)
            if not found.keys() & set(codes):
                missed.append(of)
            for code, finding in found.items():
                if code not in codes and finding["severity"] == "error":
                    others.setdefault(code, []).append(of)
        said = "; ".join(f"`{code}`: {', '.join(of)}" for code, of in others.items())
        count = f"{len(data) - len(missed)} of {len(data)}" if codes else "-"
        print(f"| {name} | {count} | {', '.join(missed) if codes else ''} | {said} |", flush=True)


if __name__ == "__main__":
    main()

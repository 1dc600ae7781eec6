#!/usr/bin/env python3
"""Faults put into recordings and simulated motions -> which of them `strapd replay` names, as a Markdown table.

    cargo build
    benches/doubts.py SCRATCH_DIR [RECORDING...]             STRAPD=target/debug/strapd SEEDS=1,2
    benches/doubts.py --spikes SCRATCH_DIR RECORDING...      in files, and as a live stream takes them
    benches/doubts.py --clocks SCRATCH_DIR RECORDING...

Each recording is cut to its first SECS; motions are those of `strapd simulate` with the noise of a consumer sensor. A
fault is found where a finding of its code is there; the row `none` counts errors and warnings of the data as they are.
Of spikes the samples are counted that are repaired, and those that are though they were none.
"""
import csv
import json
import os
import random
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


def axes_half_way(change):
    return each(lambda n, row, count: row if n < count // 2 else (row[0], change(*row[1]), row[2]))


def axes_first_half(change):
    return each(lambda n, row, count: row if n >= count // 2 else (row[0], change(*row[1]), row[2]))


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
    "x and y exchanged from half way": (axes_half_way(lambda x, y, z: [y, x, z]), ("gyro-axes-change",)),
    "x reversed from half way": (axes_half_way(lambda x, y, z: [-x, y, z]), ("gyro-axes-change",)),
    "x and y exchanged until half way": (axes_first_half(lambda x, y, z: [y, x, z]), ("gyro-axes-change",)),
    "all in a circle from half way": (axes_half_way(lambda x, y, z: [z, x, y]), ("gyro-axes-change",)),
    "spikes of 3 rad/s": (spikes(3), ("spikes",)),
    "spikes of 8 rad/s": (spikes(8), ("spikes",)),
    "spikes of 30 rad/s": (spikes(30), ("spikes",)),
    "batches of 8": (batches, ("batches",)),
    "two sensors": (two, ("two-sensors",)),
}


def replayed(rows, scratch, *flags, stamps=None):
    """Topics of the summary; `stamps`: those of the sensor, where the rows' are the recorder's."""
    path = os.path.join(scratch, "fault.csv")
    with open(path, "w", encoding="utf-8") as file:
        file.write("stamp_ns," + ("log_ns," if stamps else "") + ",".join(GYRO + FORCE) + "\n")
        for n, (t, w, f) in enumerate(rows):
            time = f"{stamps[n]},{t}" if stamps else t
            file.write(f"{time}," + ",".join(f"{v:.9g}" for v in (*w, *f)) + "\n")
    said = run("replay", "--aid", "auto", "--json", *flags, path)
    return json.loads(said)["topics"] if said else []


def findings(rows, scratch, notes=False, **how):
    topics = replayed(rows, scratch, **how)
    found = {f["code"]: f for topic in topics for f in topic["findings"] if notes or f["severity"] != "note"}
    if any(topic["counter_wraps"] for topic in topics):
        # No finding of a recording: it goes on.
        found["counter-wraps"] = {"severity": "note"}
    return found


def spiked(rows, size, length, seed=1):
    """Twenty spikes of so many samples, at random times and in random directions; and how many samples that are."""
    draw = random.Random(seed)
    rows = [(t, list(w), f) for t, w, f in rows]
    gap = (len(rows) - 200) // 20
    for k in range(20):
        at = 100 + k * gap + draw.randrange(gap - 40)
        axis, sign = draw.randrange(3), draw.choice((-1, 1))
        for row in rows[at : at + length]:
            row[1][axis] += sign * size
    return rows, 20 * length


def spike_table(scratch, data):
    def repaired(rows, *flags):
        return sum(topic["repaired_spikes"] for topic in replayed(rows, scratch, *flags))

    print("| spikes, rad/s | samples | repaired in files | live |\n|---|---|---|---|")
    none = [sum(repaired(rows, *flags) for rows in data.values()) for flags in ((), ("--method", "commit"))]
    print(f"| none | 0 | {none[0]} | {none[1]} |", flush=True)
    for length in (1, 2, 3):
        for size in (0.5, 1, 3, 8, 30):
            made, file, live = 0, 0, 0
            for rows in data.values():
                faulty, count = spiked(rows, size, length)
                made += count
                file += repaired(faulty)
                live += repaired(faulty, "--method", "commit")
            print(f"| {size} | {length} | {100 * file / made:.0f} % | {100 * live / made:.0f} % |", flush=True)


def by_stamp(change):
    """Stamps of the sensor by those of the recorder, both from 0."""
    return lambda rows: [rows[0][0] + change(t - rows[0][0]) for t, *_ in rows]


def in_batches(rows):
    return [rows[min(n // 8 * 8 + 7, len(rows) - 1)][0] + n % 8 * 20_000 for n in range(len(rows))]


CLOCKS = {
    "none": (None, ()),
    "half the speed": (by_stamp(lambda t: t // 2), ("clock-speed",)),
    "twice the speed": (by_stamp(lambda t: t * 2), ("clock-speed",)),
    "10 % fast": (by_stamp(lambda t: t * 11 // 10), ("clock-speed",)),
    "set ahead by 0.3 s": (by_stamp(lambda t: t + 300_000_000 * (t > 3e10)), ("clock-set",)),
    "set back by 0.3 s": (by_stamp(lambda t: t - 300_000_000 * (t > 3e10)), ("clock-set",)),
    "set ahead by an hour": (by_stamp(lambda t: t + 3600 * 10**9 * (t > 3e10)), ("clock-set",)),
    "wraps at 32 bits of us": (
        lambda rows: [((t - rows[0][0]) // 1000 + 2**32 - 20_000_000) % 2**32 * 1000 for t, *_ in rows],
        ("counter-wraps",),
    ),
    "counts in 100 ms": (by_stamp(lambda t: t // 10**8 * 10**8), ("coarse-stamps",)),
    "batches of 8": (in_batches, ("batches",)),
}


def clock_table(scratch, data):
    print("| clock of the stamps | found | not found in | errors of another name |\n|---|---|---|---|")
    for name, (change, codes) in CLOCKS.items():
        table_row(name, codes, data, lambda rows, change=change: findings(rows, scratch, True, stamps=change and change(rows)))


def main():
    tables = {"--spikes": spike_table, "--clocks": clock_table}
    table = tables.get(sys.argv[1])
    scratch, *recordings = sys.argv[2 if table else 1 :]
    os.makedirs(scratch, exist_ok=True)
    data = {os.path.basename(path): rows_of(run("cat", "--format", "csv", path)) for path in recordings}
    if table:
        return table(scratch, data)
    for motion, seed in ((motion, seed) for motion in MOTIONS for seed in SEEDS):
        path = os.path.join(scratch, f"{motion}-{seed}.csv")
        kind = ["--rate-hz", str(HZ), "--duration", str(SECS), "--noise", "consumer_imu", "--seed", seed]
        run("simulate", motion, *kind, "-o", path, "--force")
        with open(path, encoding="utf-8") as file:
            data[f"{motion} {seed}"] = rows_of(file.read())
    print("| fault | found | not found in | errors of another name |\n|---|---|---|---|")
    for name, (change, codes) in FAULTS.items():
        table_row(name, codes, data, lambda rows, change=change: findings(change(rows), scratch))


def table_row(name, codes, data, found_in):
    missed, others = [], {}
    for of, rows in data.items():
        found = found_in(rows)
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

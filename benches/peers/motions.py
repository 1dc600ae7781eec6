#!/usr/bin/env python3
"""Attitude filters on motions with exact truth, which no filter's model has in it.

    motions.py --strapd target/release/strapd [--runs 5] [--noise consumer_imu] [--motions walking,car] [--mag]
               [--flags "--aid gravity" ...] [--simulate "--duration 300"] [--each]

Each motion is made by `strapd simulate` (a mean over each interval, as most sensors give it; errors of `--noise`; a
seed a run), estimated by `strapd replay` with each of --flags and by VQF (PyPI `vqf`, its defaults, real time) from the
same samples, and compared with the truth from 5 s on. Without a magnetometer heading is set right at the first scored
sample. Error e = q_est q_true* in earth axes: tilt 2 acos sqrt(w^2 + z^2), heading 2 atan z/w; mean of the size and root
mean square over all samples of all runs, degrees. Coverage: share of the errors about the world's x and y (tilt) and z
(heading) within three times the sigma of the same row. NEES: e^T P^-1 e over its degrees of freedom, mean over all
samples: 1 where sigma is right, less where it is too large. Needs numpy, mcap, mcap-ros2-support; vqf for the peer.
"""

import argparse
import concurrent.futures
import os
import shlex
import struct
import subprocess
import tempfile

import numpy as np
from mcap.reader import make_reader

from broad import product

MOTIONS = [
    "walking --worn waist",
    "walking --worn hand",
    "walking --worn foot",
    "running --worn waist",
    "running --worn foot",
    "circling",
    "arm",
    "car",
    "vibration",
    "drone",
    "hand",
    "boat",
]
GRAVITY = ["--aid gravity", "--aid gravity --bias auto", "--aid none --bias auto --init gravity"]
FIELD = ["--aid gravity+mag", "--aid gravity", "--aid none --bias auto --init gravity"]
FIRST_SCORED = 5.0
TOPICS = {"imu": "/imu/data_raw", "mag": "/imu/mag", "truth": "/truth", "attitude": "/imu/data"}


def numbers(path, topic, count):
    """Stamp (ns) and the first `count` f64 behind header and frame of every message of a topic."""
    stamps, rows = [], []
    with open(path, "rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=[topic]):
            data = message.data
            sec, nsec, length = struct.unpack_from("<iII", data, 4)
            # CDR: eight bytes line up, counted from behind the four of the encapsulation.
            at = 4 + (12 + length + 7) // 8 * 8
            stamps.append(sec * 10**9 + nsec)
            rows.append(struct.unpack_from(f"<{count}d", data, at))
    return np.array(stamps), np.array(rows).reshape(-1, count)


CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def errors(estimate, truth, absolute):
    """Difference in earth axes as rotation vectors (rad), tilt and heading (rad). Heading set right at the start."""
    e = product(estimate, truth * CONJUGATE)
    if not absolute:
        w, z = e[0, 0], e[0, 3]
        length = np.hypot(w, z) or 1.0
        turn = np.tile([w / length, 0.0, 0.0, -z / length], (len(e), 1))
        e = product(turn, e)
    e *= np.where(e[:, :1] < 0, -1, 1)
    size = np.linalg.norm(e[:, 1:], axis=1)
    angle = 2 * np.arctan2(size, e[:, 0])
    vector = e[:, 1:] * np.where(size > 1e-12, angle / np.maximum(size, 1e-12), 2.0)[:, None]
    tilt = 2 * np.arctan2(np.hypot(e[:, 1], e[:, 2]), np.hypot(e[:, 0], e[:, 3]))
    heading = 2 * np.arctan2(e[:, 3], e[:, 0])
    return vector, tilt, heading


def score(estimate, truth, absolute, covariance=None):
    """Sums over one run, so that runs can be added up."""
    good = ~np.isnan(estimate).any(axis=1)
    if not good.any():
        return None
    vector, tilt, heading = errors(estimate[good], truth[good], absolute)
    tilt, heading = np.degrees(tilt), np.degrees(heading)
    found = {
        "n": len(tilt),
        "lost": int((~good).sum()),
        "tilt": np.abs(tilt).sum(),
        "tilt2": (tilt**2).sum(),
        "heading": np.abs(heading).sum(),
        "heading2": (heading**2).sum(),
        "worst": np.abs(tilt).max(),
    }
    if covariance is not None:
        p = covariance[good].reshape(-1, 3, 3)
        sigma = np.sqrt(np.maximum(np.diagonal(p, axis1=1, axis2=2), 1e-24))
        inside = np.abs(vector) <= 3 * sigma
        found["tilt in"] = inside[:, :2].sum() / 2
        found["heading in"] = inside[:, 2].sum()
        level = np.linalg.solve(p[:, :2, :2] + 1e-18 * np.eye(2), vector[:, :2, None])[:, :, 0]
        found["tilt nees"] = (level * vector[:, :2]).sum() / 2
        found["heading nees"] = ((vector[:, 2] / sigma[:, 2]) ** 2).sum()
        found["sigma"] = np.degrees(sigma[-1, 2])
    return found


def replayed(binary, log, flags, stamps, folder):
    """Attitude and covariance about the world's axes at each stamp; NaN where there is none."""
    out = os.path.join(folder, "estimate.mcap")
    command = [binary, "replay", log, "-o", out, "--force", "--quiet", "--compression", "none", *shlex.split(flags)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        return None, done.stderr.strip().splitlines()[:1]
    at, rows = numbers(out, TOPICS["attitude"], 13)
    row_of = dict(zip(at.tolist(), range(len(at))))
    index = np.array([row_of.get(t, -1) for t in stamps.tolist()])
    found = np.where(index[:, None] < 0, np.nan, rows[index])
    return (found[:, [3, 0, 1, 2]], found[:, 4:13]), []


def vqf(secs, gyr, acc, mag):
    import vqf as package

    step = float(np.median(np.diff(secs)))
    args = [np.ascontiguousarray(v) for v in (gyr, acc)]
    if mag is None:
        return package.VQF(step).updateBatch(*args)["quat6D"]
    return package.VQF(step).updateBatch(*args, np.ascontiguousarray(mag))["quat9D"]


def one(args, motion, seed):
    """Every estimator on one run: name -> sums."""
    found, complaints = {}, []
    with tempfile.TemporaryDirectory() as folder:
        log = os.path.join(folder, "run.mcap")
        flags = f"{motion} --seed {seed} --noise {args.noise} --sample-kind average {args.simulate}"
        if "--duration" not in flags:
            flags += " --duration 120"
        if "--rate-hz" not in flags:
            flags += " --rate-hz 100"
        if args.mag:
            flags += " --mag"
        command = [args.strapd, "simulate", *shlex.split(flags), "-o", log, "--quiet", "--compression", "none"]
        made = subprocess.run(command, check=False, capture_output=True, text=True)
        if made.returncode != 0:
            raise SystemExit(f"{' '.join(command)}\n{made.stderr}")
        stamps, imu = numbers(log, TOPICS["imu"], 37)
        gyr, acc = imu[:, 13:16], imu[:, 25:28]
        mag = numbers(log, TOPICS["mag"], 3)[1] if args.mag else None
        # Truth stands at every instant, samples at all but the first: their last columns belong together.
        truth = numbers(log, TOPICS["truth"], 4)[1][-len(stamps) :, [3, 0, 1, 2]]
        secs = (stamps - stamps[0]) * 1e-9
        scored = secs >= FIRST_SCORED
        for flags in args.flags:
            estimate, said = replayed(args.strapd, log, f"{flags} --sample-kind average", stamps, folder)
            complaints += [f"{motion} seed {seed} {flags}: {line}" for line in said]
            if estimate is not None:
                q, p = estimate
                absolute = "mag" in flags
                found[f"strapd {flags}"] = score(q[scored], truth[scored], absolute, p[scored])
        try:
            if args.peer:
                found["VQF"] = score(vqf(secs, gyr, acc, mag)[scored], truth[scored], mag is not None)
        except ImportError as absent:
            complaints.append(str(absent))
    return motion, seed, found, complaints


def add(runs):
    runs = [r for r in runs if r]
    total = {key: sum(r[key] for r in runs) for key in runs[0]}
    total["worst"] = max(r["worst"] for r in runs)
    total["runs"] = len(runs)
    return total


def words(s):
    n = s["n"]
    cells = [
        f"{s['tilt'] / n:.2f} / {np.sqrt(s['tilt2'] / n):.2f}",
        f"{s['heading'] / n:.2f} / {np.sqrt(s['heading2'] / n):.2f}",
    ]
    if "tilt in" in s:
        cells += [
            f"{100 * s['tilt in'] / n:.1f} / {100 * s['heading in'] / n:.1f}",
            f"{s['tilt nees'] / n:.2f} / {s['heading nees'] / n:.2f}",
        ]
    else:
        cells += ["", ""]
    return " | ".join(cells)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strapd", default="target/release/strapd")
    parser.add_argument("--runs", type=int, default=5, help="seeds 1 to this")
    parser.add_argument("--noise", default="consumer_imu")
    parser.add_argument("--motions", help="names or whole commands, separated by commas")
    parser.add_argument("--mag", action="store_true", help="a magnetometer, and VQF with it")
    parser.add_argument("--flags", action="append", help="of a run of strapd; may be given several times")
    parser.add_argument("--simulate", default="", help="more flags of `strapd simulate`")
    parser.add_argument("--each", action="store_true", help="a row for each run too")
    parser.add_argument("--jobs", type=int, default=2)
    parser.set_defaults(peer=True)
    args = parser.parse_args()
    args.strapd = os.path.abspath(args.strapd)
    args.flags = args.flags or (FIELD if args.mag else GRAVITY)
    motions = MOTIONS
    if args.motions:
        asked = args.motions.split(",")
        motions = [m for a in asked for m in ([k for k in MOTIONS if k.startswith(a)] or [a])]
    todo = [(motion, seed) for motion in motions for seed in range(1, args.runs + 1)]
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        done = list(pool.map(one, [args] * len(todo), *zip(*todo)))
    print(f"{args.runs} runs of each, --noise {args.noise} {args.simulate}\n")
    print("| motion | estimator | tilt, deg: mean / rms | heading, deg: mean / rms | within 3 sigma, %: tilt / heading | NEES: tilt / heading |")
    print("|---|---|---|---|---|---|")
    names = [f"strapd {flags}" for flags in args.flags] + ["VQF"]
    everything = {}
    for motion in motions:
        for name in names:
            runs = [(seed, found.get(name)) for m, seed, found, _ in done if m == motion]
            good = [r for _, r in runs if r]
            if not good:
                print(f"| {motion} | {name} | no estimate | | | |")
                continue
            everything.setdefault(name, []).extend(good)
            short = f" ({len(good)} of {len(runs)} runs)" if len(good) < len(runs) else ""
            print(f"| {motion} | {name}{short} | {words(add(good))} |")
            for seed, run in runs if args.each else []:
                print(f"| | seed {seed} | {words(run)} |" if run else f"| | seed {seed} | no estimate | | | |")
    for name, runs in everything.items():
        print(f"| **all** | {name} | {words(add(runs))} |")
    for line in sorted({c for _, _, _, complaints in done for c in complaints}):
        print(line)


if __name__ == "__main__":
    main()

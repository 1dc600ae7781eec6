#!/usr/bin/env python3
"""Processor time of `strapd` and of its peers in Python, in turn in one run.

    speed.py [--samples 1000000] [--rounds 5]

Needs vqf, ahrs, imufusion, scipy from PyPI; a peer that is slower than 20 us a sample gets a hundredth of the samples. Every figure is
processor time of this process and its children (kernel included), a sample, the median of the rounds.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile

import numpy as np
import strapd


def cpu():
    spent = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in spent)


def samples(n, rate_hz=1000.0):
    t = np.arange(n) / rate_hz
    gyr = np.stack([np.sin(3 * t), 0.7 * np.cos(2 * t), 0.3 + 0.1 * np.sin(t)], axis=1)
    truth = strapd.integrate(gyr, rate_hz=rate_hz)
    from scipy.spatial.transform import Rotation

    up = Rotation.from_quat(truth.quat_xyzw).inv().apply([0.0, 0.0, 9.81])
    north = Rotation.from_quat(truth.quat_xyzw).inv().apply([0.0, 20.0, -40.0])
    rng = np.random.default_rng(1)
    gyr = gyr + rng.normal(0, 2e-3, gyr.shape)
    acc, mag = up + rng.normal(0, 0.05, up.shape), north + rng.normal(0, 0.3, north.shape)
    return [np.ascontiguousarray(a) for a in (gyr, acc, mag)]


def jobs(n):
    """Name, samples, what to run."""
    gyr, acc, mag = samples(n)
    few = n // 100
    all_jobs = [
        ("strapd.integrate (auto)", n, lambda: strapd.integrate(gyr, rate_hz=1000.0)),
        ("strapd.integrate (dcm-left)", n, lambda: strapd.integrate(gyr, rate_hz=1000.0, method="dcm-left")),
        ("strapd.estimate, 6D", n, lambda: strapd.estimate(gyr, acc, rate_hz=1000.0)),
        ("strapd.estimate, 9D", n, lambda: strapd.estimate(gyr, acc, mag, rate_hz=1000.0)),
        ("strapd.Estimator.push, blocks of 100", n, lambda: pushed(gyr, acc, 100)),
    ]
    lists = [array[: n // 10].tolist() for array in (gyr, acc)]
    stamps = (np.arange(1, n // 10 + 1) * 1_000_000).tolist()

    def one(rows, forces):
        push = strapd.Estimator(aid="auto" if forces else "none").push_one
        if forces:
            for t, row, force in zip(stamps, rows, forces):
                push(row, force, None, t)
        else:
            for t, row in zip(stamps, rows):
                push(row, None, None, t)

    all_jobs += [
        ("strapd.Estimator.push_one, gyro", n // 10, lambda: one(lists[0], None)),
        ("strapd.Estimator.push_one, 6D", n // 10, lambda: one(*lists)),
    ]
    try:
        import vqf

        all_jobs += [
            ("vqf.VQF.updateBatch, 6D (C++)", n, lambda: vqf.VQF(0.001).updateBatch(gyr, acc)),
            ("vqf.VQF.updateBatch, 9D (C++)", n, lambda: vqf.VQF(0.001).updateBatch(gyr, acc, mag)),
            ("vqf.offlineVQF (C++)", n, lambda: vqf.offlineVQF(gyr, acc, mag, 0.001)),
        ]
    except ImportError:
        print("NOT MEASURED: vqf is not here", file=sys.stderr)
    try:
        import ahrs

        all_jobs += [
            ("ahrs AngularRate", few, lambda: ahrs.filters.AngularRate(gyr=gyr[:few], frequency=1000.0)),
            ("ahrs Madgwick, 6D", few, lambda: ahrs.filters.Madgwick(gyr=gyr[:few], acc=acc[:few], frequency=1000.0)),
        ]
    except ImportError:
        print("NOT MEASURED: ahrs is not here", file=sys.stderr)
    try:
        import imufusion

        degrees, g = np.degrees(gyr[: n // 10]), acc[: n // 10] / 9.81

        def fused():
            fusion = imufusion.Ahrs()
            fusion.set_sample_period(0.001)
            for rate, force in zip(degrees, g):
                fusion.update_no_magnetometer(rate, force)

        all_jobs.append(("imufusion loop, 6D", n // 10, fused))
    except ImportError:
        print("NOT MEASURED: imufusion is not here", file=sys.stderr)
    from scipy.spatial.transform import Rotation

    def looped():
        attitude = Rotation.identity()
        for rate in gyr[:few]:
            attitude = attitude * Rotation.from_rotvec(rate * 0.001)

    all_jobs.append(("scipy Rotation loop", few, looped))
    return all_jobs


def pushed(gyr, acc, block):
    estimator = strapd.Estimator(rate_hz=1000.0)
    for at in range(0, len(gyr), block):
        estimator.push(gyr[at : at + block], acc[at : at + block])


def replays(n, folder):
    """A log of n samples with forces: this package, the command to nowhere, the command to CSV and a reader."""
    from strapd._command import command

    log, out = os.path.join(folder, "log.mcap"), os.path.join(folder, "attitude.csv")
    subprocess.run(
        [command(), "simulate", "random", f"--duration={n / 1000}", "--rate-hz=1000", "-o", log, "--quiet", "--force"], check=True
    )
    say = lambda *words: subprocess.run([command(), "replay", log, "--quiet", "--force", *words], check=True)  # noqa: E731

    def by_csv():
        say("-o", out)
        try:
            import polars

            polars.read_csv(out)
        except ImportError:
            np.genfromtxt(out, delimiter=",", skip_header=1, usecols=range(14))

    return [
        ("strapd.replay", n, lambda: strapd.replay(log)),
        ("strapd replay -o null:", n, lambda: say("-o", "null:")),
        ("strapd replay -o csv, polars.read_csv", n, by_csv),
    ]


def imports(rounds):
    """Processor seconds of an import beyond numpy's."""

    def took(code):
        before = cpu()
        subprocess.run([sys.executable, "-c", code], check=True)
        return cpu() - before

    numpy, ours = [], []
    for _ in range(2 * rounds):
        numpy.append(took("import numpy"))
        ours.append(took("import numpy, strapd"))
    return statistics.median(ours) - statistics.median(numpy)


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--samples", type=int, default=1_000_000)
    asked.add_argument("--rounds", type=int, default=5)
    given = asked.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        all_jobs = jobs(given.samples) + replays(given.samples, folder)
        spent = {name: [] for name, _, _ in all_jobs}
        for _ in range(given.rounds):
            for name, count, job in all_jobs:
                before = cpu()
                job()
                spent[name].append((cpu() - before) / count * 1e6)
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors, {given.rounds} rounds in turn, {given.samples} samples")
    print("| what | us a sample | samples/s |\n|---|---|---|")
    for name, _, _ in all_jobs:
        middle = statistics.median(spent[name])
        print(f"| {name} | {middle:.3f} ({min(spent[name]):.3f} to {max(spent[name]):.3f}) | {1e6 / middle:,.0f} |")
    print(f"import strapd beyond numpy: {imports(given.rounds) * 1e3:.1f} ms of processor time")


if __name__ == "__main__":
    main()

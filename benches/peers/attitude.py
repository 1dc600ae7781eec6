#!/usr/bin/env python3
"""The peers themselves on the data their formulas were judged on.

    cargo run --release --example accuracy -- --coning-csv target/coning.csv
    python3 -m venv target/peers && target/peers/bin/pip install -r benches/peers/attitude-requirements.txt
    target/peers/bin/python benches/peers/attitude.py target/coning.csv

The file holds a coning (10 degrees, 3 Hz, 100 Hz, 10 s), the attitudes our version of their formula
(`examples/accuracy/peers.rs`, `one_exponential`) makes of it, and the truth. Each peer integrates the rates from
the same start, gyro alone. Printed for each: its greatest distance from our version, which must be rounding, and
from the truth. Ends with 1 where a peer and our version of it differ.
"""

import csv
import sys
from importlib.metadata import version

import numpy as np
import vqf
from ahrs.filters import AngularRate
from scipy.spatial.transform import Rotation

# Rounding of a thousand products; VQF keeps its states in double too.
SAME = 1e-12


def rotations(wxyz):
    """Quaternions w, x, y, z as rotations."""
    return Rotation.from_quat(np.roll(wxyz, -1, axis=1))


def by_scipy(rates, start, step):
    """A product of exponentials: scipy's own exp and product."""
    out = [start]
    for turn in Rotation.from_rotvec(rates[1:] * step):
        out.append(out[-1] * turn)
    return Rotation.concatenate(out)


def by_ahrs(rates, start, step):
    """`AngularRate`, closed form."""
    first = np.roll(start.as_quat(), 1)
    return rotations(AngularRate(gyr=rates, q0=first, frequency=1 / step, method="closed").Q)


def by_vqf(rates, start, step):
    """Gyro alone, bias estimation off; its start is the identity."""
    judge = vqf.VQF(step, motionBiasEstEnabled=False, restBiasEstEnabled=False)
    out = [start]
    for rate in rates[1:]:
        judge.updateGyr(np.ascontiguousarray(rate))
        out.append(start * Rotation.from_quat(np.roll(judge.getQuat3D(), -1)))
    return Rotation.concatenate(out)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], newline="") as stream:
        rows = np.array([[float(v) for v in row.values()] for row in csv.DictReader(stream)])
    step = (rows[1, 0] - rows[0, 0]) * 1e-9
    rates, ours, truth = rows[:, 1:4], rotations(rows[:, 4:8]), rotations(rows[:, 8:12])
    print("| | version | from our version of it, rad | from the truth, degrees |\n|---|---|---|---|")
    worst = 0.0
    for name, package, peer in (
        ("`Rotation`", "scipy", by_scipy),
        ("`AngularRate`, closed", "ahrs", by_ahrs),
        ("`VQF`, gyro alone", "vqf", by_vqf),
    ):
        found = peer(rates, truth[0], step)
        apart = (ours.inv() * found).magnitude().max()
        error = np.degrees((truth.inv() * found).magnitude().max())
        worst = max(worst, apart)
        print(f"| {package} {name} | {version(package)} | {apart:.1e} | {error:.4f} |")
    error = np.degrees((truth.inv() * ours).magnitude().max())
    print(f"| our version | | | {error:.4f} |")
    sys.exit(int(worst > SAME))


if __name__ == "__main__":
    main()

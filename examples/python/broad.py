#!/usr/bin/env python3
"""How far an attitude is from optical truth, on recordings of BROAD.

    broad.py FOLDER [TRIAL ...]

FOLDER holds trials as MCAP: /imu/data, /imu/mag, /ground_truth (sensor to earth, z up), /movement (a message at each change). The
logs are read by PyPI's mcap, the numbers taken out of their CDR by numpy; strapd gets arrays. Metric (Laidig et al., "BROAD",
Data 6(7):72, 2021): root mean square of the angle between attitude and truth while there is movement, split into heading and
tilt; without a magnetometer the heading is set right at the first scored sample.
"""

import pathlib
import sys

import numpy as np
import strapd
from mcap.reader import make_reader


def table(payloads, count, skip=0):
    """Stamps (ns) and ``count`` float64 behind the header of CDR messages of one type, ``skip`` of them left out."""
    name = int.from_bytes(payloads[0][12:16], "little")
    first = 4 + (12 + name + 7) // 8 * 8 + 8 * skip
    raw = np.array([np.frombuffer(payload, np.uint8)[: first + 8 * count] for payload in payloads])
    sec = np.ascontiguousarray(raw[:, 4:8]).view("<i4")[:, 0].astype(np.int64)
    nanosec = np.ascontiguousarray(raw[:, 8:12]).view("<u4")[:, 0]
    return sec * 1_000_000_000 + nanosec, np.ascontiguousarray(raw[:, first:]).view("<f8")


def load(path):
    """Stamps, gyro, force, field, truth (NaN where there is none), movement of one trial."""
    found = {"/imu/data": [], "/imu/mag": [], "/ground_truth": []}
    changes = []
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            if channel.topic == "/movement":
                changes.append((message.log_time, bool(message.data[4])))
            elif channel.topic in found:
                found[channel.topic].append(message.data)
    # Of an Imu: orientation and its covariance; rate and its covariance; force.
    t, numbers = table(found["/imu/data"], 3 + 9 + 3, skip=4 + 9)
    gyr, acc = numbers[:, :3], numbers[:, 12:]
    beside = []
    for topic, width in (("/imu/mag", 3), ("/ground_truth", 4)):
        stamps, values = table(found[topic], width)
        rows = np.full((len(t), width), np.nan)
        rows[np.searchsorted(t, stamps)] = values
        beside.append(rows)
    mag, xyzw = beside
    moves = np.zeros(len(t), bool)
    for at, is_moving in changes:
        moves[t >= at] = is_moving
    return t, gyr, acc, mag, xyzw[:, [3, 0, 1, 2]], moves


def scores(t, att, truth, moves, align):
    """Total, heading, tilt, degrees."""
    assert (att.t == t).all()
    scored = moves & np.isfinite(truth).all(axis=1)
    found = strapd.compare(att[scored], (t[scored], truth[scored]), align=align)
    return [found[part]["rms_deg"] for part in ("total", "heading", "inclination")]


def main(folder, wanted):
    trials = sorted(path for path in pathlib.Path(folder).glob("*.mcap") if not wanted or path.name[:2] in wanted)
    if not trials:
        sys.exit(f"{folder}: no trials {wanted or ''}")
    all_scores = []
    for path in trials:
        t, gyr, acc, mag, truth, moves = load(path)
        six = strapd.estimate(gyr, acc, t=t, kind="average")
        nine = strapd.estimate(gyr, acc, mag, t=t, kind="average")
        pair = [scores(t, six, truth, moves, "first-heading"), scores(t, nine, truth, moves, "none")]
        all_scores.append(pair)
        print(f"{path.stem:<48}" + "   ".join("{:6.2f} {:6.2f} {:6.2f}".format(*row) for row in pair))
    mean = np.mean(all_scores, axis=0)
    print(f"{'mean: total, heading, tilt, deg; 6D, 9D':<48}" + "   ".join("{:6.2f} {:6.2f} {:6.2f}".format(*row) for row in mean))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])

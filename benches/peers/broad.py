#!/usr/bin/env python3
"""Attitude filters on recordings with optical truth, by the official metric of BROAD.

    broad.py FOLDER --strapd target/release/strapd [--peers] [--flags "--aid gravity ..."]

FOLDER holds trials as MCAP: /imu/data, /imu/mag, /ground_truth (sensor to earth, z up), /movement (a message at
each change). Metric (Laidig et al., Data 6(7):72, 2021): e = q_est q_ref* in earth axes; total 2 acos|w|, heading
2 atan|z/w|, inclination 2 acos sqrt(w^2 + z^2); root mean square while there is movement and a reference, then the
mean over the trials. Without a magnetometer the heading is set right at the first scored sample.
Needs numpy, mcap, mcap-ros2-support; --peers also vqf, ahrs, imufusion.
"""

import argparse
import csv
import glob
import os
import shlex
import subprocess
import tempfile

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

PEERS = {}


def peer(name):
    def register(run):
        PEERS[name] = run
        return run

    return register


def load(path):
    """Stamps (s), gyro, force, field, reference (NaN where there is none), movement of one trial."""
    rows, fields, truth, movement = {}, {}, {}, []
    nanos = lambda stamp: stamp.sec * 10**9 + stamp.nanosec
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            if channel.topic == "/imu/data":
                w, f = decoded.angular_velocity, decoded.linear_acceleration
                rows[nanos(decoded.header.stamp)] = (w.x, w.y, w.z, f.x, f.y, f.z)
            elif channel.topic == "/imu/mag":
                m = decoded.magnetic_field
                fields[nanos(decoded.header.stamp)] = (m.x, m.y, m.z)
            elif channel.topic == "/ground_truth":
                q = getattr(decoded, "quaternion", None) or getattr(decoded, "orientation", None) or decoded.pose.orientation
                truth[nanos(decoded.header.stamp)] = (q.w, q.x, q.y, q.z)
            elif channel.topic == "/movement":
                movement.append((message.log_time, bool(decoded.data)))
    stamps = np.array(sorted(rows))
    imu = np.array([rows[t] for t in stamps])
    nothing = (np.nan,) * 3
    mag = np.array([fields.get(t, nothing) for t in stamps])
    ref = np.array([truth.get(t, (np.nan,) * 4) for t in stamps])
    moves = np.zeros(len(stamps), bool)
    for at, moving in movement:
        moves[stamps >= at] = moving
    return stamps, imu[:, :3], imu[:, 3:], mag, ref, moves


def product(a, b):
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=1,
    )


def score(estimate, ref, moves, absolute, sigma=None):
    """Total, heading, inclination, degrees; share of the errors about the body's axes within three sigma."""
    scored = moves & ~np.isnan(ref).any(axis=1)
    e, r = estimate[scored], ref[scored]
    if np.isnan(e).any():
        return np.full(4, np.nan)
    if not absolute:
        first = product(e[:1], r[:1] * [1, -1, -1, -1])[0]
        length = np.hypot(first[0], first[3])
        turn = np.tile([first[0] / length, 0.0, 0.0, -first[3] / length], (len(e), 1))
        e = product(turn, e)
    difference = product(e, r * [1, -1, -1, -1])
    difference /= np.linalg.norm(difference, axis=1)[:, None]
    w, z = np.abs(difference[:, 0]), np.abs(difference[:, 3])
    clip = lambda x: np.minimum(1.0, x)
    angles = [2 * np.arccos(clip(w)), 2 * np.arctan2(z, w), 2 * np.arccos(clip(np.hypot(w, z)))]
    within = np.nan
    if sigma is not None:
        body = product(e * [1, -1, -1, -1], r)
        body *= np.where(body[:, :1] < 0, -1, 1)
        within = 100 * np.mean(np.degrees(2 * np.abs(body[:, 1:])) <= 3 * sigma[scored])
    return np.array([np.degrees(np.sqrt(np.mean(a**2))) for a in angles] + [within])


def strapd(binary, flags, path, stamps):
    """Attitude and sigma (degrees, body axes) at each stamp through the command line."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "attitude.csv")
        command = [binary, "replay", path, "-o", out, "--quiet", *shlex.split(flags)]
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(out, newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
    at = {int(row["stamp_ns"]): row for row in rows}
    names = rows[0].keys()
    q = ["w", "x", "y", "z"] if "w" in names else ["qw", "qx", "qy", "qz"]
    columns = [*q, "sigma_x_deg", "sigma_y_deg", "sigma_z_deg"]
    found = np.array([[float(at[t][c]) if t in at else np.nan for c in columns] for t in stamps])
    return found[:, :4], found[:, 4:]


@peer("VQF real time")
def vqf(secs, gyr, acc, mag):
    import vqf as package

    step = float(np.median(np.diff(secs)))
    args = [np.ascontiguousarray(v) for v in (gyr, acc)]
    six = package.VQF(step).updateBatch(*args)["quat6D"]
    nine = None
    if not np.isnan(mag).any():
        nine = package.VQF(step).updateBatch(*args, np.ascontiguousarray(mag))["quat9D"]
    return six, nine


@peer("VQF offline")
def vqf_offline(secs, gyr, acc, mag):
    import vqf as package

    step = float(np.median(np.diff(secs)))
    filled = np.where(np.isnan(mag), 0.0, mag)
    out = package.offlineVQF(np.ascontiguousarray(gyr), np.ascontiguousarray(acc), np.ascontiguousarray(filled), step)
    return out["quat6D"], out["quat9D"]


@peer("imufusion")
def imufusion(secs, gyr, acc, mag):
    import imufusion as package

    steps = np.diff(secs, prepend=secs[0] - np.median(np.diff(secs)))
    six = []
    fusion = package.Ahrs()
    degrees, g = np.degrees(gyr), acc / 9.80665
    for rate, force, step in zip(degrees, g, steps):
        fusion.set_sample_period(step)
        fusion.update_no_magnetometer(rate, force)
        six.append(np.array(fusion.get_quaternion(), float))
    return np.array(six), None


@peer("Madgwick (ahrs)")
def madgwick(secs, gyr, acc, mag):
    from ahrs.filters import Madgwick

    hz = 1.0 / float(np.median(np.diff(secs)))
    return Madgwick(gyr=gyr, acc=acc, frequency=hz).Q, None


@peer("Mahony (ahrs)")
def mahony(secs, gyr, acc, mag):
    from ahrs.filters import Mahony

    hz = 1.0 / float(np.median(np.diff(secs)))
    return Mahony(gyr=gyr, acc=acc, frequency=hz).Q, None


@peer("EKF (ahrs)")
def ekf(secs, gyr, acc, mag):
    from ahrs.filters import EKF

    hz = 1.0 / float(np.median(np.diff(secs)))
    q = EKF(gyr=gyr, acc=acc, frequency=hz, frame="ENU").Q
    # Its earth axes come out with z down: half a turn about x.
    return product(np.tile([0.0, 1.0, 0.0, 0.0], (len(q), 1)), q), None


@peer("AQUA (ahrs)")
def aqua(secs, gyr, acc, mag):
    from ahrs.filters import AQUA

    hz = 1.0 / float(np.median(np.diff(secs)))
    q = AQUA(gyr=gyr, acc=acc, frequency=hz).Q
    # Its quaternion takes earth axes to the body's.
    return q * [1, -1, -1, -1], None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--strapd", default="target/release/strapd")
    parser.add_argument("--flags", action="append", help="of a run of strapd; may be given several times")
    parser.add_argument("--peers", action="store_true", help="run the other filters, too")
    args = parser.parse_args()
    runs = args.flags or ["--aid gravity --sample-kind average"]
    table = {}
    paths = sorted(glob.glob(os.path.join(args.folder, "*.mcap")))
    for path in paths:
        stamps, gyr, acc, mag, ref, moves = load(path)
        secs = (stamps - stamps[0]) * 1e-9
        name = os.path.basename(path)[:-5]
        for flags in runs:
            quaternions, sigma = strapd(args.strapd, flags, path, stamps)
            table.setdefault(f"strapd {flags}", {})[name] = score(quaternions, ref, moves, "+mag" in flags, sigma)
        for who, run in PEERS.items() if args.peers else []:
            try:
                six, nine = run(secs, gyr, acc, mag)
            except ImportError as absent:
                print(f"{who}: {absent}")
                continue
            table.setdefault(f"{who} 6D", {})[name] = score(six, ref, moves, False)
            if nine is not None:
                table.setdefault(f"{who} 9D", {})[name] = score(nine, ref, moves, True)
    print("| deg, total / heading / tilt; within 3 sigma | mean |", " | ".join(os.path.basename(p)[:2] for p in paths), "|")
    print("|---|---|" + "---|" * len(paths))
    words = lambda s: " / ".join(f"{v:.2f}" for v in s[:3]) + ("" if np.isnan(s[3]) else f"; {s[3]:.1f} %")
    for who, trials in table.items():
        cells = [words(trials[os.path.basename(p)[:-5]]) for p in paths]
        print(f"| {who} | **{words(np.mean(list(trials.values()), axis=0))}** |", " | ".join(cells), "|")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""What faults, lost samples and sensor errors cost an attitude filter, beside VQF, through the command line.

    probes.py faults FOLDER  --strapd target/release/strapd [--trials 07,09,31]
    probes.py errors FOLDER  --strapd target/release/strapd
    probes.py motions        --strapd target/release/strapd

`faults` injects each fault, 20 s into the movement, into recordings with optical truth (FOLDER as in `broad.py`), writes
them as MCAP and replays them; `errors` does so with errors of the sensors; `motions` makes its own: a car's turn, free
fall, a day at rest, magnets, vibration. Degrees, total / heading / inclination, root mean square while there is movement,
mean over the trials; without a magnetometer the heading is set right at the first scored sample. VQF (PyPI, its
defaults) knows a fixed period: it has the same samples in order with the median of their steps. Where a sample has no
attitude, the one before it holds. The random ones are the same in every run (seed 7 and 3).
Needs numpy, scipy, mcap, mcap-ros2-support, vqf.
"""

import argparse
import glob
import os
import struct
import tempfile

import numpy as np
from mcap.writer import CompressionType, Writer
from scipy.spatial.transform import Rotation

import broad

STEP = 3.5e-3
IMU = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{0}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
FIELD = """std_msgs/Header header
geometry_msgs/Vector3 magnetic_field
float64[9] magnetic_field_covariance
{0}
"""
HEADER = """MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{0}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{0}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
RULE = "=" * 80


class Run:
    """Samples of one recording and what is true at each; changes give a new one."""

    def __init__(self, stamps, gyr, acc, mag, ref, moves):
        self.stamps, self.gyr, self.acc, self.mag, self.ref, self.moves = stamps, gyr, acc, mag, ref, moves

    def copy(self, **changed):
        return Run(**{**{k: v.copy() for k, v in vars(self).items()}, **changed})

    def only(self, keep):
        return Run(*(v[keep] for v in vars(self).values()))

    def moving(self):
        return int(np.flatnonzero(self.moves)[0])

    def write(self, path):
        """As a recorder of ROS 2 would have it: CDR, header, nanoseconds since 1970."""
        with open(path, "wb") as stream:
            log = Writer(stream, compression=CompressionType.NONE)
            log.start("ros2", "probes")
            schemas = {
                "/imu/data": ("sensor_msgs/msg/Imu", IMU.format(RULE) + RULE + "\n" + HEADER.format(RULE)),
                "/imu/mag": ("sensor_msgs/msg/MagneticField", FIELD.format(RULE) + HEADER.format(RULE)),
            }
            channels = {}
            for topic, (name, text) in schemas.items():
                schema = log.register_schema(name, "ros2msg", text.encode())
                channels[topic] = log.register_channel(topic, "cdr", schema)
            nine = (0.0,) * 9
            unknown = (0.0, 0.0, 0.0, 1.0, -1.0) + (0.0,) * 8
            imu, field = struct.Struct("<4siII4s37d"), struct.Struct("<4siII4s12d")
            for at, w, f, m in zip(self.stamps.tolist(), self.gyr.tolist(), self.acc.tolist(), self.mag.tolist()):
                head = (b"\0\1\0\0", *divmod(at, 10**9), 4, b"imu\0")
                log.add_message(channels["/imu/data"], at, imu.pack(*head, *unknown, *w, *nine, *f, *nine), at)
                log.add_message(channels["/imu/mag"], at, field.pack(*head, *m, *nine), at)
            log.finish()


def held(quaternions):
    """Attitude at every sample: the last one there was."""
    known = ~np.isnan(quaternions).any(axis=1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
    return np.where(known[last][:, None], quaternions[last], [1.0, 0.0, 0.0, 0.0])


def estimates(binary, run, flags=""):
    """6D and 9D of strapd, then of VQF."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        log = os.path.join(folder, "run.mcap")
        run.write(log)
        for aid in ("gravity", "gravity+mag"):
            # What is said of the field is refused where none is used.
            own = "" if aid == "gravity" and "--mag" in flags else flags
            asked = f"--topic /imu/data --aid {aid} --sample-kind average {own}"
            found.append(held(broad.strapd(binary, asked, log, run.stamps)[0]))
    secs = (run.stamps - run.stamps[0]) * 1e-9
    # Its unit of the field does not matter to it; NaN does.
    six, _ = broad.vqf(secs, run.gyr, run.acc, np.full_like(run.mag, np.nan))
    import vqf

    arrays = [np.ascontiguousarray(v) for v in (run.gyr, run.acc, run.mag * 1e6)]
    nine = vqf.VQF(float(np.median(np.diff(secs)))).updateBatch(*arrays)["quat9D"]
    return [found[0], six, found[1], nine]


# Rows that are wanted: those whose name has one of these in it.
ONLY = [""]


def row(name, binary, runs, flags=""):
    """One line of a table: the mean over the runs."""
    if not any(part in name for part in ONLY):
        return
    scores = []
    for run in runs:
        four = estimates(binary, run, flags)
        scores.append([broad.score(q, run.ref, run.moves, absolute)[:3] for q, absolute in zip(four, (False, False, True, True))])
    cells = [" / ".join(f"{v:.2f}" for v in s) for s in np.mean(scores, axis=0)]
    print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def head(what):
    print(f"| {what} | 6D strapd | 6D VQF | 9D strapd | 9D VQF |\n|---|---|---|---|---|", flush=True)


def grouped(run, count):
    """Means of the gyro over `count` samples, force and field of the last."""
    n = len(run.stamps) // count * count
    last = run.only(slice(count - 1, n, count))
    return last.copy(gyr=run.gyr[:n].reshape(-1, count, 3).mean(axis=1))


def lost(run, rng, count, length, until):
    keep = np.ones(len(run.stamps), bool)
    for first in rng.integers(300, len(keep) - until, count):
        keep[first : first + length] = False
    return run.only(keep)


def fault(column, value, length=1):
    def change(run):
        first = run.moving() + 7000
        changed = run.copy()
        array = {"gyr": changed.gyr, "acc": changed.acc, "mag": changed.mag}[column[0]]
        array[first : first + length, column[1]] = value(array[first]) if callable(value) else value
        return changed

    return change


def field_added(run):
    first = run.moving() + 7000
    changed = run.copy()
    changed.mag[first : first + 1430, 0] += 50e-6
    return changed


def faults(binary, runs):
    rng = np.random.default_rng(7)
    head("fault")
    row("complete", binary, runs)
    row("2 % lost in 35 ms bursts", binary, [lost(r, rng, int(0.02 * len(r.stamps) / 10), 10, 20) for r in runs])
    row("4 gaps of 0.5 s", binary, [lost(r, rng, 4, 143, 200) for r in runs])
    for count, hz in ((2, 143), (3, 95), (6, 48)):
        row(f"{hz} Hz (mean of {count})", binary, [grouped(r, count) for r in runs])
    shaken = [np.rint(rng.uniform(-0.3, 0.3, len(r.stamps)) * STEP * 1e9).astype(np.int64) for r in runs]
    row("stamps jittered by 30 %", binary, [r.copy(stamps=r.stamps + by) for r, by in zip(runs, shaken)])
    thinned = []
    for run in runs:
        keep = rng.random(len(run.stamps)) < 0.6
        keep[:10] = True
        thinned.append(run.only(keep))
    row("40 % thinned at random", binary, thinned)
    every = slice(None)
    for name, change in {
        "one NaN of the gyro": fault(("gyr", 0), np.nan),
        "one NaN of the accelerometer": fault(("acc", 0), np.nan),
        "one NaN of the magnetometer": fault(("mag", 0), np.nan),
        "gyro 1e6 rad/s, one sample": fault(("gyr", 1), 1e6),
        "gyro 30 rad/s, one sample": fault(("gyr", 1), 30.0),
        "accelerometer 1e30, one sample": fault(("acc", 1), 1e30),
        "accelerometer 100 m/s^2, three samples": fault(("acc", 1), 100.0, 3),
        "accelerometer 0 for 1 s": fault(("acc", every), 0.0, 286),
        "accelerometer 0 for 10 s": fault(("acc", every), 0.0, 2860),
        "magnetometer 0 for 1 s": fault(("mag", every), 0.0, 286),
        "magnetometer + 50 uT for 5 s": field_added,
        "magnetometer absent after 20 s": fault(("mag", every), np.nan, 10**9),
        "gyro frozen for 0.2 s": fault(("gyr", every), lambda first: first.copy(), 57),
    }.items():
        row(name, binary, [change(r) for r in runs])


def errors(binary, runs):
    def late(run):
        return run.copy(acc=np.concatenate([run.acc[:1], run.acc[:-1]]))

    large = [1.03, 0.97, 1.02]
    head("error of the sensor")
    row("none", binary, runs)
    row("gyro's scale +1, -1, +0.5 %", binary, [r.copy(gyr=r.gyr * [1.01, 0.99, 1.005]) for r in runs])
    row("gyro's scale +3, -3, +2 %", binary, [r.copy(gyr=r.gyr * large) for r in runs])
    row("the same, `--noise uncalibrated`", binary, [r.copy(gyr=r.gyr * large) for r in runs], "--noise uncalibrated")
    row("accelerometer's scale +1, -1, +0.5 %", binary, [r.copy(acc=r.acc * [1.01, 0.99, 1.005]) for r in runs])
    biased = [r.copy(acc=r.acc + [0.1, -0.1, 0.1]) for r in runs]
    row("accelerometer's bias 0.1 m/s^2 on each axis", binary, biased)
    row("the same, `--noise uncalibrated`", binary, biased, "--noise uncalibrated")
    row("accelerometer late by 3.5 ms", binary, [late(r) for r in runs])
    iron = [r.copy(mag=r.mag + np.array([2e-6, -2e-6, 2e-6])) for r in runs]
    row("hard iron 2 uT on each axis", binary, iron)
    row("the same, `--mag-hard-iron 0.03`", binary, iron, "--mag-hard-iron 0.03")


EARTH_FIELD = np.array([0.0, 16e-6, -41e-6])


def made(rng, hz, secs, rates, pushes, bias=(0.002, -0.001, 0.0015), shaken=(0.0, 0.0)):
    """A recording of body rates (rad/s) and earth accelerations (m/s^2), functions of time; truth at a tenth of a step."""
    count, fine = int(secs * hz), 10
    middles = (np.arange(count * fine) + 0.5) / (hz * fine)
    w = rates(middles)
    turns = Rotation.from_rotvec(w / (hz * fine))
    turns = turns.as_quat(scalar_first=True)
    truth, q = np.empty((count, 4)), np.array([[1.0, 0.0, 0.0, 0.0]])
    for k in range(len(turns)):
        q = broad.product(q, turns[k : k + 1])
        if k % fine == fine - 1:
            q /= np.linalg.norm(q)
            truth[k // fine] = q[0]
    at = (np.arange(count) + 1) / hz
    body = Rotation.from_quat(truth, scalar_first=True).inv()
    white = lambda sigma: rng.normal(0.0, 1.0, (count, 3)) * sigma
    gyr = w.reshape(count, fine, 3).mean(axis=1) + np.array(bias) + white(np.radians(0.01) * np.sqrt(hz)) + white(shaken[0])
    acc = body.apply(pushes(at) + [0.0, 0.0, 9.81]) + white(0.003 * np.sqrt(hz)) + white(shaken[1])
    mag = body.apply(np.tile(EARTH_FIELD, (count, 1))) + white(0.3e-6)
    stamps = 1_700_000_000 * 10**9 + np.rint(at * 1e9).astype(np.int64)
    return Run(stamps, gyr, acc, mag, truth, np.ones(count, bool))


def difference(quaternions, truth, absolute, first):
    """Heading and inclination error, degrees; heading set right at row `first`."""
    e = broad.product(quaternions, truth * [1, -1, -1, -1])
    heading = 2 * np.degrees(np.arctan2(e[:, 3], e[:, 0]))
    inclination = 2 * np.degrees(np.arctan2(np.hypot(e[:, 1], e[:, 2]), np.hypot(e[:, 0], e[:, 3])))
    heading = heading - (0.0 if absolute else heading[first])
    return (heading + 180) % 360 - 180, inclination


def probe(name, binary, run, parts, which):
    """Largest inclination and heading error in each part (share of the run), for 6D, 9D or both."""
    four = estimates(binary, run)
    for kind, ours, theirs in (("6D", four[0], four[1]), ("9D", four[2], four[3])):
        if kind not in which:
            continue
        for part, (begin, end) in parts.items():
            rows = slice(int(begin * len(run.ref)), int(end * len(run.ref)))
            cells = []
            for q in (ours, theirs):
                heading, inclination = difference(q, run.ref, kind == "9D", rows.start)
                cells.append(f"{inclination[rows].max():.2f} | {np.abs(heading[rows]).max():.2f} | {heading[rows][-1]:+.2f}")
            print(f"| {name}, {kind}: {part} | " + " | ".join(cells) + " |", flush=True)


def motions(binary):
    rng = np.random.default_rng(3)
    nothing = lambda t: np.zeros((len(t), 3))
    turn = 0.3 * 9.81 / 15

    def turning(t):
        w = np.zeros((len(t), 3))
        w[(t > 60) & (t < 80), 2] = turn
        return w

    def outward(t):
        a, now = np.zeros((len(t), 3)), (t > 60) & (t < 80)
        heading = turn * (t[now] - 60)
        a[now, 0], a[now, 1] = -0.3 * 9.81 * np.sin(heading), 0.3 * 9.81 * np.cos(heading)
        return a

    def braking(t):
        a = np.zeros((len(t), 3))
        a[(t > 60) & (t < 70), 0], a[(t > 90) & (t < 100), 0] = 2.0, -2.0
        return a

    def tumbling(t):
        return np.stack([0.8 * np.sin(0.7 * t), 0.6 * np.sin(1.1 * t + 1), 0.5 * np.cos(0.5 * t)], axis=1)

    def pushed(t):
        return np.stack([1.5 * np.sin(4 * t), np.sin(3 * t), 0.5 * np.sin(5 * t)], axis=1)

    def falling(t):
        a = np.zeros((len(t), 3))
        a[:, 0] = 1.5 * np.sin(4 * t)
        a[(t > 30) & (t < 31.5)] = [0.0, 0.0, -9.81]
        return a

    def vibrating(t):
        return 20 * np.sin(2 * np.pi * np.outer(t, [31.0, 37.0, 41.0]))

    both = ("6D", "9D")
    print("| motion | strapd: largest tilt | largest heading | heading at the end | VQF: largest tilt | largest heading | heading at the end |")
    print("|---|---|---|---|---|---|---|")
    bend = {"the turn": (60 / 140, 80 / 140), "60 s after it": (80 / 140, 1.0)}
    probe("car turns at 0.3 g for 20 s, quiet", binary, made(rng, 100, 140, turning, outward), bend, both)
    rough = (0.005, 0.5)
    probe("the same, rough road", binary, made(rng, 100, 140, turning, outward, shaken=rough), bend, both)
    straight = made(rng, 100, 140, nothing, braking, shaken=rough)
    probe("straight, +0.2 g and -0.2 g for 10 s, rough road", binary, straight, {"from 60 s": (60 / 140, 1.0)}, ("6D",))
    fall = {"the fall": (0.48, 0.56), "after it": (0.56, 1.0)}
    probe("free fall of 1.5 s while turning", binary, made(rng, 200, 60, tumbling, falling), fall, ("6D",))
    unknown = made(rng, 100, 60, tumbling, pushed, bias=np.radians([1.0, -1.0, 1.0]))
    probe("a bias of 1.7 deg/s that nobody said, moving", binary, unknown, {"all": (0.0, 1.0), "from 20 s": (1 / 3, 1.0)}, ("6D",))
    plain = made(rng, 100, 120, tumbling, pushed)
    for secs in (5, 30):
        near = plain.copy()
        rows = slice(5000, 5000 + 100 * secs)
        turned = Rotation.from_quat(near.ref[rows], scalar_first=True).inv()
        near.mag[rows] += turned.apply(np.tile([25e-6, -5e-6, 10e-6], (100 * secs, 1)))
        parts = {"during": (50 / 120, (50 + secs) / 120), "after": ((50 + secs) / 120, 1.0)}
        probe(f"a magnet (25, -5, 10) uT for {secs} s", binary, near, parts, ("9D",))
    shaken = made(rng, 200, 60, tumbling, vibrating)
    probe("vibration of 20 m/s^2 at 31 to 41 Hz, turning", binary, shaken, {"from 18 s": (0.3, 1.0)}, ("6D",))
    count = 864_000
    white = lambda sigma: rng.normal(0.0, sigma, (count, 3))
    walk = np.cumsum(white(np.radians(2e-5) / np.sqrt(10)), axis=0)
    day = Run(
        1_700_000_000 * 10**9 + np.arange(1, count + 1) * 100_000_000,
        np.array([0.003, -0.002, 0.001]) + white(np.radians(0.01) * np.sqrt(10)) + walk,
        np.array([0.0, 0.0, 9.81]) + white(0.01),
        EARTH_FIELD + white(0.3e-6),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.ones(count, bool),
    )
    probe("24 h at rest, 10 Hz", binary, day, {"from 14 min": (0.01, 1.0)}, both)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["faults", "errors", "motions"])
    parser.add_argument("folder", nargs="?", help="of trials with optical truth")
    parser.add_argument("--strapd", default="target/release/strapd")
    parser.add_argument("--trials", help="their numbers, separated by commas")
    parser.add_argument("--only", help="rows with one of these in their name, separated by commas")
    args = parser.parse_args()
    ONLY[:] = (args.only or "").split(",")
    binary = os.path.abspath(args.strapd)
    if args.what == "motions":
        return motions(binary)
    wanted = (args.trials or "07,09,31").split(",") if args.what == "faults" or args.trials else None
    paths = [p for p in sorted(glob.glob(os.path.join(args.folder, "*.mcap"))) if not wanted or os.path.basename(p)[:2] in wanted]
    runs = [Run(*broad.load(p)) for p in paths]
    print(f"{len(runs)} trials: {', '.join(os.path.basename(p)[:2] for p in paths)}\n")
    (faults if args.what == "faults" else errors)(binary, runs)


if __name__ == "__main__":
    main()

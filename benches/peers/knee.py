"""Joint angle of a simulated leg with exact truth: strapd, and the toolbox qmt with VQF.

    python benches/peers/knee.py --strapd target/release/strapd --seeds 1 2 3        # needs numpy, scipy; vqf and qmt for the peer
    python benches/peers/knee.py --strapd target/release/strapd --seconds 20 --play 3 --plot docs/pictures/knee.svg       # the picture of docs/joint.md

Thigh and shank at 1 kHz, the sensors worn in any direction and read as means at 100 Hz; bias 0.3 deg/s, white noise 0.05 deg/s,
accelerometer 0.02 m/s^2 of bias and of noise; still for three seconds at both ends. Degrees, root mean square and largest over all
samples, the mean taken out. ``--play`` is rotation about other axes, deg rms.
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

FINE, RATE = 1000, 100
HEAD = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"


def wander(rng, n, size, seconds):
    keep = np.exp(-1 / (FINE * seconds))
    noise = lfilter([1], [1, -keep], lfilter([1], [1, -keep], rng.normal(0, 1, n)))
    return size * noise / noise.std()


def leg(seed, seconds, play):
    rng = np.random.default_rng(seed)
    n = int(seconds * FINE) + 1
    t = np.arange(n) / FINE
    moving = np.clip((t - 3) / 2, 0, 1) * np.clip((seconds - 3 - t) / 2, 0, 1)
    phase = 2 * np.pi * 0.95 * np.cumsum(moving) / FINE
    facing = np.cumsum(wander(rng, n, np.radians(20), 3) * moving) / FINE
    angle = np.radians(30) * (1 - np.cos(phase + 0.6)) * moving
    thigh = Rotation.from_euler("ZYX", np.c_[facing, np.radians(25) * np.sin(phase) * moving, wander(rng, n, np.radians(4), 0.5) * moving])
    sideways = [wander(rng, n, np.radians(play), 0.5) * moving for _ in range(2)]
    shank = thigh * Rotation.from_euler("YXZ", np.c_[angle, sideways[0], sideways[1]])
    hip = np.c_[np.cumsum(np.c_[np.cos(facing), np.sin(facing)] * 1.2 * moving[:, None], axis=0) / FINE, 0.025 * np.cos(2 * phase) * moving]
    knee = hip + thigh.apply([0, 0, -0.42])
    bodies = {"thigh": (thigh, hip + thigh.apply([0, 0.03, -0.25])), "shank": (shank, knee + shank.apply([0.02, 0.03, -0.2]))}
    every = FINE // RATE
    tables, worn = {}, {}
    for name, (body, place) in bodies.items():
        worn[name] = Rotation.random(random_state=rng)
        sensor = body * worn[name]
        rates = (sensor[:-1].inv() * sensor[1:]).as_rotvec() * FINE
        forces = sensor[:-1].inv().apply(np.gradient(np.gradient(place, 1 / FINE, axis=0), 1 / FINE, axis=0)[:-1] + [0, 0, 9.80665])
        rates, forces = (x.reshape(-1, every, 3).mean(1) for x in (rates, forces))
        rates += np.radians(rng.normal(0, 0.3, 3)) + np.radians(0.05) * rng.normal(0, 1, rates.shape)
        forces += rng.normal(0, 0.02, 3) + 0.02 * rng.normal(0, 1, forces.shape)
        tables[name] = np.c_[(np.arange(len(rates)) + 1) / RATE, rates, forces]
    return tables, np.degrees(angle[every::every])


def error(angle, truth):
    """Zero of the angle and direction of the axis are conventions: the mean is taken out, the better sign counts."""
    errors = (sign * angle - truth for sign in (1, -1))
    return min((e - e.mean() for e in errors), key=lambda e: np.abs(e).mean())


def replayed(at, binary, tables, flags):
    for name, table in tables.items():
        np.savetxt(at / f"{name}.csv", table, delimiter=",", header=HEAD, comments="", fmt="%.9g")
        subprocess.run([binary, "replay", f"{name}.csv", "-q", "-o", f"{name}.mcap", *flags], cwd=at, check=True)


def by_strapd(binary, tables, truth, flags):
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        replayed(at, binary, tables, flags)
        subprocess.run([binary, "relative", "thigh.mcap", "shank.mcap", "-q", "-o", "knee.csv"], cwd=at, check=True)
        rows = np.genfromtxt(at / "knee.csv", delimiter=",", names=True)
    at_row = np.rint(rows["stamp_ns"] * 1e-9 * RATE).astype(int) - 1
    found = error(rows["angle_deg"], truth[at_row])
    return found, (np.abs(found) < 3 * rows["sigma_deg"]).mean()


def by_qmt(tables, truth, offline):
    import qmt
    import vqf

    t = tables["thigh"][:, 0]
    rates, forces, attitudes = [], [], []
    for table in tables.values():
        g, a = np.ascontiguousarray(table[:, 1:4]), np.ascontiguousarray(table[:, 4:7])
        run = vqf.offlineVQF(g, a, None, 1 / RATE) if offline else vqf.VQF(1 / RATE).updateBatch(g, a)
        rates.append(g), forces.append(a), attitudes.append(run["quat6D"])
    axes = [np.ravel(axis) for axis in qmt.jointAxisEstHingeOlsson(*forces, *rates, estSettings={"quiet": True})[:2]]
    # Segments whose z is the joint's axis.
    turns = [Rotation.align_vectors([axis], [[0, 0, 1]])[0] for axis in axes]
    wxyz = lambda r: r.as_quat()[:, [3, 0, 1, 2]]  # noqa: E731
    segments = [Rotation.from_quat(q[:, [1, 2, 3, 0]]) * turn for q, turn in zip(attitudes, turns)]
    rates = [turn.inv().apply(g) for g, turn in zip(rates, turns)]
    corrected = qmt.headingCorrection(*rates, *map(wxyz, segments), t, np.array([0, 0, 1.0]), {})[0]
    relative = segments[0].inv() * Rotation.from_quat(corrected[:, [1, 2, 3, 0]])
    q = relative.as_quat()
    return error(np.degrees(np.unwrap(2 * np.arctan2(q[:, 2], q[:, 3]))), truth)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strapd", required=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--play", type=float, default=0.0)
    parser.add_argument("--no-qmt", action="store_true")
    parser.add_argument("--plot", type=pathlib.Path, metavar="FILE.svg", help="draw the first seed's angle, and compare nothing")
    args = parser.parse_args()
    binary = str(pathlib.Path(args.strapd).resolve())
    if args.plot:
        with tempfile.TemporaryDirectory() as folder:
            replayed(pathlib.Path(folder), binary, leg(args.seeds[0], args.seconds, args.play)[0], ["--smooth"])
            relative = [binary, "relative", "thigh.mcap", "shank.mcap", "-q", "--force", "--plot", args.plot.resolve()]
            return subprocess.run(relative, cwd=folder, check=True)
    show = lambda e: f"{np.sqrt((e**2).mean()):.2f} rms {np.abs(e).max():.2f} most"  # noqa: E731
    for seed in args.seeds:
        tables, truth = leg(seed, args.seconds, args.play)
        for name, flags in (("filter", []), ("smoothed", ["--smooth"])):
            found, inside = by_strapd(binary, tables, truth, ["--sample-kind", "average", *flags])
            print(f"seed {seed} strapd {name}: {show(found)}, {100 * inside:.1f} % within 3 sigma", flush=True)
        for offline in () if args.no_qmt else (False, True):
            print(f"seed {seed} qmt, VQF {'offline' if offline else 'real time'}: {show(by_qmt(tables, truth, offline))}", flush=True)


main()

#!/usr/bin/env python3
"""Whether sigma is true: units of a class of sensors, each with errors of its own, against exact truth.

    honesty.py --strapd target/release/strapd [--runs 200] [--units tactical] [--motions hand,drone] [--each] [--smooth]

A run is a unit (its constant errors drawn from its seed), a motion (in turn) and a minute at 100 Hz, made by
`strapd simulate` and judged as in `motions.py`: aided by gravity with the class of the unit said (--noise) and without,
and the gyro alone, whose bias was removed at rest and whose bias was not. Simulated units have what no estimator here
models: a bias that follows the force along each axis, misalignment of the accelerometer, flicker, resolution, and
motions whose accelerations are no noise. Prints, by class: share of the errors of tilt and heading within three sigma,
%, NEES by degree of freedom (1: right; below: sigma is larger than the errors), errors as mean / rms, degrees. A row is
marked where fewer than 98 % lie within or NEES is not from 0.3 to 2. With --smooth the recordings are smoothed, too, and
runs are counted in which that is worse than the gyro alone after a rest, by more than 5 % and 0.05 degrees of root mean
square, and those beyond 10 degrees of tilt. Needs what `motions.py` needs.
"""

import argparse
import concurrent.futures
import os

import motions

# The class as `replay --noise` calls it -> errors of `simulate --noise`. The gyros are the presets of the same name;
# accelerometers of the class beside them (BMI088, STIM300, QA-2000 data sheets), where the preset has none.
UNITS = {
    # As its maker has calibrated it: what the filter expects where nobody says more.
    "consumer": "consumer_imu,scale-ppm=4000,misalignment=0.16,turn-on-bias=3600,g-sensitivity=36,accel-bias=2,accel-scale-ppm=1000,accel-misalignment=0.05",
    "uncalibrated": "consumer_imu",
    "industrial": "industrial_imu,range=1000",
    "tactical": "tactical,range=1000,accel-noise=80,accel-bias=0.75,accel-scale-ppm=300,accel-misalignment=0.0286",
    "navigation": "navigation,turn-on-bias=0.003,accel-noise=8,accel-bias=0.025,accel-scale-ppm=30,accel-misalignment=0.0005",
}
# With a rest at the start, which the gyro alone is levelled by.
MOTIONS = ["hand", "walking --worn waist", "arm", "drone", "running --worn waist", "walking --worn hand", "circling", "vibration"]
FLAGS = {
    "aided, class said": "--aid gravity --noise {0}",
    "aided, `auto`": "--aid auto",
    "the gyro alone, bias removed": "--aid none --bias auto --init gravity --noise {0}",
    "the gyro alone": "--aid none --init gravity --noise {0}",
}
SMOOTHED = {
    "smoothed, class said": "--smooth --aid gravity --noise {0}",
    "smoothed": "--smooth --aid gravity",
    "aided, class said": FLAGS["aided, class said"],
    "the gyro alone, bias removed": FLAGS["the gyro alone, bias removed"],
}


def one(args, unit, run):
    """Sums of each estimator over one run, with what was said."""
    motion = args.motions[run % len(args.motions)]
    args.noise = UNITS[unit]
    args.simulate = "--duration 60"
    args.flags = [flags.format(unit) for flags in args.estimators.values()]
    _, _, found, complaints = motions.one(args, motion, run + 1)
    return unit, motion, {name: found.get(f"strapd {flags}") for name, flags in zip(args.estimators, args.flags)}, complaints


def rms(s):
    """Of the whole error, degrees."""
    return ((s["tilt2"] + s["heading2"]) / s["n"]) ** 0.5


def against_the_gyro(done):
    """Runs in which smoothing is worse than the gyro alone, by how much in which motion; and those far off."""
    for name in list(SMOOTHED)[:2]:
        pairs = [(u, m, found[name], found["the gyro alone, bias removed"]) for u, m, found, _ in done]
        pairs = [pair for pair in pairs if pair[2] and pair[3]]
        worse = [(u, m, rms(a), rms(b)) for u, m, a, b in pairs if rms(a) > 1.05 * rms(b) and rms(a) > rms(b) + 0.05]
        far = [(u, m) for u, m, a, _ in pairs if (a["tilt2"] / a["n"]) ** 0.5 > 10]
        print(f"{name}: worse than the gyro alone in {len(worse)} of {len(pairs)}, beyond 10 deg of tilt in {len(far)}")
        for unit, motion in sorted({(u, m) for u, m, _, _ in worse}):
            of = [(a, b) for u, m, a, b in worse if (u, m) == (unit, motion)]
            means = [sum(values) / len(of) for values in zip(*of)]
            print(f"  {unit}, {motion}: {len(of)}, mean rms {means[0]:.2f} against {means[1]:.2f}")


def words(s):
    n = s["n"]
    inside = [100 * s[f"{part} in"] / n for part in ("tilt", "heading")]
    nees = [s[f"{part} nees"] / n for part in ("tilt", "heading")]
    rms = [(s[part] / n, (s[f"{part}2"] / n) ** 0.5) for part in ("tilt", "heading")]
    is_true = min(inside) >= 98 and all(0.3 <= v <= 2 for v in nees)
    digits = 2 if rms[0][0] >= 0.1 else 3
    cells = [
        f"{inside[0]:.1f} / {inside[1]:.1f}",
        f"{nees[0]:.2f} / {nees[1]:.2f}",
        *(f"{mean:.{digits}f} / {root:.{digits}f}" for mean, root in rms),
    ]
    return " | ".join(cells) + (" |" if is_true else " | *")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strapd", default="target/release/strapd")
    parser.add_argument("--runs", type=int, default=200, help="of each class")
    parser.add_argument("--units", default=",".join(UNITS), help="classes, separated by commas")
    parser.add_argument("--motions", help="as `simulate` calls them, separated by commas")
    parser.add_argument("--each", action="store_true", help="a row for each motion too")
    parser.add_argument("--smooth", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    args.strapd, args.mag, args.peer = os.path.abspath(args.strapd), False, False
    args.estimators = SMOOTHED if args.smooth else FLAGS
    args.motions = args.motions.split(",") if args.motions else MOTIONS
    todo = [(unit, run) for unit in args.units.split(",") for run in range(args.runs)]
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        done = list(pool.map(one, [args] * len(todo), *zip(*todo)))
    print("| unit | estimator | in 3 sigma, %: tilt / heading | NEES: tilt / heading | tilt, deg: mean / rms | heading | |")
    print("|---|---|---|---|---|---|---|")
    for unit in args.units.split(","):
        for name in args.estimators:
            for motion in [None, *(args.motions if args.each else [])]:
                runs = [found[name] for u, m, found, _ in done if u == unit and motion in (None, m)]
                good = [run for run in runs if run]
                short = f" ({len(good)} of {len(runs)} runs)" if len(good) < len(runs) else ""
                label = f"{unit} | {name}" if motion is None else f"| {motion}"
                print(f"| {label}{short} | {words(motions.add(good))}" if good else f"| {label} | no estimate | | | | |")
    if args.smooth:
        against_the_gyro(done)
    for line in sorted({c for _, _, _, complaints in done for c in complaints}):
        print(line)


if __name__ == "__main__":
    main()

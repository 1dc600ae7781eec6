"""Overlapping Allan deviation: `strapd allan --csv` against allantools on the same log.

    pip install allantools==2024.6 numpy==2.4.6 mcap==1.6.0 mcap-ros2-support==0.6.0
    python tests/oracles/allan.py target/release/strapd [SAMPLES]

Writes a log of white noise, a random walk and a sine about three axes on a large constant rate, runs
strapd over it, and compares every point. Fails beyond 1e-9 relative. Not part of CI: allantools brings a
documentation system with it.
"""

import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import allantools
import numpy as np
from mcap_ros2.writer import Writer

DEFINITION = """\
std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
START = 1_700_000_000_000_000_000
STEP = 10_000_000
LIMIT = 1e-9


def made(samples):
    random = np.random.default_rng(5)
    time = np.arange(samples) * STEP * 1e-9
    white = 1e-3 * random.standard_normal((samples, 3))
    walk = np.cumsum(1e-6 * random.standard_normal((samples, 3)), axis=0)
    sine = 1e-4 * np.sin(np.outer(time, [0.3, 1.7, 11.0]))
    return white + walk + sine + [0.01, -0.02, 1.0]


def write(path, rates):
    minus = [-1.0] + [0.0] * 8
    with open(path, "wb") as file:
        writer = Writer(file)
        schema = writer.register_msgdef("sensor_msgs/msg/Imu", DEFINITION)
        for i, rate in enumerate(rates):
            stamp = START + i * STEP
            writer.write_message(
                topic="/imu/data_raw",
                schema=schema,
                log_time=stamp,
                publish_time=stamp,
                message={
                    "header": {
                        "stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9},
                        "frame_id": "imu",
                    },
                    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                    "orientation_covariance": minus,
                    "angular_velocity": dict(zip("xyz", map(float, rate))),
                    "angular_velocity_covariance": [0.0] * 9,
                    "linear_acceleration": {"x": 0.0, "y": 0.0, "z": 9.80665},
                    "linear_acceleration_covariance": [0.0] * 9,
                },
            )
        writer.finish()


def main():
    strapd = sys.argv[1]
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 100_000
    rates = made(samples)
    with tempfile.TemporaryDirectory() as scratch:
        log, table = Path(scratch, "rest.mcap"), Path(scratch, "rest.csv")
        write(log, rates)
        subprocess.run([strapd, "-q", "allan", log, "--csv", table], check=True)
        with open(table) as file:
            rows = list(csv.DictReader(file))
    steps = np.array([int(row["steps"]) for row in rows])
    worst = 0.0
    for axis, name in enumerate("xyz"):
        ours = np.array([float(row[f"sigma_{name}"]) for row in rows])
        taus, theirs, _, _ = allantools.oadev(
            rates[:, axis], rate=1e9 / STEP, data_type="freq", taus=steps * STEP * 1e-9
        )
        assert len(taus) == len(ours), "allantools left points out"
        off = np.abs(ours / theirs - 1)
        worst = max(worst, off.max())
        print(f"{name}: {len(ours)} points, worst {off.max():.2e} at {taus[off.argmax()]:g} s")
    print(f"allantools {allantools.__version__}, numpy {np.__version__}: worst {worst:.2e}")
    if not worst < LIMIT:
        sys.exit(f"beyond {LIMIT}")


main()

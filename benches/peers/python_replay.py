"""What one writes in Python to get attitude from a log: mcap + mcap-ros2-support + numpy.

    python benches/peers/python_replay.py LOG.mcap [--limit N] [--topic /imu/data_raw]

Reads `sensor_msgs/msg/Imu`, advances q by exp(w dt) per sample with the rate taken as the mean of the
interval that ends at the stamp, and prints one JSON object: messages, wall and CPU seconds (reading and
integrating; not the start of the interpreter), final attitude, versions.
"""

import argparse
import json
import platform
import time
from importlib.metadata import version

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory


def quaternion_product(p, q):
    """Hamilton product of quaternions w, x, y, z."""
    w = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate(([w], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])))


def exp(rotation_vector):
    """Unit quaternion of a rotation vector in rad."""
    angle = np.linalg.norm(rotation_vector)
    scale = np.sin(angle / 2) / angle if angle > 0 else 0.5
    return np.concatenate(([np.cos(angle / 2)], rotation_vector * scale))


def replay(path, topic, limit):
    """Attitude at the last sample and the number of samples."""
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    attitudes = []
    before = None
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, _, _, imu in reader.iter_decoded_messages(topics=[topic]):
            nanos = imu.header.stamp.sec * 1_000_000_000 + imu.header.stamp.nanosec
            if before is not None:
                rate = imu.angular_velocity
                rate = np.array([rate.x, rate.y, rate.z])
                attitude = quaternion_product(attitude, exp(rate * ((nanos - before) * 1e-9)))
                attitude /= np.linalg.norm(attitude)
            before = nanos
            attitudes.append(attitude)
            if len(attitudes) == limit:
                break
    return attitude, len(attitudes)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log")
    parser.add_argument("--topic", default="/imu/data_raw")
    parser.add_argument("--limit", type=int, default=0, help="stop after this many samples; 0 reads all")
    arguments = parser.parse_args()

    start, cpu_start = time.perf_counter(), time.process_time()
    attitude, messages = replay(arguments.log, arguments.topic, arguments.limit)
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
    if messages == 0:
        parser.exit(1, f"{arguments.log}: nothing on {arguments.topic}\n")
    packages = ("mcap", "mcap-ros2-support", "numpy")
    print(
        json.dumps(
            {
                "messages": messages,
                "seconds": seconds,
                "cpu_seconds": cpu_seconds,
                "attitude": dict(zip("wxyz", attitude.tolist())),
                "versions": {"python": platform.python_version()} | {p: version(p) for p in packages},
            }
        )
    )


if __name__ == "__main__":
    main()

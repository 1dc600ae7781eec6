"""What a user of PX4 records of uXRCE-DDS with ROS 2, written by somebody else's program, and what is in it.

    python px4_recordings.py FOLDER

Needs rosbags and numpy. Writes FOLDER/db3 and FOLDER/mcap, recordings of the same messages, and for each topic the samples
as px4_msgs defines them: FOLDER/TOPIC.csv with the stamp in ns, rates in rad/s (rotations in rad), the specific force in m/s^2, both
forward, left, up, and the interval in ns.

Made and last run with: Python 3.13, rosbags 0.11.9, numpy 2.3.
"""

import sys
from pathlib import Path

import numpy
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

COMBINED = """uint64 timestamp # time since system start (microseconds)
int32 RELATIVE_TIMESTAMP_INVALID = 2147483647
float32[3] gyro_rad
uint32 gyro_integral_dt
int32 accelerometer_timestamp_relative
float32[3] accelerometer_m_s2
uint32 accelerometer_integral_dt
uint8 CLIPPING_X = 1
uint8 accelerometer_clipping
uint8 gyro_clipping
uint8 accel_calibration_count
uint8 gyro_calibration_count
"""
IMU = """uint64 timestamp
uint64 timestamp_sample
uint32 accel_device_id
uint32 gyro_device_id
float32[3] delta_angle
float32[3] delta_velocity
uint32 delta_angle_dt
uint32 delta_velocity_dt
uint8 CLIPPING_X = 1
uint8 delta_angle_clipping
uint8 delta_velocity_clipping
uint8 accel_calibration_count
uint8 gyro_calibration_count
"""
TYPES = {"sensor_combined": ("px4_msgs/msg/SensorCombined", COMBINED), "vehicle_imu": ("px4_msgs/msg/VehicleImu", IMU)}
# The agent's clock: microseconds since 1970.
START_US = 1_700_000_000_000_000


def row(stamp_us, gyro, force, interval_us):
    """As it is to be read: y and z turned round, every number the one that 32 bits hold."""
    axes = [1.0, -1.0, -1.0]
    numbers = [float(v) * s for vector in (gyro, force) for v, s in zip(vector, axes)]
    return ",".join([str(stamp_us * 1000), *map(repr, numbers), str(interval_us * 1000)])


def main(folder):
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in TYPES.values():
        store.register(get_types_from_msg(text, name))
    of = {topic: store.types[name] for topic, (name, _) in TYPES.items()}
    rows = {topic: [] for topic in TYPES}
    for form, plugin in [("db3", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)]:
        with Writer(Path(folder) / form, version=9, storage_plugin=plugin) as writer:
            to = {
                topic: writer.add_connection(f"/fmu/out/{topic}", name, typestore=store)
                for topic, (name, _) in TYPES.items()
            }
            for k in range(400):
                stamp = START_US + k * 5000
                gyro = numpy.array([numpy.sin(k * 0.02), 0.3 * numpy.cos(k * 0.013), 0.1], numpy.float32)
                force = numpy.array([0.1, 0.2, -9.8], numpy.float32)
                turn, push = gyro * numpy.float32(0.005), force * numpy.float32(0.005)
                messages = {
                    "sensor_combined": of["sensor_combined"](stamp, gyro, 5000, 0, force, 5000, 0, 0, 1, 1),
                    "vehicle_imu": of["vehicle_imu"](stamp + 130, stamp, 1, 2, turn, push, 5000, 5000, 0, 0, 1, 1),
                }
                for n, (topic, message) in enumerate(messages.items()):
                    data = store.serialize_cdr(message, TYPES[topic][0])
                    writer.write(to[topic], stamp * 1000 + 900_000 + n, data)
                if form == "db3":
                    rows["sensor_combined"].append(row(stamp, gyro, force, 5000))
                    rows["vehicle_imu"].append(row(stamp, turn, push.astype(float) / 0.005, 5000))
    for topic, all_rows in rows.items():
        (Path(folder) / f"{topic}.csv").write_text("\n".join(all_rows) + "\n")
    print(", ".join(f"{topic}: {len(all_rows)} samples" for topic, all_rows in rows.items()))


main(*sys.argv[1:])

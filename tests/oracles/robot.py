"""Writes a robot's recording by mcap-ros2-support, or reads the transforms of one.

    robot.py write OUT.mcap     an IMU on a mast of a robot that turns, its /tf_static and /tf of its wheels
    robot.py read IN.mcap       one line: channels of /tf, and parent, child and rotation of each last transform
"""
import json
import math
import sys

HEADER = "std_msgs/Header header\n"
RULE = "=" * 80 + "\n"
STAMP = RULE + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
VECTOR = RULE + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
QUATERNION = RULE + "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
IMU = (
    HEADER + "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n" + STAMP + VECTOR + QUATERNION
)
TF = (
    "geometry_msgs/TransformStamped[] transforms\n"
    + RULE + "MSG: geometry_msgs/TransformStamped\n" + HEADER + "string child_frame_id\ngeometry_msgs/Transform transform\n"
    + RULE + "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
    + STAMP + VECTOR + QUATERNION
)


def about(axis, angle):
    half = math.sin(angle / 2)
    return dict(zip("xyzw", [*(half * a for a in axis), math.cos(angle / 2)]))


def vector(x, y, z):
    return {"x": x, "y": y, "z": z}


def transform(stamp, parent, child, rotation):
    header = {"stamp": stamp, "frame_id": parent}
    return {"header": header, "child_frame_id": child, "transform": {"translation": vector(0.1, 0.0, 0.4), "rotation": rotation}}


def write(path):
    from mcap_ros2.writer import Writer

    with open(path, "wb") as file:
        writer = Writer(file)
        imu, tf = writer.register_msgdef("sensor_msgs/msg/Imu", IMU), writer.register_msgdef("tf2_msgs/msg/TFMessage", TF)
        start = 1_700_000_000_000_000_000
        mounted = [("base_link", "mast", about((0, 0, 1), 0.3)), ("mast", "imu_link", about((1, 0, 0), math.pi))]
        at = {"sec": start // 10**9, "nanosec": 0}
        fixed = {"transforms": [transform(at, *each) for each in mounted]}
        writer.write_message("/tf_static", tf, fixed, log_time=start, publish_time=start)
        for n in range(500):
            now = start + n * 10_000_000
            stamp = {"sec": now // 10**9, "nanosec": now % 10**9}
            # The sensor hangs upside down: it reads the turn the other way round, and gravity down its z.
            message = {
                "header": {"stamp": stamp, "frame_id": "imu_link"},
                "orientation": about((0, 0, 1), 0),
                "orientation_covariance": [-1.0] + [0.0] * 8,
                "angular_velocity": vector(0.0, 0.0, -0.5),
                "angular_velocity_covariance": [0.0] * 9,
                "linear_acceleration": vector(0.0, 0.0, -9.81),
                "linear_acceleration_covariance": [0.0] * 9,
            }
            writer.write_message("/imu/data_raw", imu, message, log_time=now, publish_time=now)
            if n % 10 == 0:
                wheels = {"transforms": [transform(stamp, "base_link", "wheel", about((0, 1, 0), n * 0.1))]}
                writer.write_message("/tf", tf, wheels, log_time=now, publish_time=now)
        writer.finish()


def read(path):
    from mcap.reader import make_reader
    from mcap_ros2.reader import read_ros2_messages

    with open(path, "rb") as file:
        channels = [c.topic for c in make_reader(file).get_summary().channels.values()]
    last, count = {}, 0
    for message in read_ros2_messages(path, topics=["/tf"]):
        for each in message.ros_msg.transforms:
            count += 1
            q = each.transform.rotation
            last[each.child_frame_id] = [each.header.frame_id, [q.w, q.x, q.y, q.z]]
    print(json.dumps({"channels": channels.count("/tf"), "transforms": count, "last": last}))


{"write": write, "read": read}[sys.argv[1]](sys.argv[2])

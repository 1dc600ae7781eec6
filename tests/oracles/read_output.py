"""Reads an MCAP written by strapd with other people's readers and compares it with the NDJSON of the same run.

    python read_output.py out.mcap out.ndjson

Every message is decoded twice, by `mcap` + `mcap-ros2-support` and by `rosbags` (CDR), or by `mcap` and
the standard JSON reader (--encoding json); checksums are checked. Quaternion, rate and stamp of every
message must equal those of the NDJSON line with the same number; an orientation's covariance, about the
fixed axes of the world, must have the line's sigma once scipy has turned it to body axes. Exit code 0 and one line when they do.

Made and last run with: Python 3.13, mcap 1.6.0, mcap-ros2-support 0.6.0, rosbags 0.11.9, scipy 1.17.1.
"""

import json
import sys
from pathlib import Path

import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

# The promise. The bits are the same, so this leaves room for a reader that goes through text.
TOLERANCE = 1e-12


def close(a, b, what):
    if len(a) != len(b) or not all(abs(x - y) <= TOLERANCE for x, y in zip(a, b)):
        sys.exit(f"{what}: {list(a)} is not {list(b)}")


def wxyz(q):
    get = q.get if isinstance(q, dict) else lambda name: getattr(q, name)
    return [get(name) for name in "wxyz"]


def xyz(v):
    return [v.x, v.y, v.z]


def expected(path):
    lines = [json.loads(line) for line in open(path)]
    without_repeats = [
        line for n, line in enumerate(lines) if n == 0 or line["stamp"] != lines[n - 1]["stamp"]
    ]
    return lines, without_repeats


def compare(decoded, lines, transforms, reader):
    """`decoded`: (topic, stamp in ns, wxyz, rate or None, sigma in degrees or None), in file order."""
    left, left_tf = iter(lines), iter(transforms)
    counts = [0, 0]
    for topic, stamp, q, rate, sigma in decoded:
        is_tf = topic == "/tf"
        line = next(left_tf if is_tf else left, None)
        if line is None:
            sys.exit(f"{reader}: more messages on {topic} than lines")
        what = f"{reader} {topic} seq {line['seq']}"
        if stamp != line["stamp"]["sec"] * 10**9 + line["stamp"]["nsec"]:
            sys.exit(f"{what}: stamp {stamp}")
        close(q, wxyz(line["q"]), what)
        if rate is not None:
            close(rate, line["rate"], what)
        if sigma is not None and not np.allclose(sigma, line["sigma_deg"], rtol=1e-9, atol=1e-9):
            sys.exit(f"{what}: sigma {sigma} is not {line['sigma_deg']}")
        counts[is_tf] += 1
    if counts != [len(lines), len(transforms)]:
        sys.exit(f"{reader}: {counts} messages, expected {[len(lines), len(transforms)]}")
    return counts


def ros_stamp(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def from_ros(topic, message):
    if topic == "/tf":
        (t,) = message.transforms
        if (t.header.frame_id, t.child_frame_id) != ("world", "imu_link"):
            sys.exit(f"frames {t.header.frame_id} {t.child_frame_id}")
        close(xyz(t.transform.translation), [0, 0, 0], "translation")
        return topic, ros_stamp(t.header), wxyz(t.transform.rotation), None, None
    covariance = list(message.orientation_covariance)
    matrix = np.array(covariance).reshape(3, 3)
    if (matrix != matrix.T).any() or not (np.linalg.eigvalsh(matrix) > 0).all():
        sys.exit(f"orientation covariance {covariance}")
    absent = message.linear_acceleration_covariance[0] == -1
    if absent != (xyz(message.linear_acceleration) == [0, 0, 0]):
        sys.exit("an acceleration that is marked as absent is not zero, or the reverse")
    q = wxyz(message.orientation)
    # The order the rest of the world reads: scipy takes x, y, z, w.
    close(Rotation.from_quat(q[1:] + q[:1]).as_quat(canonical=False), q[1:] + q[:1], "scipy")
    body = Rotation.from_quat(q[1:] + q[:1]).as_matrix()
    sigma = np.degrees(np.sqrt(np.diag(body.T @ matrix @ body)))
    return topic, ros_stamp(message.header), q, xyz(message.angular_velocity), sigma


def from_json(channel, message):
    v = json.loads(message.data)
    if channel.topic == "/tf":
        stamp, q, rate = v["timestamp"], v["rotation"], None
    else:
        stamp, q, rate = v["stamp"], v["q"], v["rate"]
    return channel.topic, stamp["sec"] * 10**9 + stamp["nsec"], wxyz(q), rate, None


def main(mcap_path, ndjson_path):
    lines, transforms = expected(ndjson_path)
    with open(mcap_path, "rb") as f:
        reader = make_reader(f, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        is_ros = reader.get_header().profile == "ros2"
        by_index = reader.iter_messages(log_time_order=False)
        if is_ros:
            decoded = [
                from_ros(channel.topic, message)
                for _, channel, _, message in reader.iter_decoded_messages(log_time_order=False)
            ]
        else:
            decoded = [from_json(channel, message) for _, channel, message in by_index]
        names = {record.name for record in reader.iter_metadata()}
    counts = compare(decoded, lines, transforms, "mcap")
    if "strapd" not in names:
        sys.exit("no metadata record `strapd`")
    if summary.statistics.message_count != sum(counts):
        sys.exit("the statistics do not count the messages")

    # From beginning to end, as from a pipe: every chunk's checksum and the one of the data section.
    with open(mcap_path, "rb") as f:
        linear = NonSeekingReader(f, validate_crcs=True).iter_messages(log_time_order=False)
        if sum(1 for _ in linear) != sum(counts):
            sys.exit("the linear reader counts otherwise")

    if is_ros:
        with AnyReader([Path(mcap_path)]) as bag:
            for connection in bag.connections:
                (qos,) = connection.ext.offered_qos_profiles
                if (qos.depth, qos.reliability.name, qos.durability.name) != (10, "RELIABLE", "VOLATILE"):
                    sys.exit(f"quality of service {qos}")
            compare(
                (
                    from_ros(connection.topic, bag.deserialize(raw, connection.msgtype))
                    for connection, _, raw in bag.messages()
                ),
                lines,
                transforms,
                "rosbags",
            )
    print(f"{counts[0]} attitudes, {counts[1]} transforms: equal")


main(*sys.argv[1:])

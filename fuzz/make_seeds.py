"""Writes `seeds/`: one good input or two for each target, from which fuzzers and the mutation test start.

    python3 fuzz/make_seeds.py      (needs: pip install mcap lz4 zstandard)
"""

import io
import math
import pathlib
import struct

from mcap.writer import CompressionType, Writer

here = pathlib.Path(__file__).parent / "seeds"


def seed(target, name, data):
    (here / target).mkdir(parents=True, exist_ok=True)
    (here / target / name).write_bytes(data)


class Cdr:
    """XCDR1, or ROS 1 where nothing is aligned and strings have no end."""

    def __init__(self, order="<", ros1=False):
        self.order, self.ros1, self.body = order, ros1, b""

    def put(self, form, *values):
        for value in values:
            size = struct.calcsize(form)
            if not self.ros1:
                self.body += b"\0" * (-len(self.body) % size)
            self.body += struct.pack(self.order + form, value)
        return self

    def text(self, text):
        data = text.encode() + (b"" if self.ros1 else b"\0")
        self.put("I", len(data))
        self.body += data
        return self

    def header(self, frame):
        if self.ros1:
            self.put("I", 7)
        return self.put("i", 1700000000).put("I", 5000000).text(frame)

    def imu(self, frame):
        self.header(frame).put("d", 0, 0, 0, 1, *[0.1] * 9)
        return self.put("d", 0.5, -0.25, 2, *[0.01] * 9, 0, 0, 9.81, *[0.2] * 9)

    def rig(self):
        self.put("I", 2).text("a").text("").put("I", 2)
        for frame in ["x", "yy"]:
            self.header(frame).put("d", 1, 2, 3)
        self.put("I", 3).put("f", 1, 2, 3).put("B", 7).put("d", 0.5, -0.25, 2)
        return self.put("B", 1) if self.ros1 else self.put("i", 1).put("I", 2)

    def message(self):
        if self.ros1:
            return self.body
        return bytes([0, 1 if self.order == "<" else 0, 0, 0]) + self.body


for order, name in [("<", "little"), (">", "big")]:
    seed("cdr", f"imu_{name}", b"\0" + Cdr(order).imu("imu_link").message())
    seed("cdr", f"rig_{name}", b"\2" + Cdr(order).rig().message())
transform = Cdr().put("I", 1).header("world").text("imu").put("d", 0, 0, 0, 0, 0, 0, 1)
seed("cdr", "tf", b"\1" + transform.message())
seed("ros1", "imu", b"\0" + Cdr(ros1=True).imu("imu").message())
seed("ros1", "rig", b"\1" + Cdr(ros1=True).rig().message())

seed(
    "json",
    "imu",
    b'\0{"header":{"stamp":{"sec":1,"nanosec":2},"frame_id":"a\\u00e9"},"angular_velocity":{"x":1.5,"y":-2e-3,"z":3},'
    b'"orientation":{"x":0,"y":0,"z":0,"w":1},"linear_acceleration":{"x":0,"y":null,"z":9.81}}',
)
seed("json", "batch", b'\1{"timestamp":17,"samples":[{"gyro":[1,2,3]},{"gyro":[4,5,6e400]}]}')


def varint(n):
    out = b""
    while n > 127:
        out, n = out + bytes([n & 127 | 128]), n >> 7
    return out + bytes([n])


def field(number, data):
    if isinstance(data, int):
        return varint(number << 3) + varint(data)
    return varint(number << 3 | 2) + varint(len(data)) + data


def described(name, number, label, kind, of=b""):
    body = field(1, name) + field(3, number) + field(4, label) + field(5, kind)
    return field(2, body + (field(6, of) if of else b""))


sample = field(1, struct.pack("<3f", 0.1, 0.2, 0.3)) + field(2, 300)
seed("protobuf", "batch", b"\0" + field(4, sample) + field(4, sample))
descriptors = field(
    1,
    field(1, b"p")
    + field(2, b"p")
    + field(4, field(1, b"S") + described(b"gyro", 1, 3, 2) + described(b"t", 2, 1, 3))
    + field(4, field(1, b"B") + described(b"samples", 4, 3, 11, b".p.S")),
)
print("DESCRIPTORS: b\"" + "".join(f"\\x{b:02x}" for b in descriptors) + '"')
seed("schema", "protobuf", descriptors + b"\xff" + field(4, sample))
rule = "=" * 80
rosmsg = f"std_msgs/Header header\nfloat64[3] gyro\nB[] more\n{rule}\nMSG: a/B\nstring<=5 s\nfloat32[<=4] f\nbool B=1\n"
seed("schema", "rosmsg", rosmsg.encode() + b"\xff\0\1\0\0" + bytes(64))
idl = "module a { module msg { typedef double v[3]; enum E { X, Y }; struct A { @key E e; v gyro; sequence<string<4>, 8> s; }; }; };"
seed("schema", "idl", idl.encode() + b"\xff\0\1\0\0" + bytes(64))

lines = [
    '{"class":"RATE","id":"imu0","seq":17,"stamp":{"sec":1700000000,"nsec":5000000},"gyro":[0.01,0.0,-0.2]}',
    '{"class":"RATE","id":"imu0","stamp_ns":1700000000006000000,"gyro":[0.01,0.0,-0.2],"accel":[0,0,9.81],"temp":20.5}',
    '{"stamp":1700000000.007,"wx":0.1,"wy":0.2,"wz":0.3}',
    '{"class":"RATE","id":"d","sample_kind":"delta-angle","dt_ns":1000000,"stamp_ns":1700000000008000000,"gyro":[1e-3,0,0]}',
    '{"class":"RATE","id":"b\\u0041","batch":[{"stamp_ns":1700000000009000000,"gyro":[1,2,3]}]}',
    "",
]
seed("lines", "samples", "\n".join(lines).encode())
rows = [
    "id,stamp_ns,log_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind",
    '"a, ""b""",1700000000000000000,1700000000000000007,0.1,-2e-3,nan,0,0,9.81,1,0,0,0,4000000,average',
    "imu,1700000000004000000,,0.1,0.2,0.3,,,,,,,,,",
    "imu,1700000000008000000,1700000000008000001,0.1,,0.3,,,,,,,,,rate",
    "",
]
seed("lines", "rows", "\n".join(rows).encode())


def packed(stream, seq, *more, kind=1, form="3d"):
    body = struct.pack("<Qq" + form, seq, 1700000000000000000 + seq * 500000, *more)
    return struct.pack("<BBHI", 0xF8, kind, 8 + len(body), stream) + body


bound = '{"class":"PACKED","stream":1,"id":"imu0"}\n{"class":"PACKED","stream":2,"id":"d","sample_kind":"delta-angle","gyro_unit":"deg"}\n'
objects = [
    packed(1, 0, 0.1, -0.2, 3),
    packed(1, 1, 0.1, -0.2, 3, 0, 0, 9.81, form="6d"),
    packed(2, 0, 1e-3, 0, math.nan, *[math.nan] * 3, 500000, form="6dq"),
    packed(1, 2, 1, 0, 0, 0, 0.1, 0.2, 0.3, 0, 0, 0, 0x80, 3, kind=2, form="10d2I"),
    b"\xf8\x01\x07\0 hopeless\n",
    b"\xf8\x01\0\0\n",
]
seed("lines", "packed", bound.encode() + b"".join(objects) + "\n".join(lines).encode() + objects[1][:50])
talk = ['{"class":"POLL"}', '{"class":"WATCH","id":"imu0","rate_hz":50}', '{"class":"AUTH","token":"x"}', '{"class":"WATCH","enable":false}']
seed("session", "talk", b"\x40" + "\n".join(talk + lines).encode())
motion = [
    '{"class":"RATE","id":"%s","seq":%d,"stamp":{"sec":1700000000,"nsec":%d},"gyro":[0.1,%g,3]}' % ("ab"[k % 2], k // 2, k * 500000, 0.1 * k)
    for k in range(24)
]
turn = [packed(1 + k % 2, k // 2, 0.1, 0.1 * k, 3) for k in range(24)]
watch = b'{"class":"WATCH","packed":true,"rate_hz":500}\n'
for name, size in [("packed_as_lines", b"\x40"), ("packed", b"\xff")]:
    seed("session", name, size + bound.encode() + b"".join(turn[:12]) + watch + b"".join(objects) + b"".join(turn[12:]))
seed("session", "motion", b"\xff" + "\n".join(motion + [""]).encode())

seed("foxglove", "subscribe", b'{"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":8,"channelId":2}]}')
seed("foxglove", "unsubscribe", b'{"op":"unsubscribe","subscriptionIds":[7,8]}')
seek = struct.pack("<BBfBQI", 3, 0, 2.0, 1, 1_700_000_000_000_000_000, 4) + b"r-17"
seed("foxglove", "playback", seek)

for name, options in {
    "none": dict(compression=CompressionType.NONE),
    "lz4": dict(compression=CompressionType.LZ4),
    "zstd": dict(compression=CompressionType.ZSTD),
    "unchunked": dict(use_chunking=False),
}.items():
    file = io.BytesIO()
    writer = Writer(file, chunk_size=700, **options)
    writer.start(profile="ros2")
    schema = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"# text")
    imu = writer.register_channel("/imu", "cdr", schema, {"k": "v"})
    other = writer.register_channel("/other", "json", 0)
    for n in range(24):
        channel = other if n % 3 == 1 else imu
        writer.add_message(channel, 10_000_000 + n * 1000 - n % 4 * 3000, bytes(range(n, n + 40)), n, n)
    writer.add_metadata("m", {"a": "b"})
    writer.add_attachment(0, 0, "att", "text/plain", b"hello")
    writer.finish()
    seed("mcap", name, file.getvalue())

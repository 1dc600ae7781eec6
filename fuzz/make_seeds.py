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
rows = ["boot: rst:0x1", "3,0.2", "time_ms,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"] + ["%d,0,0,1,%d,0,2.5" % (10 * k, k) for k in range(40)]
seed("session", "table", b"\x20" + "\n".join(rows + [""]).encode())
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

# Frames of a vehicle's link, without the times that a ground station puts before them.
log = (here.parents[1] / "fixtures/ardupilot.tlog").read_bytes()
frames, at = b"", 0
while at < len(log):
    mark, length, flags = log[at + 8 : at + 11]
    end = at + 8 + length + (8 if mark == 0xFE else 12 + 13 * (flags & 1))
    frames += log[at + 8 : end]
    at = end
seed("mcap", "mavlink_capture", frames[:2500])



# Frames of sensors, after their makers' protocol sheets.


def xsens(n):
    items = [(0x1020, ">H", n % 65536), (0x1060, ">I", 100 * n), (0x4020, ">3f", 0, 0.1, 9.8), (0x8020, ">3f", 0.01 * n, -0.5, 0.25)]
    items += [(0xC020, ">3f", 1, 0.5, 0.25), (0x2010, ">4f", 1, 0, 0, 0), (0xE020, ">I", 7)]
    body = b"".join(struct.pack(">HB", of, struct.calcsize(form)) + struct.pack(form, *values) for of, form, *values in items)
    packet = b"\xff\x36" + bytes([len(body)]) + body
    return b"\xfa" + packet + bytes([-sum(packet) % 256])


def ximu3(n):
    body = b"\xc9" + struct.pack("<Q6f", 10000 * n, 0.5 * n, -2, 3, 0, 0.1, 1)
    stuffed = body.replace(b"\xdb", b"\xdb\xdd").replace(b"\n", b"\xdb\xdc") + b"\n"
    return stuffed + b"M,%d,0.5,0.25,-0.5\r\n" % (10000 * n) + b"^A" + stuffed


def witmotion(n):
    frames = b""
    for kind, numbers in ((0x50, (24 | 5 << 8, 17 | 8 << 8, n << 8, 0)), (0x51, (0, 0, 2048, 0)), (0x52, (n, -20, 30, 0)), (0x54, (100, -50, 9, 0))):
        frame = b"\x55" + bytes([kind]) + struct.pack("<4h", *numbers)
        frames += frame + bytes([sum(frame) % 256])
    return frames


def vectornav(n):
    text = b"VNYMR,-165.981,-037.301,+001.245,+00.2901,+00.0720,+00.7482,-05.966,-00.150,-07.836,+00.001373,-00.001533,-00.001054"
    check = 0
    for byte in text:
        check ^= byte
    message = struct.pack("<BHHQ3f3fH", 0x05, 1 | 1 << 5, 1 << 9 | 1 << 11, 10_000_000 * n, 0.01 * n, -0.5, 0.25, 0, 0, -9.8, 0)
    crc = 0
    for byte in message:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return b"\xfa" + message + struct.pack(">H", crc) + b"$" + text + b"*%02X\r\n" % check


def mip(n):
    fields = ((0x04, ">3f", 0, 0, -1), (0x05, ">3f", 0.01 * n, -0.5, 0.25), (0x06, ">3f", 0.1, 0.2, 0.4), (0xD5, ">Q", 10_000_000 * n))
    body = b"".join(bytes([2 + struct.calcsize(form), of]) + struct.pack(form, *values) for of, form, *values in fields)
    packet = b"\x75\x65\x80" + bytes([len(body)]) + body
    one = two = 0
    for byte in packet:
        one = (one + byte) % 256
        two = (two + one) % 256
    return packet + bytes([one, two])


for nth, device in enumerate((ximu3, xsens, witmotion, vectornav, mip)):
    for which, cut in ((nth, 0), (6, 7 * 9)):
        seed("devices", f"{device.__name__}{'_auto' * (which == 6)}", bytes([which + cut]) + b"".join(map(device, range(12))))
    seed("mcap", f"{device.__name__}_capture", b"".join(map(device, range(1, 25))))
seed("devices", "mavlink", bytes([5]) + frames[:1000])


def layout(of, size, name, letters, columns):
    return struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 0x80, of, size, name, letters, columns)


# A log of ArduPilot, after its LogStructure.h.
log = layout(0x80, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
log += layout(0x81, 54, b"IMU", b"QBffffffIIfBBHH", b"TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")
log += layout(0x82, 18, b"MAG", b"QBhhh", b"TimeUS,I,MagX,MagY,MagZ")
log += layout(0x83, 28, b"ATT", b"QccccCCCCB", b"TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF")
for n in range(10):
    t = 10_000_000 + 2500 * n
    for i in range(2):
        log += struct.pack("<BBBQBffffffIIfBBHH", 0xA3, 0x95, 0x81, t, i, 0.1 * n, 0.2, 0.3, 0.1, 0.2, -9.8, 0, 0, 35.0, 1, 1, 400, 400)
    log += struct.pack("<BBBQBhhh", 0xA3, 0x95, 0x82, t, 0, 200, -50, 400)
    log += struct.pack("<BBBQhhhhHHHHB", 0xA3, 0x95, 0x83, t, 0, 1000, 0, -500, 0, 4000, 0, 0, 1)
seed("mcap", "dataflash", log)

# Tables of text, after their makers' documentation.


def rows(n, cells, separator=",", end="\n"):
    return "".join(separator.join(str(cell) for cell in cells(k)) + end for k in range(n))


def moving(k):
    t = 0.01 * k
    return [round(v, 6) for v in (math.sin(t), 1.3 * math.cos(t), 0.4, 0.1, 0.2, 9.8)]


NS = 1_700_000_000_000_000_000
tables = {
    "euroc": "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
    + rows(30, lambda k: [NS + k * 5_000_000, *moving(k)]),
    "sensor_logger": "time,seconds_elapsed,z,y,x\n" + rows(30, lambda k: [NS + k * 10_000_000, k / 100, *moving(k)[:3]]),
    "phyphox": '"Time (s)";"Gyroscope x (rad/s)";"Gyroscope y (rad/s)";"Gyroscope z (rad/s)"\n'
    + rows(30, lambda k: [f"{v:.3E}".replace(".", ",") for v in (k / 100, *moving(k)[:3])], ";"),
    "physics": "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz\n" + rows(20, lambda k: [k / 100, *moving(k)[3:], 0, 0, 0, *moving(k)[:3]]),
    "xsens": "// Update Rate: 100.0Hz\nPacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMat[1][1]\tMat[2][1]\tMat[3][1]\tMat[1][2]\tMat[2][2]\tMat[3][2]\tMat[1][3]\tMat[2][3]\tMat[3][3]\n"
    + rows(20, lambda k: [(65_530 + k) % 65_536, "", *moving(k)[3:], *moving(k)[:3], 0, 1, 0, -1, 0, 0, 0, 0, 1], "\t", "\t\r\n"),
    "dot": "sep=,\nDeviceTag:,DOT\nOutputRate:,60Hz\nPacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n"
    + rows(20, lambda k: [k, (4_294_900_000 + k * 16_667) % 2**32, 1, 0, 0, 0, *moving(k)[3:], *moving(k)[:3]]),
    "increments": "sep=,\nDeviceTag:,DOT\nOutputRate:,60Hz\nPacketCounter,SampleTimeFine,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3]\n"
    + rows(20, lambda k: [k, k * 16_667, 1, *(round(v / 120, 9) for v in moving(k)[:3]), *(round(v / 60, 9) for v in moving(k)[3:])]),
    "steps": "dt,gx,gy,gz\n" + rows(20, lambda k: [0.01, *moving(k)[:3]]),
    "gcsv": "GYROFLOW IMU LOG\nversion,1.3\norientation,YxZ\ntscale,0.001\ngscale,0.00122\nascale,0.000488\nt,gx,gy,gz,ax,ay,az\n"
    + rows(20, lambda k: [k * 10, *(round(500 * v) for v in moving(k))]),
    "shimmer": "Timestamp_Unix_CAL\tGyro_X_CAL\tGyro_Y_CAL\tGyro_Z_CAL\nms\tdeg/s\tdeg/s\tdeg/s\n"
    + rows(20, lambda k: [NS // 10**6 + k * 10, *moving(k)[:3]], "\t"),
    "blanks": "# t_us  wx_dps wy_dps wz_dps\n" + rows(20, lambda k: [k * 10_000, *moving(k)[:3]], "  "),
    "dated": "timestamp | wx | wy | wz\n" + rows(20, lambda k: [f"2023-11-14T22:13:20.{k:02}Z", *moving(k)[:3]], " | "),
    "by_number": "gyro=2:3:4:deg/s,stamp=1:ms,accel=5:6:7:g\n" + rows(20, lambda k: [k * 10, *moving(k)]),
    "two": ("time_s,gyro_x,gyro_y,gyro_z\n" + rows(10, lambda k: [k / 100, *moving(k)[:3]])) * 2
    + "time_s,gyro_z,gyro_y,gyro_x\n"
    + rows(5, lambda k: [k / 100, *moving(k)[:3]]),
}
for name, text in tables.items():
    seed("delimited", name, text.encode())

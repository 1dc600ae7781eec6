"""What strapd sends to other programs and writes for them, read by readers nobody here wrote, against its own NDJSON.

    python tests/oracles/other_programs.py target/debug/strapd fixtures/xsens_mti.mcap fixtures/ardupilot.tlog
    (needs: pip install python-osc pymavlink telemetry-parser bvhio)

Prints a line for each reader; ends with an error where one reads something else.
"""
import json
import math
import os
import socket
import subprocess
import sys
import tempfile
import threading

os.environ["MAVLINK20"] = "1"


def product(p, q):
    (a, b, c, d), (e, f, g, h) = p, q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def rotate(q, v):
    w, x, y, z = q
    return product(product(q, (0, *v)), (w, -x, -y, -z))[1:]


def apart(p, q):
    """Angle between two rotations, degrees."""
    near = min(math.dist(p, q), math.dist(p, [-c for c in q]))
    return math.degrees(2 * near)


class Receiver(threading.Thread):
    """Datagrams of a port, until none comes for a while."""

    def __init__(self):
        super().__init__()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(60)
        self.port = self.socket.getsockname()[1]
        self.datagrams = []
        self.start()

    def run(self):
        while True:
            try:
                datagram = self.socket.recv(4096)
            except TimeoutError:
                return
            if datagram == b"end":
                return
            self.datagrams.append(datagram)

    def all(self):
        self.socket.sendto(b"end", ("127.0.0.1", self.port))
        self.join()
        return self.datagrams


def run(*arguments):
    done = subprocess.run(arguments, env={**os.environ, "STRAPD_AID": "none"}, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(f"{arguments}: {done.returncode}\n{done.stderr}")
    return done.stdout


def quaternion(line):
    q = line["q"]
    return q["w"], q["x"], q["y"], q["z"]


def osc(datagrams, lines):
    from pythonosc.osc_message import OscMessage

    worst = 0.0
    for n, line in enumerate(lines):
        turn, euler = (OscMessage(d) for d in datagrams[2 * n : 2 * n + 2])
        assert turn.address.endswith("/quaternion") and euler.address.endswith("/euler"), turn.address
        worst = max(worst, apart(turn.params, quaternion(line)))
        roll, pitch, yaw = (math.radians(a) / 2 for a in euler.params)
        z = (math.cos(yaw), 0, 0, math.sin(yaw))
        y = (math.cos(pitch), 0, math.sin(pitch), 0)
        x = (math.cos(roll), math.sin(roll), 0, 0)
        worst = max(worst, apart(product(product(z, y), x), quaternion(line)))
    return len(datagrams), worst


def vmc(datagrams, lines):
    from pythonosc.osc_message import OscMessage

    worst = 0.0
    for datagram, line in zip(datagrams, lines):
        message = OscMessage(datagram)
        name, *place, x, y, z, w = message.params
        assert message.address == "/VMC/Ext/Tra/Pos" and place == [0, 0, 0] and name
        # Unity: right, up, forward; the body's forward, left, up.
        for own in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
            seen = lambda v: (-v[1], v[2], v[0])
            there, here = rotate((w, x, y, z), seen(own)), seen(rotate(quaternion(line), own))
            worst = max(worst, math.degrees(math.dist(there, here)))
    return len(datagrams), worst


def mavlink(datagrams, lines):
    from pymavlink.dialects.v20 import common

    reader = common.MAVLink(None)
    messages = [m for d in datagrams for m in reader.parse_buffer(d) or []]
    assert reader.total_receive_errors == 0
    by = {}
    for message in messages:
        by.setdefault(message.get_type(), []).append(message)
    numbers = [m.get_seq() for m in messages]
    assert all((b - a) % 256 == 1 for a, b in zip(numbers, numbers[1:])), "a number is missing"
    assert by["HEARTBEAT"] and len(by["ATTITUDE"]) == len(by["ATTITUDE_QUATERNION"]) == len(lines)
    worst = 0.0
    for turn, angles, line in zip(by["ATTITUDE_QUATERNION"], by["ATTITUDE"], lines):
        w, x, y, z = quaternion(line)
        own = (w, x, -y, -z)
        worst = max(worst, apart((turn.q1, turn.q2, turn.q3, turn.q4), own))
        roll, pitch, yaw = angles.roll / 2, angles.pitch / 2, angles.yaw / 2
        z = (math.cos(yaw), 0, 0, math.sin(yaw))
        y = (math.cos(pitch), 0, math.sin(pitch), 0)
        x = (math.cos(roll), math.sin(roll), 0, 0)
        worst = max(worst, apart(product(product(z, y), x), own))
        rates = [line["rate"][0], -line["rate"][1], -line["rate"][2]]
        for message in (turn, angles):
            said = (message.rollspeed, message.pitchspeed, message.yawspeed)
            assert math.dist(said, rates) < 1e-5, (said, rates)
    return len(messages), worst


def gcsv(path, lines):
    import telemetry_parser

    rows = telemetry_parser.Parser(path).normalized_imu()
    assert len(rows) == len(lines), (len(rows), len(lines))
    worst = 0.0
    first = lines[0]["stamp"]
    for row, line in zip(rows, lines):
        at = (line["stamp"]["sec"] - first["sec"]) * 1e3 + (line["stamp"]["nsec"] - first["nsec"]) * 1e-6
        assert abs(row["timestamp_ms"] - at) < 1e-6, (row, at)
        # Gyroflow's axes, by the orientation that the file states: up, left, back.
        x, y, z = (math.degrees(a) for a in line["rate"])
        own = (z, y, -x)
        worst = max(worst, math.dist(row["gyro"], own))
    return len(rows), worst


def bvh(path, lines):
    import bvhio

    # As it stands in the file: `readAsHierarchy` turns joints along their bones.
    motion = bvhio.readAsBvh(path)
    joint = motion.Root.Children[0]
    worst, start = 0.0, lines[0]["stamp"]
    stamps = [(l["stamp"]["sec"] - start["sec"]) + (l["stamp"]["nsec"] - start["nsec"]) * 1e-9 for l in lines]
    frames, step = motion.FrameCount, motion.FrameTime
    near = 0
    for n in range(0, frames, 7):
        while near + 1 < len(stamps) and abs(stamps[near + 1] - n * step) <= abs(stamps[near] - n * step):
            near += 1
        if abs(stamps[near] - n * step) > 1e-6:
            continue
        q = joint.Keyframes[n].Rotation
        w, x, y, z = quaternion(lines[near])
        worst = max(worst, apart((q.w, q.x, q.y, q.z), (w, y, z, x)))
    return frames, worst


def dataflash(strapd, folder):
    """A log made here, read by both."""
    import struct

    from pymavlink import DFReader

    def fmt(of, length, name, letters, columns):
        return struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 0x80, of, length, name, letters, columns)

    log = fmt(0x80, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    names = b"TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"
    log += fmt(0x81, 3 + struct.calcsize("<QBffffffIIfBBHH"), b"IMU", b"QBffffffIIfBBHH", names)
    log += fmt(0x83, 3 + struct.calcsize("<QhhhhHHHHB"), b"ATT", b"QccccCCCCB",
               b"TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF")
    for n in range(500):
        for instance in range(2):
            wave = [math.sin(0.01 * n + k + instance) for k in range(3)]
            log += struct.pack("<BBBQBffffffIIfBBHH", 0xA3, 0x95, 0x81, 10_000_000 + 2500 * n, instance, *wave,
                               0.1, 0.2, -9.8, 0, 0, 35.0, 1, 1, 400, 400)
        log += struct.pack("<BBBQhhhhHHHHB", 0xA3, 0x95, 0x83, 10_000_000 + 2500 * n, 0, 1000, 0, -500, 0, 4000, 0, 0, 1)
    path = os.path.join(folder, "00000042.BIN")
    with open(path, "wb") as file:
        file.write(log)
    reader = DFReader.DFReader_binary(path)
    theirs = {0: [], 1: []}
    while message := reader.recv_match(type="IMU"):
        theirs[message.I].append(message)
    worst = count = 0
    for instance, topic in enumerate(("IMU", "IMU/1")):
        ours = [json.loads(line) for line in run(strapd, "cat", path, "--topic", topic).splitlines()]
        assert len(ours) == len(theirs[instance]) == 500, (len(ours), len(theirs[instance]))
        for line, message in zip(ours, theirs[instance]):
            count += 1
            at = line["stamp"]["sec"] * 1_000_000 + line["stamp"]["nsec"] // 1000
            assert at == message.TimeUS
            worst = max(worst, math.dist(line["gyro"], (message.GyrX, -message.GyrY, -message.GyrZ)))
            worst = max(worst, math.dist(line["accel"], (message.AccX, -message.AccY, -message.AccZ)))
    return count, worst


def capture(strapd, tlog, folder):
    """The frames of a log without their times, read by both."""
    from pymavlink.dialects.v20 import ardupilotmega

    with open(tlog, "rb") as file:
        log = file.read()
    frames, at = b"", 0
    while at < len(log):
        mark, length, flags = log[at + 8], log[at + 9], log[at + 10]
        total = 8 + length + (8 if mark == 0xFE else 12 + 13 * (flags & 1))
        frames += log[at + 8 : at + total]
        at += total
    path = os.path.join(folder, "captured.bytes")
    with open(path, "wb") as file:
        file.write(frames)
    reader = ardupilotmega.MAVLink(None)
    reader.robust_parsing = True
    theirs = [m for m in reader.parse_buffer(frames) if m.get_type() == "SCALED_IMU2"]
    ours = [json.loads(line) for line in run(strapd, "cat", path, "--topic", "SCALED_IMU2").splitlines()]
    assert len(ours) == len(theirs) > 0, (len(ours), len(theirs))
    worst = 0.0
    for line, message in zip(ours, theirs):
        rates = [message.xgyro * 1e-3, -message.ygyro * 1e-3, -message.zgyro * 1e-3]
        worst = max(worst, math.dist(line["gyro"], rates))
        at = line["stamp"]["sec"] * 1000 + line["stamp"]["nsec"] // 1_000_000
        assert at == message.time_boot_ms
    return len(ours), worst


def main():
    strapd, log, tlog = map(os.path.abspath, sys.argv[1:4])
    with tempfile.TemporaryDirectory() as folder:
        name = lambda ending: os.path.join(folder, "a." + ending)
        receivers = {scheme: Receiver() for scheme in ("osc", "vmc", "mavlink")}
        files = [part for ending in ("ndjson", "gcsv", "bvh", "sto") for part in ("-o", name(ending))]
        sockets = [part for scheme, r in receivers.items() for part in ("-o", f"{scheme}://127.0.0.1:{r.port}")]
        run(strapd, "replay", log, "--speed", "10", *files, *sockets)
        with open(name("ndjson")) as file:
            lines = [json.loads(line) for line in file]
        judged = [
            ("python-osc, /strapd", osc(receivers["osc"].all(), lines), 1e-4),
            ("python-osc, /VMC", vmc(receivers["vmc"].all(), lines), 1e-4),
            ("pymavlink, vehicle", mavlink(receivers["mavlink"].all(), lines), 1e-3),
            ("telemetry-parser", gcsv(name("gcsv"), lines), 1e-9),
            ("bvhio", bvh(name("bvh"), lines), 1e-3),
            ("pymavlink, DFReader", dataflash(strapd, folder), 1e-6),
            ("pymavlink, capture", capture(strapd, tlog, folder), 1e-9),
        ]
    for reader, (count, worst), most in judged:
        print(f"{reader}: {count} read, worst {worst:.2e}")
        assert worst < most, reader


main()

"""A robot of ROS 2 over zenoh, its router, and a judge of what strapd makes of it: by a library nobody here wrote.

    python zenoh_robot.py STRAPD rmw      2,000 Imu messages there and back, tokens seen both ways, against exact truth
    python zenoh_robot.py STRAPD own      lines and packed objects under keys, each byte as straight over TCP
    python zenoh_robot.py STRAPD faults   bad messages, wrong passwords, a router that restarts, two publishers, a slow reader
    python zenoh_robot.py STRAPD speed N  samples a second, in turn with straight TCP, and round trips

    pip install eclipse-zenoh==1.10.2 rosbags==0.11.9
"""

import asyncio
import json
import math
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import time

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_typestore
from workers import EVERY_NS, STARTED, TRIPS, Worker, cpu, line, packed, run, speed_of_tcp, straight, trips_of_tcp, until

ROS = get_typestore(Stores.ROS2_JAZZY)
TYPE = "sensor_msgs::msg::dds_::Imu_"
HASH = "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"
BEGIN_NS = 1_700_000_000_000_000_000
LISTEN = ("--listen", "tcp-listen://127.0.0.1:0")
WITHOUT_COVARIANCE, ABSENT = np.zeros(9), np.array([-1.0] + 8 * [0.0])


def config(mode, port, user=None):
    text = {
        "mode": mode,
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "listen" if mode == "router" else "connect": {"endpoints": [f"tcp/127.0.0.1:{port}"]},
    }
    if user:
        text["transport"] = {"auth": {"usrpwd": user}}
    return zenoh.Config.from_json5(json.dumps(text))


class Router:
    """A router on a port of loopback, in a process of its own; its port stays when it is started again."""

    def __init__(self, dictionary=None):
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.dictionary = dictionary
        self.start()

    def start(self):
        words = [sys.executable, __file__, sys.argv[1], "router", str(self.port)]
        self.process = subprocess.Popen(words + ([self.dictionary] if self.dictionary else []))
        STARTED.append(self.process)
        end = time.monotonic() + 20
        while True:
            try:
                return socket.create_connection(("127.0.0.1", self.port), timeout=1).close()
            except OSError:
                if time.monotonic() > end:
                    raise SystemExit("the router did not start")
                time.sleep(0.05)

    def stop(self):
        self.process.kill()
        self.process.wait()

    def at(self, key):
        return f"zenoh://tcp/127.0.0.1:{self.port}/{key}"

    def open(self, user=None):
        return zenoh.open(config("client", self.port, user))


def router(port, dictionary):
    user = {"user": "router", "password": "secret", "dictionary_file": dictionary} if dictionary else None
    with zenoh.open(config("router", port, user)):
        while True:
            time.sleep(60)


def imu(stamp_ns, gyro):
    """`sensor_msgs/msg/Imu` in CDR by rosbags: no orientation, no acceleration."""
    t = ROS.types
    zero = t["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    stamp = t["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    message = t["sensor_msgs/msg/Imu"](
        header=t["std_msgs/msg/Header"](stamp=stamp, frame_id="imu_link"),
        orientation=t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        orientation_covariance=ABSENT,
        angular_velocity=t["geometry_msgs/msg/Vector3"](*gyro),
        angular_velocity_covariance=WITHOUT_COVARIANCE,
        linear_acceleration=zero,
        linear_acceleration_covariance=ABSENT,
    )
    return bytes(ROS.serialize_cdr(message, "sensor_msgs/msg/Imu"))


class Robot:
    """A node that publishes Imu messages as rmw_zenoh does."""

    def __init__(self, session, topic, domain=0, node="driver", hash_=HASH):
        self.session, self.sequence = session, 0
        self.gid = random.randbytes(16)
        self.key = f"{domain}{topic}/{TYPE}/{hash_}"
        qos = "::,10:,:,:,,"
        mangled = topic.replace("/", "%")
        self.token = session.liveliness().declare_token(
            f"@ros2_lv/{domain}/{session.zid()}/0/{random.randrange(10**9)}/MP/%/%robot/{node}/{mangled}/{TYPE}/{hash_}/{qos}"
        )
        # Reliable, keep all: who cannot send waits.
        self.publisher = session.declare_publisher(self.key, congestion_control=zenoh.CongestionControl.BLOCK)

    def attachment(self):
        self.sequence += 1
        return struct.pack("<qqB16s", self.sequence, time.time_ns(), 16, self.gid)

    def put(self, payload, attachment=True):
        self.publisher.put(payload, attachment=self.attachment() if attachment is True else attachment)

    def end(self):
        self.token.undeclare()
        self.publisher.undeclare()


class Judge:
    """Hears what strapd publishes."""

    def __init__(self, session, key):
        self.messages, self.tokens = [], {}
        self.here = asyncio.Queue()
        self.loop = asyncio.get_running_loop()
        self.subscriber = session.declare_subscriber(key, self.hear)
        self.lively = session.liveliness().declare_subscriber("@ros2_lv/**", self.meet, history=True)

    def hear(self, sample):
        attachment = sample.attachment
        got = (str(sample.key_expr), sample.payload.to_bytes(), attachment.to_bytes() if attachment else None)
        self.messages.append(got)
        self.loop.call_soon_threadsafe(self.here.put_nowait, got)

    def meet(self, sample):
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self.tokens[key] = True
        else:
            self.tokens.pop(key, None)


def topics(worker):
    return [one["topic"] for one in worker.status()["outgoing"][0]["zenoh"]["topics"]]


def source(worker, name):
    found = [one for one in worker.status()["sources"] if one["id"] == name]
    return found[0] if found else None


def turned(rate, seconds):
    """w, x, y, z of a constant rate about fixed axes of the body."""
    speed = math.sqrt(sum(r * r for r in rate))
    half = speed * seconds / 2
    return [math.cos(half)] + [math.sin(half) * r / speed for r in rate]


def relative(a, b):
    """The angle between two attitudes, rad."""
    w, x, y, z = (a[0], -a[1], -a[2], -a[3])
    v = [
        w * b[1] + x * b[0] + y * b[3] - z * b[2],
        w * b[2] - x * b[3] + y * b[0] + z * b[1],
        w * b[3] + x * b[2] - y * b[1] + z * b[0],
    ]
    return 2 * math.asin(min(1.0, math.sqrt(sum(c * c for c in v))))


async def rmw(folder):
    router_ = Router()
    # Before there is any robot.
    worker = Worker(folder, "worker", *LISTEN, router_.at("0/**?rmw"), "-o", router_.at("0/{id}/attitude?rmw"))
    worker.listens()
    await worker.subscribed()
    judge_session, robot_session = router_.open(), router_.open()
    judge = Judge(judge_session, f"0/**/attitude/{TYPE}/*")
    names = ["/imu/data", "/рука/imu"]
    robots = [Robot(robot_session, name) for name in names]
    await until(lambda: sorted(topics(worker)) == sorted(names), 5, lambda: topics(worker))
    # Not Imu, and in another domain: neither is read.
    other = Robot(robot_session, "/imu/data", domain=1)
    other.put(imu(BEGIN_NS, [9.0, 9.0, 9.0]))
    count, rate = 1000, [0.31, -0.22, 0.13]
    for k in range(count):
        for robot in robots:
            robot.put(imu(BEGIN_NS + k * EVERY_NS, rate))
        if k % 20 == 19:
            await asyncio.sleep(0.01)
    await until(lambda: len(judge.messages) >= 2 * count, 20, lambda: f"{len(judge.messages)} back: {worker.said()}")
    await asyncio.sleep(0.3)
    assert len(judge.messages) == 2 * count, len(judge.messages)
    worst, keys = 0.0, {key for key, _, _ in judge.messages}
    assert keys == {f"0/imu/data/attitude/{TYPE}/{HASH}", f"0/_D1_80_D1_83_D0_BA_D0_B0/imu/attitude/{TYPE}/{HASH}"}, keys
    for key in keys:
        first, gids = None, set()
        of_key = [(payload, attachment) for name, payload, attachment in judge.messages if name == key]
        for k, (payload, attachment) in enumerate(of_key):
            message = ROS.deserialize_cdr(payload, "sensor_msgs/msg/Imu")
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert stamp == BEGIN_NS + k * EVERY_NS, (k, stamp)
            q = message.orientation
            q = [q.w, q.x, q.y, q.z]
            first = first or q
            assert relative(first, [1, 0, 0, 0]) < 1e-15, first
            worst = max(worst, relative(q, turned(rate, k * EVERY_NS * 1e-9)))
            sequence, sent, length, gid = struct.unpack("<qqB16s", attachment)
            assert (sequence, length) == (k + 1, 16) and abs(time.time_ns() - sent) < 60e9, (sequence, sent, length)
            gids.add(gid)
        assert len(of_key) == count and len(gids) == 1, (len(of_key), gids)
    # Ten seconds of 100 Hz at a constant rate: what doubles can do.
    assert worst < 1e-12, worst
    own = [key for key in judge.tokens if key.endswith("/1:2:1,10:,:,:,,")]
    assert len(own) == 2 and all(key.split("/")[:2] == ["@ros2_lv", "0"] and key.split("/")[5] == "MP" for key in own), judge.tokens
    assert any(f"%imu%data%attitude/{TYPE}/{HASH}/" in key for key in own), own
    assert any(key.split("/")[5:] == ["NN", "%", "%", "strapd"] for key in judge.tokens), judge.tokens
    # One of the messages does not come: its number tells.
    robots[0].attachment()
    robots[0].put(imu(BEGIN_NS + (count + 1) * EVERY_NS, rate))
    await until(lambda: source(worker, names[0])["missing"] == 1, 5, lambda: source(worker, names[0]))
    assert source(worker, names[1])["missing"] == 0
    robots[0].end()
    await until(lambda: topics(worker) == [names[1]], 5, lambda: topics(worker))
    assert "/imu/data of /robot/driver, domain 0, has gone" in worker.said(), worker.said()
    # Another worker that reads the whole domain hears the robot, and not what a strapd makes of it.
    second = Worker(folder, "second", *LISTEN, router_.at("0/**?rmw"))
    second.listens()
    await second.subscribed()
    for k in range(5):
        robots[1].put(imu(BEGIN_NS + (count + k) * EVERY_NS, rate))
    await until(lambda: source(second, names[1]) and second.taken() == 5, 5, second.said)
    assert [one["id"] for one in second.status()["sources"]] == [names[1]]
    assert [one["id"] for one in worker.status()["sources"]].count("/imu/data/attitude") == 0
    assert worker.end() == 0 and second.end() == 0, worker.said()
    await until(lambda: not [key for key in judge.tokens if "/strapd" in key], 5, lambda: judge.tokens)
    robot_session.close()
    judge_session.close()
    router_.stop()
    print(f"rmw: {2 * count} of {2 * count} messages back, tokens seen both ways, worst {worst:.1e} rad from the truth")


async def own(folder):
    router_ = Router()
    worker = Worker(folder, "worker", *LISTEN, router_.at("imu/*"), "-o", router_.at("att/{id}"))
    worker.listens()
    await worker.subscribed()
    session = router_.open()
    judge = Judge(session, "att/*")
    count = 500
    samples = {f"s{n}": [line(n, k) for k in range(count)] for n in range(4)}
    for k in range(0, count, 50):
        for n, (sensor, lines) in enumerate(samples.items()):
            # Lines; and packed objects, which name no sensor at all.
            block = b"".join(lines[k : k + 50]) if n % 2 == 0 else b"".join(packed(n, j) for j in range(k, k + 50))
            session.put(f"imu/{sensor}", block, congestion_control=zenoh.CongestionControl.BLOCK)
    got = lambda: sum(payload.count(b"\n") for _, payload, _ in judge.messages)
    await until(lambda: got() >= 4 * count, 10, lambda: f"{got()} attitudes: {worker.said()}")
    expected = straight(folder, samples)
    for sensor in samples:
        lines = [text for key, payload, _ in judge.messages if key == f"att/{sensor}" for text in payload.splitlines(keepends=True)]
        assert lines == expected[sensor], (sensor, lines[:2], expected[sensor][:2])
    # A name with what no part of a key may hold.
    told = json.loads(line(0, 0))
    told["id"] = "a/b *"
    session.put("imu/s9", json.dumps(told).encode() + b"\n")
    await until(lambda: any(key == "att/a%2Fb%20%2A" for key, _, _ in judge.messages), 5, worker.said)
    # What was taken is published, also where the daemon ends.
    session.put("imu/s8", b"".join(line(8, k) for k in range(500)), congestion_control=zenoh.CongestionControl.BLOCK)
    await until(lambda: source(worker, "s8"), 5, worker.said)
    assert worker.end() == 0, worker.said()
    last = lambda: sum(payload.count(b"\n") for key, payload, _ in judge.messages if key == "att/s8")
    await until(lambda: last() == 500, 5, lambda: f"{last()} of 500 at the end")
    session.close()
    router_.stop()
    print(f"own: {4 * count} attitudes of 4 sensors, each byte as over TCP")


def secret(folder, name, text):
    path = os.path.join(folder, name)
    with open(path, "w") as f:
        f.write(text + "\n")
    os.chmod(path, 0o600)
    return path


async def faults(folder):
    dictionary = secret(folder, "users", "imu:hunter2\nrobot:hunter4")
    right, wrong = secret(folder, "right", "hunter2"), secret(folder, "wrong", "hunter3")
    router_ = Router(dictionary)
    refused = Worker(folder, "refused", *LISTEN, router_.at(f"0/**?rmw&user=imu&password-file={wrong}"))
    refused.listens()
    await until(lambda: "does not let us in" in refused.said(), 10, refused.said)
    assert refused.status()["outgoing"][0]["connected"] is False
    assert "hunter" not in refused.said(), refused.said()
    assert refused.end() == 0
    login = f"user=imu&password-file={right}"
    worker = Worker(
        folder, "worker", "-v", *LISTEN, router_.at(f"*/**?rmw&{login}"), "-o", router_.at(f"0/{{id}}/attitude?rmw&{login}")
    )
    worker.listens()
    await worker.subscribed()
    # It speaks with its router, and listens to nobody else.
    assert sockets(worker) == {"udp": 0, "listening": 1, "connected": 2}, sockets(worker)
    user = {"user": "robot", "password": "hunter4"}
    session = router_.open(user)
    good, bad, empty = (Robot(session, topic) for topic in ("/good", "/bad", "/empty"))
    rate = [0.1, 0.2, 0.3]
    faults_before = worker.status()["counters"]["faults"]
    whole = imu(BEGIN_NS, rate)
    for n in range(200):
        bad.put(random.Random(n).randbytes(n))
    # No little or big endian; too short by one; another type; a frame as long as a thousand messages.
    for payload in (b"\x00\x07" + whole[2:], whole[:-1], whole + bytes(64), whole[:12] + b"\xff\xff\xff\x7f" + whole[16:], b""):
        bad.put(payload)
    empty.put(b"x" * ((1 << 20) + 1))
    sender = session.declare_publisher(f"0/esc\x1b[31m/{TYPE}/x")
    sender.put(whole)
    good.put(whole)
    # Attachments that are none: the sample is used, and nothing tells what is missing.
    good.put(imu(BEGIN_NS + EVERY_NS, rate), attachment=b"x" * 32)
    good.put(imu(BEGIN_NS + 2 * EVERY_NS, rate), attachment=None)
    for k in range(3, 10):
        good.put(imu(BEGIN_NS + k * EVERY_NS, rate))
    await until(lambda: source(worker, "/good") and source(worker, "/good")["samples"] >= 10, 10, worker.said)
    status = worker.status()
    errors = status["counters"]["faults"] - faults_before
    assert errors >= 206, errors
    assert status["outgoing"][0]["zenoh"]["refused"] == 1, status["outgoing"]
    assert "1048577 bytes" in worker.said() and "encapsulation" in worker.said().lower(), worker.said()
    # Said once in ten seconds for each cause.
    assert worker.said().count("/bad") <= 4, worker.said()
    assert "\x1b" not in worker.said() and all("31m" not in one["id"] for one in status["sources"]), status["sources"]
    assert [one["id"] for one in status["sources"]] == ["/good"], status["sources"]
    # Another publisher of a topic, and the topic in another domain, would be mixed with the first.
    twin, elsewhere = Robot(session, "/good"), Robot(session, "/good", domain=7)
    for k in range(10, 20):
        good.put(imu(BEGIN_NS + k * EVERY_NS, rate))
        twin.put(imu(BEGIN_NS + k * EVERY_NS + 1, [3.0, 3.0, 3.0]))
        elsewhere.put(imu(BEGIN_NS + k * EVERY_NS + 2, [3.0, 3.0, 3.0]))
    await until(lambda: source(worker, "/good")["samples"] >= 20, 5, worker.said)
    await asyncio.sleep(0.2)
    assert source(worker, "/good")["samples"] == 20, source(worker, "/good")
    said = worker.status()["outgoing"][0]["last_error"]
    assert "two publishers" in said or "in domain" in said, said
    # The router goes, and comes back at the same place; so do the robot and its token.
    session.close()
    router_.stop()
    await until(lambda: "connection was lost" in worker.said(), 10, worker.said)
    assert topics(worker) == []
    await asyncio.sleep(2)
    router_.start()
    again = time.monotonic()
    session = router_.open(user)
    good = Robot(session, "/good")
    k, seen = 20, source(worker, "/good")["samples"]
    while source(worker, "/good")["samples"] == seen:
        good.put(imu(BEGIN_NS + k * EVERY_NS, rate))
        k += 1
        await asyncio.sleep(0.02)
        assert time.monotonic() < again + 6, worker.said()
    back = time.monotonic() - again
    await until(lambda: topics(worker) == ["/good"], 5, worker.said)
    lost = worker.said().count("trying again until it is there")
    assert lost <= 2, worker.said()
    session.close()
    assert worker.end() == 0
    router_.stop()
    assert "hunter" not in worker.said()
    print(f"faults: {errors} counted for 206 bad messages, back {back:.1f} s after the router was, said {lost} times")


def sockets(worker):
    """Sockets of a process, by what they do."""
    found = {"udp": 0, "listening": 0, "connected": 0}
    inodes = set()
    for name in os.listdir(f"/proc/{worker.process.pid}/fd"):
        try:
            target = os.readlink(f"/proc/{worker.process.pid}/fd/{name}")
        except OSError:
            continue
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    for table in ("tcp", "tcp6", "udp", "udp6"):
        with open(f"/proc/{worker.process.pid}/net/{table}") as f:
            for row in f.readlines()[1:]:
                fields = row.split()
                if fields[9] in inodes:
                    kind = "udp" if table.startswith("udp") else {"0A": "listening", "01": "connected"}.get(fields[3])
                    if kind:
                        found[kind] += 1
    return found


async def slow(folder):
    """How long a robot that publishes reliably at 10 kHz is held up, while the worker is busy, and while it stands still."""
    router_ = Router()
    worker = Worker(folder, "worker", *LISTEN, router_.at("0/**?rmw"))
    worker.listens()
    await worker.subscribed()
    session = router_.open()
    robot = Robot(session, "/fast")
    payload = imu(BEGIN_NS, [0.1, 0.2, 0.3])
    sec, nanosec = 4, 8

    def publish(seconds, from_k):
        began, k, waits = time.monotonic(), from_k, []
        while (due := began + (k - from_k) * 1e-4) < began + seconds:
            now = time.monotonic()
            if now < due:
                time.sleep(due - now)
            stamp = BEGIN_NS + k * 100_000
            data = payload[:sec] + struct.pack("<iI", stamp // 10**9, stamp % 10**9) + payload[sec + nanosec :]
            before = time.monotonic()
            robot.put(data)
            waits.append(time.monotonic() - before)
            k += 1
        return k, waits

    told = []
    k, waits = await asyncio.to_thread(publish, 5, 0)
    told.append(f"reading: longest put {max(waits) * 1e3:.1f} ms")
    calm = max(waits)
    await until(lambda: worker.taken() == k, 10, lambda: f"{worker.taken()} of {k}: {worker.said()}")
    worker.process.send_signal(signal.SIGSTOP)
    k, waits = await asyncio.to_thread(publish, 10, k)
    worker.process.send_signal(signal.SIGCONT)
    told.append(f"stopped for 10 s: longest put {max(waits) * 1e3:.0f} ms, {len(waits)} published")
    stopped = max(waits)
    before = k
    k, waits = await asyncio.to_thread(publish, 3, k)
    await until(lambda: source(worker, "/fast") is not None, 10, worker.said)
    await asyncio.sleep(2)
    status, one = worker.status(), source(worker, "/fast")
    accounted = status["counters"]["samples"] + one["missing"]
    told.append(f"then: {status['counters']['samples']} of {k} taken, {one['missing']} counted as missing")
    assert status["counters"]["samples"] > before - 1e9 and abs(accounted - k) <= 1, (accounted, k, status["outgoing"])
    assert calm < 0.5, calm
    assert stopped < 1, stopped
    # As fast as they can be sent: what does not fit into the ring is lost, and counted.
    burst, count, longest = Robot(session, "/burst"), 200_000, 0.0
    lost = status["outgoing"][0]["zenoh"]["lost"]
    data = [payload[:sec] + struct.pack("<iI", stamp // 10**9, stamp % 10**9) + payload[sec + nanosec :] for stamp in range(BEGIN_NS, BEGIN_NS + count * 10_000, 10_000)]
    began = time.monotonic()
    for one in data:
        before = time.monotonic()
        burst.put(one)
        longest = max(longest, time.monotonic() - before)
    seconds = time.monotonic() - began

    def of_burst():
        return source(worker, "/burst")["samples"], worker.status()["outgoing"][0]["zenoh"]["lost"] - lost

    await until(lambda: sum(of_burst()) == count, 20, lambda: f"{of_burst()} of {count}: {worker.said()}")
    taken, gone = of_burst()
    assert gone == 0 or "were lost" in worker.said(), worker.said()
    told.append(f"{count} at {count / seconds / 1e3:.0f} k/s: {taken} taken, {gone} lost and said, longest put {longest * 1e3:.0f} ms")
    assert longest < 0.5, longest
    session.close()
    assert worker.end() == 0
    router_.stop()
    print("slow: " + "; ".join(told))


async def speed(folder):
    total, block, sensors = 400_000, 50, 8
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    router_ = Router()
    session = router_.open()
    blocks = [
        (n, b"".join(packed(n, k + j) for j in range(block)))
        for k in range(0, total // sensors, block)
        for n in range(sensors)
    ]
    publishers = [session.declare_publisher(f"imu/s{n}", congestion_control=zenoh.CongestionControl.BLOCK) for n in range(sensors)]

    async def one(way):
        if way == "tcp":
            return speed_of_tcp(folder, blocks, total, sensors)
        worker = Worker(folder, way, *LISTEN, router_.at("imu/*"))
        worker.listens()
        await worker.subscribed()
        began = time.monotonic()
        for n, data in blocks:
            publishers[n].put(data)
        while (got := worker.taken()) < total:
            await asyncio.sleep(0.01)
            if time.monotonic() > began + 60:
                raise SystemExit(f"{way}: {got} of {total}: {worker.said()} {worker.status()['outgoing']}")
        seconds, used = time.monotonic() - began, cpu(worker)
        worker.end()
        os.remove(worker.log)
        return total / seconds / 1e3, used / total * 1e6

    figures = {way: [] for way in ("tcp", "zenoh")}
    for _ in range(rounds):
        for way in figures:
            figures[way].append(await one(way))
    for way, all_of in figures.items():
        rates, used = sorted(f[0] for f in all_of), sorted(f[1] for f in all_of)
        print(f"speed: {way}: {rates[len(rates) // 2]:.0f} k samples/s ({rates[0]:.0f} to {rates[-1]:.0f}), {used[len(used) // 2]:.2f} us of CPU a sample")
    worker = Worker(folder, "trip-tcp", *LISTEN)
    times = {"tcp": await trips_of_tcp(worker.listens())}
    worker.end()
    worker = Worker(folder, "trip-zenoh", *LISTEN, router_.at("rt/*"), "-o", router_.at("ra/{id}"))
    worker.listens()
    await worker.subscribed()
    times["zenoh"] = await trips(session, "ra/s0", lambda k: session.put("rt/s0", line(0, k)))
    worker.end()
    worker = Worker(folder, "trip-rmw", *LISTEN, router_.at("0/**?rmw"), "-o", router_.at("0/{id}/attitude?rmw"))
    worker.listens()
    await worker.subscribed()
    robot = Robot(session, "/imu")
    messages = [imu(BEGIN_NS + k * EVERY_NS, [0.1, 0.2, 0.3]) for k in range(TRIPS)]
    times["zenoh, rmw"] = await trips(session, f"0/imu/attitude/{TYPE}/*", lambda k: robot.put(messages[k]))
    worker.end()
    for way, all_of in times.items():
        all_of.sort()
        print(f"round trip: {way}: p50 {all_of[len(all_of) // 2] * 1e3:.2f} ms, p99 {all_of[len(all_of) * 99 // 100] * 1e3:.2f} ms")
    session.close()
    router_.stop()


async def trips(session, answers, put):
    """From before a sample is published until its attitude is here, one after another."""
    judge, times = Judge(session, answers), []
    await asyncio.sleep(0.5)
    for k in range(TRIPS):
        began = time.monotonic()
        put(k)
        await asyncio.wait_for(judge.here.get(), 5)
        times.append(time.monotonic() - began)
    return times


if sys.argv[2:3] == ["router"]:
    router(int(sys.argv[3]), sys.argv[4] if len(sys.argv) > 4 else None)
else:
    run({"rmw": rmw, "own": own, "faults": faults, "slow": slow, "speed": speed}, "zenoh")

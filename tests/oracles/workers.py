"""What the oracles of the brokers have in common: strapd as a worker, samples for it, and what it makes of the same samples over TCP."""

import asyncio
import json
import math
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

STRAPD = sys.argv[1]
EVERY_NS = 10_000_000
TRIPS = 2000
STARTED = []


class Worker:
    """`strapd serve` with these arguments."""

    def __init__(self, folder, name, *arguments):
        self.log = os.path.join(folder, f"{name}.log")
        self.errors = open(self.log, "a")
        self.arguments = [STRAPD, "serve", *arguments]
        self.process = None
        self.start()

    def start(self):
        env = {k: v for k, v in os.environ.items() if not k.startswith("STRAPD_")}
        self.process = subprocess.Popen(self.arguments, stderr=self.errors, env=env)
        STARTED.append(self.process)

    def said(self):
        with open(self.log) as f:
            return f.read()

    def listens(self):
        """The port of its first socket."""
        for _ in range(200):
            for word in self.said().split():
                if word.startswith("tcp-listen://"):
                    self.port = int(word.rstrip(",;").rsplit(":", 1)[1])
                    return self.port
            time.sleep(0.05)
        raise SystemExit(f"no ready line: {self.said()}")

    async def subscribed(self):
        """Until its source is connected."""
        await until(lambda: self.status()["outgoing"][0]["connected"], 20, self.said())
        # That it asks the server for what it wants comes right after.
        await asyncio.sleep(0.3)

    def status(self):
        with socket.create_connection(("127.0.0.1", self.port), timeout=5) as poll:
            poll.sendall(b'{"class":"POLL"}\n')
            for text in poll.makefile("rb"):
                if b'"STATUS"' in text:
                    return json.loads(text)

    def taken(self):
        return self.status()["counters"]["samples"]

    def turns(self):
        return self.status()["outgoing"][0]["stream"]["turns"]

    def has_it(self):
        return self.status()["outgoing"][0]["stream"]["held"]

    def end(self):
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        return self.process.wait()


def rate(sensor, k):
    """The k-th sample of a sensor, rad/s: no two alike."""
    t = k * EVERY_NS * 1e-9
    return [0.3 * math.sin(1.1 * t + sensor), 0.2 * math.cos(0.7 * t), 0.1 + 0.01 * sensor]


def line(sensor, k):
    stamp = 1_000_000_000_000 + k * EVERY_NS
    text = {"class": "RATE", "stamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9}, "gyro": rate(sensor, k)}
    return json.dumps(text).encode() + b"\n"


def packed(sensor, k, stream=0):
    """docs/protocol.md, kind 1."""
    stamp = 1_000_000_000_000 + k * EVERY_NS
    return struct.pack("<BBHIQq3d", 0xF8, 1, 48, stream, 2**64 - 1, stamp, *rate(sensor, k))


async def until(what, seconds, why):
    end = time.monotonic() + seconds
    while not what():
        if time.monotonic() > end:
            raise SystemExit(f"waited {seconds} s in vain: {why() if callable(why) else why}")
        await asyncio.sleep(0.02)


def straight(folder, lines_of):
    """The attitudes of the same samples over TCP, by sensor."""
    worker = Worker(folder, "straight", "--listen", "tcp-listen://127.0.0.1:0")
    port = worker.listens()
    watcher = socket.create_connection(("127.0.0.1", port))
    watcher.sendall(b'{"class":"WATCH"}\n')
    watched = watcher.makefile("rb")
    while b'"WATCH"' not in watched.readline():
        pass
    out = {sensor: [] for sensor in lines_of}

    def watch():
        left = sum(map(len, lines_of.values()))
        while left > 0:
            text = watched.readline()
            assert b'"GAP"' not in text, text
            if b'"ATT"' in text:
                out[json.loads(text)["id"]].append(text)
                left -= 1

    watching = threading.Thread(target=watch)
    watching.start()
    for sensor, lines in lines_of.items():
        with socket.create_connection(("127.0.0.1", port)) as sender:
            for n, text in enumerate(lines):
                told = json.loads(text)
                told["id"] = sensor
                sender.sendall(json.dumps(told).encode() + b"\n")
                if n % 100 == 99:
                    time.sleep(0.01)
            # Who closes with answers unread resets the connection, and what was on its way is gone.
            sender.shutdown(socket.SHUT_WR)
            while sender.recv(4096):
                pass
    watching.join()
    worker.end()
    return out


def cpu(worker):
    with open(f"/proc/{worker.process.pid}/stat") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def trips_of_tcp(port):
    times = []
    with socket.create_connection(("127.0.0.1", port)) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        lines = link.makefile("rb")
        link.sendall(b'{"class":"WATCH"}\n')
        while b'"WATCH"' not in lines.readline():
            pass
        for k in range(TRIPS):
            text, began = line(0, k), time.monotonic()
            link.sendall(text)
            while b'"ATT"' not in lines.readline():
                pass
            times.append(time.monotonic() - began)
    return times


def speed_of_tcp(folder, blocks, total, sensors):
    """Samples a second over TCP, and CPU of the daemon a sample in us."""
    worker = Worker(folder, "tcp", "--listen", "tcp-listen://127.0.0.1:0")
    port, began = worker.listens(), time.monotonic()
    with socket.create_connection(("127.0.0.1", port)) as sender:
        for n in range(sensors):
            sender.sendall(b'{"class":"PACKED","stream":%d,"id":"s%d"}\n' % (n, n))
        for n, data in blocks:
            # The number of the stream in each object.
            sender.sendall(b"".join(data[i : i + 4] + struct.pack("<I", n) + data[i + 8 : i + 48] for i in range(0, len(data), 48)))
        while worker.taken() < total:
            time.sleep(0.01)
    seconds, used = time.monotonic() - began, cpu(worker)
    worker.end()
    os.remove(worker.log)
    return total / seconds / 1e3, used / total * 1e6


def run(modes, name):
    """The mode that is asked for, in a folder of its own; nothing outlives it."""
    what = sys.argv[2] if len(sys.argv) > 2 else ""
    if what not in modes:
        raise SystemExit(sys.modules["__main__"].__doc__)
    folder = tempfile.mkdtemp(prefix=f"strapd-{name}-")
    try:
        asyncio.run(modes[what](folder))
    finally:
        for process in STARTED:
            if process.poll() is None:
                process.kill()
        if "KEEP" not in os.environ:
            shutil.rmtree(folder, ignore_errors=True)

"""The bridge to MQTT of docs/scale.md, with mosquitto's own broker and clients: attitudes through it as straight over TCP.

    python mqtt_bridge.py STRAPD        needs mosquitto, mosquitto_sub and mosquitto_pub (Debian: mosquitto, mosquitto-clients)
"""

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

STRAPD = sys.argv[1]
SENSORS, SAMPLES = 2, 200
STARTED = []
PATH = os.environ["PATH"] + ":/usr/sbin"


def start(command, **more):
    process = subprocess.Popen(command, env={**os.environ, "PATH": PATH}, start_new_session=True, **more)
    STARTED.append(process)
    return process


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def documented(broker, daemon):
    """The two commands of the page, with the addresses of this run."""
    page = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "scale.md")
    with open(page) as f:
        lines = [line.strip() for line in f if "mosquitto_" in line and "strapd " in line and "|" in line]
    commands = [re.sub(r"\s+# .*", "", line) for line in lines if line.startswith(("mosquitto_sub", "strapd"))]
    assert len(commands) == 2, lines
    return [
        c.replace("-h BROKER", f"-h 127.0.0.1 -p {broker}")
        .replace("127.0.0.1:4550", f"127.0.0.1:{daemon}")
        .replace("strapd ", STRAPD + " ", 1)
        for c in commands
    ]


def samples(sensor):
    for k in range(SAMPLES):
        rate = 0.3 * ((k * 7 + sensor * 3) % 11 - 5)
        yield (
            f'{{"class":"RATE","id":"s{sensor}","stamp":{{"sec":1700000000,"nsec":{k * 5_000_000}}},'
            f'"gyro":[{rate:.3f},0.1,{-rate / 3:.6f}]}}\n'
        )


def lines_of(sensor, path):
    with open(path) as f:
        return [line for line in f if f'"id":"s{sensor}"' in line]


def until(what, done, seconds=20):
    end = time.monotonic() + seconds
    while not done():
        if time.monotonic() > end:
            sys.exit(f"not within {seconds} s: {what}")
        time.sleep(0.05)


def answers(port):
    with socket.socket() as s:
        return s.connect_ex(("127.0.0.1", port)) == 0


def count(path):
    with open(path) as f:
        return sum('"ATT"' in line for line in f)


def main(folder):
    broker, daemon, straight = free_port(), free_port(), free_port()
    start(["mosquitto", "-p", str(broker)], stderr=subprocess.DEVNULL)
    until("the broker", lambda: answers(broker))
    taken_in, given_out = documented(broker, daemon)
    start(["sh", "-c", f"{taken_in} --listen tcp-listen://127.0.0.1:{daemon}"])
    until("the daemon", lambda: answers(daemon))
    start(["sh", "-c", given_out])
    bridged, direct = os.path.join(folder, "bridged"), os.path.join(folder, "direct")
    start(["mosquitto_sub", "-p", str(broker), "-t", "att"], stdout=open(bridged, "w"))
    start([STRAPD, "serve", "--listen", f"tcp-listen://127.0.0.1:{straight}"])
    until("the other daemon", lambda: answers(straight))
    start([STRAPD, "cat", f"tcp://127.0.0.1:{straight}"], stdout=open(direct, "w"))
    time.sleep(1)
    for sensor in range(SENSORS):
        text = "".join(samples(sensor)).encode()
        publish = ["mosquitto_pub", "-p", str(broker), "-t", f"imu/s{sensor}", "-l"]
        subprocess.run(publish, input=text, env={**os.environ, "PATH": PATH}, check=True)
        with socket.create_connection(("127.0.0.1", straight)) as s:
            s.sendall(text + b'{"class":"POLL"}\n')
            answer = b""
            while b'"STATUS"' not in answer:
                answer += s.recv(65536)
    total = SENSORS * SAMPLES
    until("all attitudes", lambda: count(bridged) >= total and count(direct) >= total)
    for sensor in range(SENSORS):
        ours, theirs = lines_of(sensor, bridged), lines_of(sensor, direct)
        assert len(ours) == SAMPLES and ours == theirs, (len(ours), len(theirs))
    print(f"mqtt: {total} attitudes of {SENSORS} sensors through a broker, each byte as over TCP")


try:
    with tempfile.TemporaryDirectory() as folder:
        main(folder)
finally:
    for process in STARTED:
        try:
            os.killpg(process.pid, signal.SIGTERM)
        except ProcessLookupError:
            pass
    for process in STARTED:
        process.wait()

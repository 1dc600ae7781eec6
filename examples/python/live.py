#!/usr/bin/env python3
"""A live stream: samples to a running daemon over a plain socket, attitudes back.

    strapd serve &
    live.py [HOST:PORT] [RECORDING]

Needs strapd for its samples alone: a client is a socket and lines of JSON (docs/protocol.md). Without a recording a walk of five
seconds is simulated. Prints the last attitude, and how long an attitude took from its sample (median, 99 %).
"""

import json
import socket
import sys
import threading
import time

import numpy as np
import strapd


def lines(file, attitudes, arrived, ended):
    """Reads what the daemon says until `ended` attitudes are there."""
    for line in file:
        said = json.loads(line)
        if said["class"] == "ATT":
            stamp = said["stamp"]
            arrived[stamp["sec"] * 1_000_000_000 + stamp["nsec"]] = time.perf_counter()
            attitudes.append(said)
            if len(attitudes) >= ended:
                return
        elif said["class"] in ("ERROR", "GAP"):
            print(said, file=sys.stderr)


def main(address="127.0.0.1:4550", recording=None):
    samples = strapd.read(recording) if recording else strapd.simulate("walking", rate_hz=200, duration=5)
    host, port = address.rsplit(":", 1)
    attitudes, arrived, sent = [], {}, {}
    with socket.create_connection((host, int(port)), timeout=10) as link:
        # A line is to go at once, and not to wait for more.
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        watch = json.dumps({"class": "WATCH", "id": "live", "last": False}) + "\n"
        link.sendall(watch.encode())
        reader = threading.Thread(target=lines, args=(link.makefile("r"), attitudes, arrived, len(samples)))
        reader.start()
        begun, first = time.perf_counter(), samples.t[0]
        for i, (t, gyr) in enumerate(zip(samples.t.tolist(), samples.gyr.tolist())):
            # As fast as it was measured.
            wait = (t - first) * 1e-9 - (time.perf_counter() - begun)
            if wait > 0:
                time.sleep(wait)
            sample = {"id": "live", "stamp_ns": t, "gyro": gyr}
            if samples.acc is not None:
                sample["accel"] = samples.acc[i].tolist()
            sent[t] = time.perf_counter()
            link.sendall((json.dumps(sample) + "\n").encode())
        reader.join(timeout=10)
    if not attitudes:
        sys.exit("no attitude came back")
    waited = np.array([arrived[t] - sent[t] for t in arrived if t in sent]) * 1e3
    q = attitudes[-1]["q"]
    print(f"{len(attitudes)} of {len(samples)} attitudes; last q w {q['w']:.6f} x {q['x']:.6f} y {q['y']:.6f} z {q['z']:.6f}")
    print(f"from sample to attitude {np.median(waited):.3f} ms, 99 %: {np.percentile(waited, 99):.3f} ms")


if __name__ == "__main__":
    main(*sys.argv[1:3])

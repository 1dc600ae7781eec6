"""Attitudes of a daemon -> streams of Lab Streaming Layer, one a sensor (PyPI `pylsl`).

    strapd serve ... &
    python3 lsl_out.py tcp://127.0.0.1:4550

A stream `strapd ID` has four channels, w, x, y, z from the sensor's axes to the world's. Of samples whose stamps are
LSL's (`lsl_in.py`) the stamps are those; else `--now` gives the time at which an attitude came.
"""

import argparse
import json
import socket

import pylsl


def outlet(name, rate):
    info = pylsl.StreamInfo(f"strapd {name}", "Orientation", 4, rate or pylsl.IRREGULAR_RATE, "double64", f"strapd-{name}")
    channels = info.desc().append_child("channels")
    for label in "wxyz":
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("type", "quaternion")
    return pylsl.StreamOutlet(info)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address", nargs="?", default="tcp://127.0.0.1:4550")
    parser.add_argument("--rate", type=float, help="attitudes a second, at most; else all")
    parser.add_argument("--now", action="store_true", help="stamps of arrival")
    asked = parser.parse_args()
    host, port = asked.address.removeprefix("tcp://").rsplit(":", 1)
    outlets = {}
    with socket.create_connection((host, int(port))) as link:
        watch = {"class": "WATCH", **({"rate_hz": asked.rate} if asked.rate else {})}
        link.sendall(json.dumps(watch).encode() + b"\n")
        for text in link.makefile("rb"):
            said = json.loads(text)
            if said["class"] != "ATT":
                continue
            name = said["id"]
            if name not in outlets:
                outlets[name] = outlet(name, asked.rate)
            stamp = pylsl.local_clock() if asked.now else said["stamp"]["sec"] + 1e-9 * said["stamp"]["nsec"]
            outlets[name].push_sample([said["q"][c] for c in "wxyz"], stamp)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass

"""A stream of Lab Streaming Layer -> JSON lines (PyPI `pylsl`).

    python3 lsl_in.py --name IMU --gyro 3:4:5 --accel 0:1:2 --degrees | strapd serve -

Channels are numbered from 0; without `--gyro` those are taken whose labels name them (`gx`, `gyro_x`, `GyrX`, ...).
Stamps are those of the stream on this computer's LSL clock, so that they fit other streams of a recording.
"""

import argparse
import json
import math
import re
import sys

import pylsl


def labels(info):
    """The channels' labels, as far as the stream states them."""
    found, channel = [], info.desc().child("channels").child("channel")
    while not channel.empty():
        found.append(channel.child_value("label"))
        channel = channel.next_sibling("channel")
    return found


def named(found, sensor):
    """The channels of a sensor by their labels, or None."""
    axes = [re.compile(rf"(?i){sensor}[a-z]*[ _.-]*{axis}$") for axis in "xyz"]
    places = [[i for i, label in enumerate(found) if axis.match(label)] for axis in axes]
    return [p[0] for p in places] if all(len(p) == 1 for p in places) else None


def triple(text):
    numbers = [int(n) for n in text.split(":")]
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError("three numbers of channels, as 3:4:5")
    return numbers


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--name", help="name of the stream")
    parser.add_argument("--type", help="type of the stream, where it has no name")
    parser.add_argument("--gyro", type=triple)
    parser.add_argument("--accel", type=triple)
    parser.add_argument("--degrees", action="store_true", help="rates are in deg/s")
    parser.add_argument("--g", action="store_true", help="forces are in g")
    parser.add_argument("--id", help="name of the sensor; else that of the stream")
    parser.add_argument("--wait", type=float, default=10.0, help="seconds to look for it")
    asked = parser.parse_args()
    what = ("name", asked.name) if asked.name else ("type", asked.type or "IMU")
    streams = pylsl.resolve_byprop(*what, timeout=asked.wait)
    if len(streams) != 1:
        raise SystemExit(f"{len(streams)} streams whose {what[0]} is {what[1]}; --name of one")
    inlet = pylsl.StreamInlet(streams[0], processing_flags=pylsl.proc_clocksync)
    info = inlet.info()
    found = labels(info)
    gyro, accel = asked.gyro or named(found, "g"), asked.accel or named(found, "a")
    if gyro is None:
        raise SystemExit(f"no channels are labelled as a gyro's: {', '.join(found) or 'no labels'}; --gyro X:Y:Z")
    rad = math.radians(1) if asked.degrees else 1.0
    mps2 = 9.80665 if asked.g else 1.0
    name = asked.id or info.name()
    print(f"{info.name()}: rates {gyro}, forces {accel}", file=sys.stderr)
    while True:
        values, stamp = inlet.pull_sample(timeout=1.0)
        if values is None:
            continue
        said = {"id": name, "stamp_s": stamp, "gyro": [values[i] * rad for i in gyro]}
        if accel:
            said["accel"] = [values[i] * mps2 for i in accel]
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError):
        pass

"""Notifications of a Bluetooth LE device -> JSON lines (PyPI `bleak`).

    python3 ble.py --list
    python3 ble.py AA:BB:CC:DD:EE:FF 0000ffe4-0000-1000-8000-00805f9a34fb --layout '<6h' \\
        --roles axyzgxyz --accel 0.00239423 --gyro 0.00106526 | strapd serve - --stamp arrival

`--layout` is that of Python's `struct` for one sample; a notification may hold several. `--roles` says what its numbers
are, in their order: `gx`, `gy`, `gz` the rate, `ax`, `ay`, `az` the specific force, `t` the time, `_` nothing. Factors
make them rad/s, m/s^2 and seconds. What has no time of its own is stamped when it comes (`--stamp arrival`).
"""

import argparse
import asyncio
import json
import re
import struct
import sys

import bleak


def names_of(text):
    """`gx`, `t`, `_` of `gxgyt_`; an axis without a letter before it is of the sensor before."""
    names, sensor = [], None
    if not re.fullmatch("([ga][xyz]{1,3}|[t_])+", text):
        raise SystemExit(f"--roles {text}: like axyzgxyz or tgxyz__")
    for letter, axis, other in re.findall("([ga]?)([xyz])|([t_])", text):
        sensor = letter or sensor
        names.append(other or sensor + axis)
    for sensor in sorted({name[0] for name in names if len(name) == 2} | {"g"}):
        if not {sensor + axis for axis in "xyz"} <= set(names):
            raise SystemExit(f"--roles {text}: {sensor}x, {sensor}y and {sensor}z must be in it")
    return names


def samples(data, layout, names, factors):
    """The samples of a notification, as objects of strapd's; what is left over at its end is none."""
    for values in layout.iter_unpack(data[: len(data) - len(data) % layout.size]):
        of = dict(zip(names, values))
        said = {"gyro": [of[f"g{axis}"] * factors.gyro for axis in "xyz"]}
        if "ax" in of:
            said["accel"] = [of[f"a{axis}"] * factors.accel for axis in "xyz"]
        if "t" in of:
            said["stamp_s"] = of["t"] * factors.time
        yield said


async def run(asked):
    layout, names = struct.Struct(asked.layout), names_of(asked.roles)
    if len(layout.unpack(bytes(layout.size))) != len(names):
        raise SystemExit(f"--layout {asked.layout} holds {len(layout.unpack(bytes(layout.size)))} numbers, --roles names {len(names)}")
    gone = asyncio.Event()

    def notified(_, data):
        for said in samples(bytes(data), layout, names, asked):
            print(json.dumps({"id": asked.id, **said}), flush=True)

    while True:
        async with bleak.BleakClient(asked.address, disconnected_callback=lambda _: gone.set()) as client:
            for sent in asked.send:
                where, what = sent.split("=")
                await client.write_gatt_char(where, bytes.fromhex(what))
            await client.start_notify(asked.characteristic, notified)
            print(f"{asked.address}: connected", file=sys.stderr)
            await gone.wait()
        if asked.once:
            return
        gone.clear()
        print(f"{asked.address}: gone; it is waited for", file=sys.stderr)


async def listed():
    for device in await bleak.BleakScanner.discover():
        print(device.address, device.name)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address", nargs="?")
    parser.add_argument("characteristic", nargs="?", help="UUID of what notifies")
    parser.add_argument("--layout", default="<6h")
    parser.add_argument("--roles", default="axyzgxyz")
    parser.add_argument("--gyro", type=float, default=1.0, help="times a rate is rad/s")
    parser.add_argument("--accel", type=float, default=1.0, help="times a force is m/s^2")
    parser.add_argument("--time", type=float, default=1.0, help="times a time is s")
    parser.add_argument("--send", action="append", default=[], metavar="UUID=HEX", help="bytes that start the device")
    parser.add_argument("--id", default="ble")
    parser.add_argument("--once", action="store_true", help="ends when the device has gone")
    parser.add_argument("--list", action="store_true", help="lists the devices that can be heard")
    asked = parser.parse_args()
    if asked.list:
        return asyncio.run(listed())
    if not asked.characteristic:
        parser.error("an address, and the characteristic that notifies")
    asyncio.run(run(asked))


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError):
        pass

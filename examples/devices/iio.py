"""A gyro that Linux knows as an Industrial I/O device -> JSON lines.

    python3 iio.py | strapd serve -
    python3 iio.py --device iio:device2 --rate 200

Reads the device's buffer, not its values one by one: every sample has the kernel's own stamp. A trigger must be set
(many drivers bring one; else `modprobe iio-trig-hrtimer`). Needs no library; the rights of root, or of a udev rule.
"""

import argparse
import json
import pathlib
import re

ROLES = {"gyro": "anglvel", "accel": "accel", "mag": "magn"}
# What a kernel's `scale` gives: rad/s, m/s^2, gauss.


def read(path, default=None):
    try:
        return path.read_text().strip()
    except OSError:
        return default


def find(root, name):
    """The folder of a device: that of this name, or the first with a gyro in its buffer."""
    devices = sorted((root / "sys/bus/iio/devices").glob("iio:device*"))
    for device in devices:
        if name in (device.name, read(device / "name")):
            return device
        if name is None and (device / "scan_elements/in_anglvel_x_en").exists():
            return device
    there = ", ".join(f"{d.name} ({read(d / 'name', '?')})" for d in devices) or "none"
    raise SystemExit(f"no such device with a gyro in its buffer; there are: {there}")


class Channel:
    """A channel of the buffer: `le:s16/16>>0` and its like."""

    def __init__(self, device, name):
        kind = read(device / f"scan_elements/{name}_type")
        match = re.fullmatch(r"(le|be):([su])(\d+)/(\d+)(?:X\d+)?>>(\d+)", kind or "")
        if match is None:
            raise SystemExit(f"{name}: a layout that is not known: {kind}")
        order, sign, bits, size, shift = match.groups()
        self.name, self.order = name, "little" if order == "le" else "big"
        self.bits, self.size, self.shift = int(bits), int(size) // 8, int(shift)
        self.is_signed = sign == "s"
        self.index = int(read(device / f"scan_elements/{name}_index", "0"))
        # Of the axis alone, or of the sensor.
        either = [device / f"{name}_{{}}", device / f"{name.rsplit('_', 1)[0]}_{{}}"]
        number = lambda what, default: next(
            (float(v) for p in either if (v := read(pathlib.Path(str(p).format(what)))) is not None), default)
        self.scale, self.offset = number("scale", 1.0), number("offset", 0.0)

    def value(self, scan, at):
        raw = int.from_bytes(scan[at : at + self.size], self.order) >> self.shift & (1 << self.bits) - 1
        if self.is_signed and raw >> self.bits - 1:
            raw -= 1 << self.bits
        return raw


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", help="its number (iio:device0) or name; else the first with a gyro")
    parser.add_argument("--rate", type=float, help="samples a second to ask of it")
    parser.add_argument("--id", help="name of the sensor; else that of the device")
    parser.add_argument("--root", default="/", type=pathlib.Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    device = find(asked.root, asked.device)
    if asked.rate:
        (device / "sampling_frequency").write_text(f"{asked.rate:g}")
    wanted = [f"in_{kind}_{axis}" for kind in ROLES.values() for axis in "xyz"]
    wanted = [name for name in wanted if (device / f"scan_elements/{name}_en").exists()]
    (device / "buffer/enable").write_text("0")
    for name in [*wanted, "in_timestamp"]:
        (device / f"scan_elements/{name}_en").write_text("1")
    channels = sorted((Channel(device, name) for name in [*wanted, "in_timestamp"]), key=lambda c: c.index)
    # Each lies at a multiple of its own size, and the whole is a multiple of the largest.
    places, end = [], 0
    for channel in channels:
        end += -end % channel.size
        places.append((channel, end))
        end += channel.size
    end += -end % max(channel.size for channel in channels)
    name = asked.id or read(device / "name") or device.name
    (device / "buffer/enable").write_text("1")
    try:
        with open(asked.root / "dev" / device.name, "rb", buffering=0) as buffer:
            while scan := whole(buffer, end):
                print(json.dumps(line(name, places, scan)), flush=True)
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    finally:
        (device / "buffer/enable").write_text("0")


def whole(buffer, size):
    """The bytes of one scan; None at the end."""
    scan = b""
    while len(scan) < size:
        more = buffer.read(size - len(scan))
        if not more:
            return None
        scan += more
    return scan


def line(name, places, scan):
    values = {}
    for channel, at in places:
        raw = channel.value(scan, at)
        if channel.name == "in_timestamp":
            values["stamp_ns"] = raw
        else:
            values[channel.name] = (raw + channel.offset) * channel.scale
    said = {"id": name, "stamp_ns": values["stamp_ns"]}
    for role, kind in ROLES.items():
        if all(f"in_{kind}_{axis}" in values for axis in "xyz"):
            said[role] = [values[f"in_{kind}_{axis}"] for axis in "xyz"]
    return said


if __name__ == "__main__":
    main()

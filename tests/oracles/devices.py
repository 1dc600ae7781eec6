"""Runs a recipe of examples/devices against a device that is simulated here: its lines go to standard output.

The device turns by 90 degrees about z in one second, at rest otherwise, and says so in raw counts of its own: 100 samples
a second, 101 of them that turn. What is simulated is the interface (a bus, a kernel's folder, a radio, a network), from
its documents and not from the recipe.
"""

import asyncio
import os
import pathlib
import runpy
import struct
import sys
import tempfile
import threading
import types

HERE = pathlib.Path(__file__).resolve().parents[2] / "examples/devices"
MOVING = 101
RAD = 1.5707963267948966


def run(script, *arguments):
    sys.argv = [script, *arguments]
    runpy.run_path(str(HERE / script), run_name="__main__")


def micropython():
    """`machine.I2C` with the registers of an MPU-6050, as its data sheet numbers them."""
    registers = {0x3A: 0}
    clock = {"us": (1 << 30) - 400_000, "taken": 0}

    class Bus:
        def __init__(self, number, *, scl, sda, freq):
            assert freq == 400000

        def writeto_mem(self, address, register, data):
            assert address == 0x68
            registers[register] = data[0]

        def readfrom_mem(self, address, register, count):
            if register == 0x3A:
                assert registers[0x6B] & 0x40 == 0, "it sleeps"
                # Ready every third time it is asked.
                clock["us"] += 3000
                clock["taken"] += 1
                return bytes([clock["taken"] % 3 == 0])
            assert (register, count) == (0x3B, 14)
            full, force = {0x18: 2000, 0x00: 250}[registers[0x1B]], {0x10: 8, 0x00: 2}[registers[0x1C]]
            clock["us"] += 1000
            if clock["taken"] > 3 * MOVING:
                raise SystemExit
            rate = round(90 / full * 32768)
            return struct.pack(">7h", 0, 0, round(32768 / force), 0, 0, 0, rate)

    class Time(types.ModuleType):
        def ticks_us(self):
            return clock["us"] % (1 << 30)

    machine = types.ModuleType("machine")
    machine.I2C, machine.Pin = Bus, lambda number: number
    sys.modules["machine"] = machine
    sys.modules["time"] = Time("time")
    run("mpu6050_micropython.py")


def iio():
    """The folders of a kernel's Industrial I/O, and its device as a pipe."""
    root = pathlib.Path(tempfile.mkdtemp())
    folder = root / "sys/bus/iio/devices"
    for number, name in ((0, "adc"), (1, "bmi160")):
        device = folder / f"iio:device{number}"
        (device / "scan_elements").mkdir(parents=True)
        (device / "buffer").mkdir()
        (device / "name").write_text(name + "\n")
    put = lambda name, text: (device / name).write_text(text + "\n")
    put("buffer/enable", "0")
    put("sampling_frequency", "50")
    # 16 bits of which 12 count, for the accelerometer; the gyro's scale is its own, the accelerometer's of the sensor.
    for index, (kind, axis) in enumerate((k, a) for k in ("accel", "anglvel") for a in "xyz"):
        put(f"scan_elements/in_{kind}_{axis}_en", "0")
        put(f"scan_elements/in_{kind}_{axis}_index", str(index))
        put(f"scan_elements/in_{kind}_{axis}_type", "be:s12/16>>4" if kind == "accel" else "le:s16/16>>0")
        if kind == "anglvel":
            put(f"in_anglvel_{axis}_scale", "0.001065264")
    put("in_accel_scale", "0.009582")
    put("scan_elements/in_timestamp_en", "0")
    put("scan_elements/in_timestamp_index", "6")
    put("scan_elements/in_timestamp_type", "le:s64/64>>0")
    (root / "dev").mkdir()
    os.mkfifo(root / "dev/iio:device1")

    def kernel():
        # Nothing is written before somebody reads, and nothing at all of what is not enabled.
        with open(root / "dev/iio:device1", "wb") as buffer:
            assert (device / "buffer/enable").read_text().strip() == "1"
            on = [p.name for p in (device / "scan_elements").glob("*_en") if p.read_text().strip() == "1"]
            assert len(on) == 7, on
            assert (device / "sampling_frequency").read_text().strip() == "100"
            for n in range(MOVING):
                force = struct.pack(">3h", 0, 0, round(9.80665 / 0.009582) << 4)
                rate = struct.pack("<3h", 0, 0, round(RAD / 0.001065264))
                stamp = 1_700_000_000_000_000_000 + n * 10_000_000
                scan = force + rate + bytes(4) + struct.pack("<q", stamp)
                # A pipe hands on what there is.
                buffer.write(scan[:9])
                buffer.flush()
                buffer.write(scan[9:])

    threading.Thread(target=kernel, daemon=True).start()
    run("iio.py", "--root", str(root), "--rate", "100")
    assert (device / "buffer/enable").read_text().strip() == "0", "it was not switched off"


def ble():
    """A peripheral of bleak's that notifies, two samples at once, when it has been told to begin."""
    import bleak

    class Peripheral(bleak.BleakClient):
        def __init__(self, address, disconnected_callback=None):
            assert address == "AA:BB:CC:DD:EE:FF"
            self.gone, self.told, self.task = disconnected_callback, b"", None

        async def __aenter__(self):
            return self

        async def __aexit__(self, *_):
            await self.task

        async def write_gatt_char(self, characteristic, data, response=None):
            self.told += bytes(data)

        async def start_notify(self, characteristic, callback):
            assert self.told == bytes([0xFF, 0xAA, 0x03])

            async def notifies():
                sample = lambda n: struct.pack("<I6h", 10 * n, 0, 0, 4096, 0, 0, round(RAD / 0.00106526))
                for n in range(0, MOVING + 1, 2):
                    callback(characteristic, bytearray(sample(n) + sample(n + 1) + b"\x00"))
                    await asyncio.sleep(0)
                self.gone(self)

            self.task = asyncio.create_task(notifies())

    bleak.BleakClient = Peripheral
    run("ble.py", "AA:BB:CC:DD:EE:FF", "ffe4", "--layout", "<I6h", "--roles", "taxyzgxyz", "--gyro", "0.00106526",
        "--accel", "0.00239423", "--time", "1e-3", "--send", "ffe9=ffaa03", "--once")


def lsl_in():
    """An amplifier on the network, as pylsl makes one, whose labels name its channels."""
    import pylsl

    info = pylsl.StreamInfo(f"IMU{os.getpid()}", "IMU", 6, 100, "float32", f"imu{os.getpid()}")
    channels = info.desc().append_child("channels")
    for label in ("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"):
        channels.append_child("channel").append_child_value("label", label)
    outlet = pylsl.StreamOutlet(info)

    def amplifier():
        outlet.wait_for_consumers(20)
        begin = pylsl.local_clock()
        for n in range(MOVING):
            outlet.push_sample([0, 0, 1, 0, 0, 90], begin + 0.01 * n)
        while outlet.have_consumers():
            threading.Event().wait(0.05)
            if len(sys.stdout.got) >= MOVING:
                os._exit(0)

    class Counted:
        def __init__(self, out):
            self.out, self.got = out, []

        def write(self, text):
            self.got += [1] * text.count("\n")
            return self.out.write(text)

        def flush(self):
            self.out.flush()

    sys.stdout = Counted(sys.stdout)
    threading.Thread(target=amplifier, daemon=True).start()
    run("lsl_in.py", "--name", f"IMU{os.getpid()}", "--degrees", "--g")


def lsl_out():
    """A recorder on the network: prints the attitudes of a sensor as it receives them, until there are 100."""
    import json
    import subprocess

    import pylsl

    with subprocess.Popen([sys.executable, HERE / "lsl_out.py", sys.argv[2]]) as program:
        found = pylsl.resolve_byprop("name", "strapd turning", timeout=20)
        inlet = pylsl.StreamInlet(found[0])
        inlet.open_stream(timeout=10)
        print("ready", flush=True)
        for _ in range(100):
            values, stamp = inlet.pull_sample(timeout=20)
            print(json.dumps({"q": values, "stamp": stamp}), flush=True)
        program.kill()


globals()[sys.argv[1]]()

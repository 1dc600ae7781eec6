"""An MPU-6050 on a board with MicroPython: one JSON line a sample, 100 a second.

    strapd serve 'serial:///dev/ttyACM0?id=left'

Copy it to the board as main.py. The pins are those of a Raspberry Pi Pico; on an ESP32 they are often 22 and 21.
"""

from machine import I2C, Pin
from time import ticks_us
from struct import unpack

ADDRESS = 0x68
RAD_PER_COUNT = 0.017453293 / 16.4  # at 2000 deg/s
MPS2_PER_COUNT = 9.80665 / 4096  # at 8 g
# Ticks come back to 0 after 2^30 us, 18 minutes; they are added up here.
TURN = 1 << 30

bus = I2C(0, scl=Pin(1), sda=Pin(0), freq=400000)
for register, value in ((0x6B, 0x01), (0x1A, 0x02), (0x19, 9), (0x1B, 0x18), (0x1C, 0x10)):
    bus.writeto_mem(ADDRESS, register, bytes([value]))

line = '{"stamp_us":%d,"gyro":[%.5f,%.5f,%.5f],"accel":[%.3f,%.3f,%.3f]}'
last, since_start = ticks_us(), 0
while True:
    if not bus.readfrom_mem(ADDRESS, 0x3A, 1)[0] & 1:
        continue
    now = ticks_us()
    since_start, last = since_start + (now - last) % TURN, now
    ax, ay, az, _, gx, gy, gz = unpack(">7h", bus.readfrom_mem(ADDRESS, 0x3B, 14))
    rates = tuple(RAD_PER_COUNT * count for count in (gx, gy, gz))
    forces = tuple(MPS2_PER_COUNT * count for count in (ax, ay, az))
    print(line % ((since_start,) + rates + forces))

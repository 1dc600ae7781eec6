#!/usr/bin/env python3
"""Draws docs/pictures/acceleration.svg: the vertical acceleration of a wrist that swings as its owner walks, by a sensor
of `strapd simulate`, beside the true one and between its three sigma.

    cargo build
    benches/acceleration.py      STRAPD=target/debug/strapd
"""
import csv
import os
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
STRAPD = os.path.abspath(os.environ.get("STRAPD", os.path.join(HERE, "../target/debug/strapd")))
PICTURE = os.path.join(HERE, "../docs/pictures/acceleration.svg")
GRAVITY = 9.80665
FIRST, SECS, WIDTH, HEIGHT, LEFT, BOTTOM, TOP, MOST = 30.0, 4.0, 760, 260, 60, 40, 30, 12.0


def table(folder, name, *arguments):
    path = os.path.join(folder, name)
    subprocess.run([STRAPD, *arguments, "-q", "-o", path], check=True, env={**os.environ, "STRAPD_AID": "auto"})
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def up(q, v):
    """Vertical part in the world of a vector of the body."""
    w, x, y, z = q
    return 2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]


def numbers(row, *names):
    return [float(row[name]) for name in names]


def main():
    motion = ["simulate", "walking", "--worn", "hand", "--rate-hz", "100", "--duration", "40", "--seed", "3"]
    with tempfile.TemporaryDirectory() as folder:
        exact = table(folder, "exact.csv", *motion)
        table(folder, "made.csv", *motion, "--noise", "consumer_imu")
        found = table(folder, "out.csv", "replay", os.path.join(folder, "made.csv"), "--linear-acceleration")
    forces, turns = (["accel_x", "accel_y", "accel_z"], ["qw", "qx", "qy", "qz"])
    truth = [up(numbers(row, *turns), numbers(row, *forces)) - GRAVITY for row in exact]
    body = [f"sigma_linear_acceleration_{axis}" for axis in "xyz"]
    values = [float(row["world_linear_acceleration_z"]) for row in found]
    sigmas = [max(numbers(row, *body)) for row in found]
    rows = range(int(FIRST * 100), int((FIRST + SECS) * 100))

    def x(n):
        return LEFT + (n / 100 - FIRST) / SECS * (WIDTH - LEFT - 10)

    def y(value):
        return TOP + (MOST - max(-MOST, min(MOST, value))) / (2 * MOST) * (HEIGHT - TOP - BOTTOM)

    def path(points):
        return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in points)

    band = [(x(n), y(values[n] + 3 * sigmas[n])) for n in rows] + [(x(n), y(values[n] - 3 * sigmas[n])) for n in reversed(rows)]
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        ' font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#fff"/>',
        f'<text x="{LEFT}" y="18" font-size="14">Vertical acceleration of a wrist</text>',
        f'<text x="{WIDTH - 330}" y="18">- - true &#160; <tspan fill="#d55e00">&#8212; estimated, 3 sigma</tspan></text>',
    ]
    for value in range(-12, 13, 6):
        text.append(f'<path d="M{LEFT} {y(value):.1f}H{WIDTH - 10}" stroke="#ddd"/><text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value}</text>')
    for secs in range(int(SECS) + 1):
        at = x((FIRST + secs) * 100)
        text.append(f'<text x="{at:.0f}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{FIRST + secs:.0f}</text>')
    text.append(f'<text x="{WIDTH / 2:.0f}" y="{HEIGHT - 6}" text-anchor="middle">time, s</text>')
    text.append(f'<text transform="translate(14 {HEIGHT / 2:.0f}) rotate(-90)" text-anchor="middle">m/s&#178;</text>')
    text.append(f'<path d="{path(band)}Z" fill="#d55e00" fill-opacity="0.2"/>')
    text.append(f'<path d="{path([(x(n), y(values[n])) for n in rows])}" fill="none" stroke="#d55e00" stroke-width="1.6"/>')
    text.append(f'<path d="{path([(x(n), y(truth[n])) for n in rows])}" fill="none" stroke="#000" stroke-dasharray="5 4"/>')
    with open(PICTURE, "w", encoding="utf-8") as file:
        file.write("\n".join([*text, "</svg>"]) + "\n")


if __name__ == "__main__":
    main()

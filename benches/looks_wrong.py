#!/usr/bin/env python3
"""Draws the pictures of docs/looks-wrong.md into docs/pictures: a hand that `strapd simulate` moves, one thing wrong with
its samples or flags, and the attitude that `strapd replay` makes of it beside the true one.

    cargo build
    benches/looks_wrong.py      STRAPD=target/debug/strapd
"""
import csv
import math
import os
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
STRAPD = os.path.abspath(os.environ.get("STRAPD", os.path.join(HERE, "../target/debug/strapd")))
PICTURES = os.path.join(HERE, "../docs/pictures")
SECS, HZ = 40, 100
GYRO, FORCE = [[f"{of}_{axis}" for axis in "xyz"] for of in ("gyro", "accel")]
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 760, 260, 60, 40, 30
# Every so many attitudes are drawn.
THIN = 12


def run(*arguments):
    return subprocess.run([STRAPD, *arguments], capture_output=True, text=True, check=False)


def hand(folder):
    """Stamp, rate, force, true orientation."""
    path = os.path.join(folder, "hand.csv")
    run("simulate", "hand", "--rate-hz", str(HZ), "--duration", str(SECS), "--noise", "consumer_imu", "-o", path, "--force")
    with open(path, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [
        (int(r["stamp_ns"]), *([float(r[c]) for c in of] for of in (GYRO, FORCE, ("qw", "qx", "qy", "qz")))) for r in rows
    ]


def angles(q):
    """Roll, pitch and heading, degrees."""
    w, x, y, z = q
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return [math.degrees(angle) for angle in (roll, pitch, heading)]


def gyro(change):
    return lambda n, t, w, f: (t, change(n, *w), f)


def both(change, when):
    return lambda n, t, w, f: (t, change(*w), change(*f)) if when(n) else (t, w, f)


ROLL, PITCH, HEADING = 0, 1, 2
SYMPTOMS = {
    "degrees": ("deg/s taken for rad/s", ROLL, gyro(lambda n, *w: [v * 180 / math.pi for v in w]), ["--gyro-unit", "rad"]),
    "axes": ("x and y of the gyro exchanged", PITCH, gyro(lambda n, x, y, z: [y, x, z]), []),
    "axes-half-way": (
        "x and y of the gyro exchanged from 20 s on",
        PITCH,
        gyro(lambda n, x, y, z: [y, x, z] if n >= 2000 else [x, y, z]),
        [],
    ),
    "no-gravity": (
        "the gyro alone, with a bias",
        ROLL,
        gyro(lambda n, x, y, z: [x + 0.01, y - 0.01, z]),
        ["--aid", "none", "--init", "gravity"],
    ),
    "bias": ("a bias about the vertical", HEADING, gyro(lambda n, x, y, z: [x, y, z + 0.03]), ["--aid", "none", "--init", "gravity"]),
    "clipped": ("rates clipped at 60 deg/s", HEADING, gyro(lambda n, *w: [max(-1.05, min(1.05, v)) for v in w]), []),
    "spike": (
        "one sample of 60 rad/s, kept",
        HEADING,
        gyro(lambda n, x, y, z: [x, y, z + 60 * (n == 1800)]),
        ["--spikes", "keep"],
    ),
    "gap": ("three seconds are missing", HEADING, lambda n, t, w, f: None if 1500 <= n < 1800 else (t, w, f), []),
    "frozen": (
        "stamps stand still from 15 s on",
        PITCH,
        lambda n, t, w, f: (t - max(0, n - 1500) * 9_999_000, w, f),
        ["--stamps", "as-recorded"],
    ),
    "mirrored": ("an accelerometer that says down taken for one that says up", PITCH, lambda n, t, w, f: (t, w, [-v for v in f]), []),
    "two-sensors": ("every other sample is of another sensor", ROLL, both(lambda x, y, z: [z, x, y], lambda n: n % 2), []),
}


def shown(folder, rows, fault, flags):
    """Stamp and orientation that are made of faulty samples."""
    path, out = (os.path.join(folder, name) for name in ("fault.csv", "out.csv"))
    with open(path, "w", encoding="utf-8") as file:
        file.write("stamp_ns," + ",".join(GYRO + FORCE) + "\n")
        for n, (t, w, f, _) in enumerate(rows):
            row = fault(n, t, w, f)
            if row:
                t, w, f = row
                file.write(f"{t}," + ",".join(f"{v:.9g}" for v in (*w, *f)) + "\n")
    run("replay", "--aid", "gravity", *flags, "-o", out, "--force", path)
    with open(out, encoding="utf-8") as file:
        rows = csv.DictReader(file)
        return [(int(r["stamp_ns"]), [float(r[c]) for c in ("qw", "qx", "qy", "qz")]) for r in rows]


def line(points, which, start, lowest, highest, look):
    """Path of one angle, interrupted where it goes round."""
    first = angles(points[0][1])[which] if which == HEADING else 0.0
    parts, before = [], None
    for t, q in points[::THIN]:
        angle = (angles(q)[which] - first + 540) % 360 - 180
        x = LEFT + (t - start) / 1e9 / SECS * (WIDTH - LEFT - 10)
        y = TOP + (highest - angle) / (highest - lowest) * (HEIGHT - TOP - BOTTOM)
        jumps = before is None or abs(angle - before) > 180
        parts.append(f"{'M' if jumps else 'L'}{x:.0f} {y:.1f}")
        before = angle
    return f'<path d="{"".join(parts)}" fill="none" {look}/>'


def picture(title, which, truth, made):
    start = truth[0][0]
    lowest, highest = (-90, 90) if which == PITCH else (-180, 180)
    name = ("roll", "pitch", "heading")[which]
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        ' font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#fff"/>',
        f'<text x="{LEFT}" y="18" font-size="14">{title}</text>',
        f'<text x="{WIDTH - 250}" y="18">- - true &#160; <tspan fill="#d55e00">&#8212; shown</tspan></text>',
    ]
    for angle in range(lowest, highest + 1, (highest - lowest) // 4):
        y = TOP + (highest - angle) / (highest - lowest) * (HEIGHT - TOP - BOTTOM)
        text.append(f'<path d="M{LEFT} {y:.1f}H{WIDTH - 10}" stroke="#ddd"/><text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{angle}</text>')
    for secs in range(0, SECS + 1, 10):
        x = LEFT + secs / SECS * (WIDTH - LEFT - 10)
        text.append(f'<text x="{x:.0f}" y="{HEIGHT - BOTTOM + 16}" text-anchor="middle">{secs}</text>')
    text.append(f'<text x="{WIDTH / 2:.0f}" y="{HEIGHT - 6}" text-anchor="middle">time, s</text>')
    text.append(f'<text transform="translate(14 {HEIGHT / 2:.0f}) rotate(-90)" text-anchor="middle">{name}, deg</text>')
    text.append(line(made, which, start, lowest, highest, 'stroke="#d55e00" stroke-width="1.6"'))
    text.append(line(truth, which, start, lowest, highest, 'stroke="#000" stroke-dasharray="4 3"'))
    return "\n".join(text) + "\n</svg>\n"


def main():
    with tempfile.TemporaryDirectory() as folder:
        rows = hand(folder)
        truth = [(t, q) for t, _, _, q in rows]
        for name, (title, which, fault, flags) in SYMPTOMS.items():
            svg = picture(title, which, truth, shown(folder, rows, fault, flags))
            with open(os.path.join(PICTURES, f"wrong-{name}.svg"), "w", encoding="utf-8") as file:
                file.write(svg)
            print(f"wrong-{name}.svg  {len(svg)} bytes")


if __name__ == "__main__":
    main()

"""An attitude, or a log -> HTML for notebooks: a few words and a small picture in SVG, no script."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _angles

if TYPE_CHECKING:
    from ._attitude import Attitude

#: Points of a line.
POINTS = 400
WIDTH, HEIGHT, LEFT, BELOW = 640, 170, 40, 18
COLOURS = {"roll": "#0072B2", "pitch": "#D55E00", "yaw": "#009E73"}


def of_attitude(att: Attitude) -> str:
    """What ``repr`` says, and roll, pitch and yaw over time."""
    head = f"<code>{escape(repr(att))}</code>"
    if len(att) < 2:
        return head
    told = "".join(f"<div>{escape(warning)}</div>" for warning in att.warnings[:3])
    return f"<div>{head}{_picture(att)}{told}</div>"


def _picture(att: Attitude) -> str:
    every = max(1, -(-len(att) // POINTS))
    # The last one, too.
    rows = np.append(np.arange(0, len(att) - 1, every), len(att) - 1)
    angles = _angles.roll_pitch_yaw(att.q[rows])
    seconds = (att.t[rows] - att.t[0]) * 1e-9
    span = max(float(seconds[-1]), 1e-9)
    low, high = float(np.nanmin(angles)), float(np.nanmax(angles))
    low, high = (low - 1, high + 1) if high - low < 2 else (low, high)
    x = LEFT + seconds / span * (WIDTH - LEFT - 4)
    y = 4 + (high - angles) / (high - low) * (HEIGHT - BELOW - 8)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'role="img" aria-label="roll, pitch and yaw over time" style="display:block;max-width:100%" font-size="11" font-family="sans-serif">'
    ]
    for value in (low, (low + high) / 2, high):
        at = 4 + (high - value) / (high - low) * (HEIGHT - BELOW - 8)
        parts.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - 4}" stroke="currentColor" stroke-opacity="0.2"/>')
        parts.append(f'<text x="{LEFT - 4}" y="{min(max(at + 4, 11), HEIGHT):.1f}" text-anchor="end" fill="currentColor">{value:.0f}°</text>')
    for i, (name, colour) in enumerate(COLOURS.items()):
        parts.append(f'<path d="{_line(x, y[:, i], angles[:, i])}" fill="none" stroke="{colour}" stroke-width="1.3"/>')
        parts.append(f'<text x="{LEFT + 10 + 48 * i}" y="{HEIGHT - 4}" fill="{colour}">{name}</text>')
    parts.append(f'<text x="{WIDTH - 4}" y="{HEIGHT - 4}" text-anchor="end" fill="currentColor">{span:.6g} s</text></svg>')
    return "".join(parts)


def _line(x: Any, y: Any, angles: Any) -> str:
    """A path that is lifted where the angle goes from 180 to -180 degrees, or is not known."""
    words, is_down = [], False
    for i in range(len(x)):
        if not np.isfinite(y[i]):
            is_down = False
            continue
        is_down = is_down and abs(angles[i] - angles[i - 1]) < 180
        words.append(f"{'L' if is_down else 'M'}{x[i]:.1f} {y[i]:.1f}")
        is_down = True
    return "".join(words)


def of_log(path: str, info: dict[str, Any]) -> str:
    """The table of ``strapd info``: topics, types, messages, rates."""
    rates = {imu["topic"]: imu["rate_hz"] for imu in info["imu"]}
    rows = []
    for topic in info["topics"]:
        rate = rates.get(topic["topic"])
        cells = [topic["topic"], topic["type"] or "", str(topic["messages"]), "" if rate is None else f"{rate:.6g} Hz"]
        rows.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
    problems = "".join(f"<div>{escape(problem)}</div>" for problem in info["problems"])
    head = f"<code>{escape(path)}</code>: {escape(info['format'])}, {info['messages']} messages"
    return f"<div>{head}<table><tr><th>topic</th><th>type</th><th>messages</th><th>rate</th></tr>{''.join(rows)}</table>{problems}</div>"

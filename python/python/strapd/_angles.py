"""Attitudes -> angles, their sigmas, and errors against a reference, over time: what is drawn."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Nanos = npt.NDArray[np.int64]
Align = Literal["none", "first", "first-heading"]


def roll_pitch_yaw(q: Floats) -> Floats:
    """(n, 3), degrees: of the turns about z, then y, then x."""
    w, x, y, z = q.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    angles: Floats = np.degrees(np.stack([roll, pitch, yaw], axis=1))
    return angles


def sigmas_of(angles: Floats, covariance: Floats) -> Floats:
    """(n, 3), degrees: one sigma of roll, pitch and yaw, from the covariance about body axes; at most half a turn."""
    roll, pitch = np.radians(angles[:, 0]), np.radians(angles[:, 1])
    cos = np.maximum(np.cos(pitch), 1e-6)
    zero, one = np.zeros_like(roll), np.ones_like(roll)
    # How roll, pitch and yaw change with a small turn about the body axes.
    change = np.stack(
        [
            np.stack([one, np.sin(roll) * np.sin(pitch) / cos, np.cos(roll) * np.sin(pitch) / cos], axis=1),
            np.stack([zero, np.cos(roll), -np.sin(roll)], axis=1),
            np.stack([zero, np.sin(roll) / cos, np.cos(roll) / cos], axis=1),
        ],
        axis=1,
    )
    found = np.einsum("nij,njk,nik->ni", change, covariance, change)
    sigmas: Floats = np.minimum(np.degrees(np.sqrt(np.maximum(found, 0.0))), 180.0)
    return sigmas


def times(a: Floats, b: Floats) -> Floats:
    """Products of quaternions."""
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    product: Floats = np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=1,
    )
    return product


def inverse(q: Floats) -> Floats:
    """Of unit quaternions."""
    turned: Floats = q * np.array([1.0, -1.0, -1.0, -1.0])
    return turned


def rotation_vectors(q: Floats) -> Floats:
    """(n, 3), rad: axis times angle, the shorter way."""
    q = np.where(q[:, :1] < 0, -q, q)
    length = np.linalg.norm(q[:, 1:], axis=1)
    angle = 2 * np.arctan2(length, q[:, 0])
    scale = np.divide(angle, length, out=np.full_like(length, 2.0), where=length > 1e-12)
    vectors: Floats = q[:, 1:] * scale[:, None]
    return vectors


def at(stamps: Nanos, q: Floats, wanted: Nanos) -> Floats:
    """Attitudes at the stamps that are wanted, between their neighbours on the shortest way; NaN outside."""
    if len(stamps) == 0 or (np.diff(stamps) <= 0).any():
        raise ValueError("reference: its stamps do not increase")
    right = np.clip(np.searchsorted(stamps, wanted), 1, max(len(stamps) - 1, 1))
    left = np.minimum(right - 1, len(stamps) - 1)
    right = np.minimum(right, len(stamps) - 1)
    span = np.maximum(stamps[right] - stamps[left], 1)
    part = (wanted - stamps[left]) / span
    turn = rotation_vectors(times(inverse(q[left]), q[right])) * part[:, None]
    angle = np.linalg.norm(turn, axis=1)
    half = np.sinc(angle / (2 * np.pi)) / 2
    step = np.concatenate([np.cos(angle / 2)[:, None], turn * half[:, None]], axis=1)
    found = times(q[left], step)
    found[(wanted < stamps[0]) | (wanted > stamps[-1])] = np.nan
    return found


def errors(t: Nanos, q: Floats, reference: tuple[Nanos, Floats], align: Align) -> Floats:
    """(n, 3), degrees about the body axes: how far ``q`` is from the reference, NaN where there is none.

    :param align: the constant rotation of the world that is taken out first, found at the first instant that both have.
    """
    truth = at(*reference, t)
    both = np.flatnonzero(np.isfinite(truth).all(axis=1) & np.isfinite(q).all(axis=1))
    if len(both) == 0:
        raise ValueError("reference: no instant in common\n  help: are both on the same clock?")
    first = both[:1]
    if align == "none":
        turn = np.array([[1.0, 0.0, 0.0, 0.0]])
    elif align in ("first", "first-heading"):
        turn = times(truth[first], inverse(q[first]))
        if align == "first-heading":
            turn = turn * np.array([1.0, 0.0, 0.0, 1.0])
            turn = turn / np.linalg.norm(turn) if np.linalg.norm(turn) > 0 else np.array([[1.0, 0.0, 0.0, 0.0]])
    else:
        raise ValueError(f"align: there is no {align!r}\n  help: one of none, first, first-heading")
    aligned = times(np.repeat(turn, len(q), axis=0), q)
    # The small turn about body axes that takes the truth to the estimate.
    apart: Floats = np.degrees(rotation_vectors(times(inverse(truth), aligned)))
    return apart

"""Attitudes -> attitudes at other instants, such as the frames of a camera."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ._angles import Floats, Nanos, inverse, rotation_vectors, times

if TYPE_CHECKING:
    from ._attitude import Attitude

#: Status of an attitude that does not go on from the one before it.
CUTS = ("held", "reset", "restarted", "levelled")


def _exponential(turn: Floats) -> Floats:
    """Quaternions of rotation vectors."""
    half = np.linalg.norm(turn, axis=1) / 2
    step: Floats = np.concatenate([np.cos(half)[:, None], turn * (np.sinc(half / np.pi) / 2)[:, None]], axis=1)
    return step


def _instants(wanted: npt.ArrayLike) -> Nanos:
    """Integers are nanoseconds, datetime64 what it says; floats have no place beside stamps since 1970."""
    found = np.asarray(wanted)
    if np.issubdtype(found.dtype, np.datetime64):
        found = found.astype("datetime64[ns]").astype(np.int64)
    if not np.issubdtype(found.dtype, np.integer):
        raise ValueError("times: integers (nanoseconds of the clock of `t`) or datetime64\n  help: att.t[0] + (seconds * 1e9).astype(int)")
    if found.ndim != 1:
        raise ValueError(f"times: one dimension, not {found.ndim}")
    return found.astype(np.int64)


def at(att: Attitude, wanted: npt.ArrayLike) -> Floats:
    """See :meth:`strapd.Attitude.at`."""
    instants = _instants(wanted)
    found = np.full((len(instants), 4), np.nan)
    if len(att) == 0:
        _tell(len(instants), len(instants), "there is no attitude")
        return found
    t, q = att.t, att.q
    right = np.clip(np.searchsorted(t, instants, side="left"), 0, len(t) - 1)
    exact = t[right] == instants
    found[exact] = q[right[exact]]
    inside = ~exact & (instants > t[0]) & (instants < t[-1])
    # Across a gap that nothing was integrated over there is no motion to follow.
    starts_anew = np.any([att.flags(name) for name in CUTS], axis=0)
    cut = inside & starts_anew[right]
    _fill(found, inside & ~cut, instants, right, (t, q, starts_anew))
    outside = int((~exact & ~inside).sum())
    _tell(outside, len(instants), "before the first attitude or after the last")
    _tell(int(cut.sum()), len(instants), "in a gap that the attitude was held over")
    return found


def _fill(found: Floats, where: npt.NDArray[np.bool_], instants: Nanos, right: Nanos, run: tuple[Nanos, Floats, npt.NDArray[np.bool_]]) -> None:
    """The cubic on the rotation group through both neighbours, with the rates that the steps beside tell."""
    t, q, starts_anew = run
    if not where.any():
        return
    spans = np.maximum(np.diff(t), 1).astype(np.float64)
    turns = rotation_vectors(times(inverse(q[:-1]), q[1:]))
    rates = turns / spans[:, None]
    joins = ~starts_anew[1:-1] & ~starts_anew[2:]
    # Rate at a node: that of the parabola through three attitudes; at an end, or a cut, that of the one step there is.
    share = (spans[1:] / (spans[:-1] + spans[1:]))[:, None]
    inner = share * rates[:-1] + (1 - share) * rates[1:]
    before, after = rates.copy(), rates.copy()
    before[1:][joins] = inner[joins]
    after[:-1][joins] = inner[joins]
    step = right[where] - 1
    span, turn = spans[step][:, None], turns[step]
    part = ((instants[where] - t[step]) / spans[step])[:, None]
    # Beside their mean the rates of the ends differ by little: what the group's curvature adds to that is of third order.
    bend = (part - 2 * part**2 + part**3) * (before[step] * span - turn) + (part**3 - part**2) * (after[step] * span - turn)
    found[where] = times(q[step], _exponential(turn * part + bend))


def _tell(n: int, total: int, why: str) -> None:
    if n:
        warnings.warn(f"times: {n} of {total} are {why}: NaN", UserWarning, stacklevel=4)

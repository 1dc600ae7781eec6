"""Attitudes -> attitudes at other instants, such as the frames of a camera."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import _strapd
from ._angles import Floats, Nanos

if TYPE_CHECKING:
    from ._attitude import Attitude


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
    if len(att) == 0:
        _tell(len(instants), len(instants), "there is no attitude")
        return np.full((len(instants), 4), np.nan)
    found, outside, in_gaps = _strapd.at(
        np.ascontiguousarray(att.t), np.ascontiguousarray(att.q), np.ascontiguousarray(att.status), instants
    )
    _tell(outside, len(instants), "before the first attitude or after the last")
    _tell(in_gaps, len(instants), "in a gap that the attitude was held over")
    return found


def _tell(n: int, total: int, why: str) -> None:
    if n:
        warnings.warn(f"times: {n} of {total} are {why}: NaN", UserWarning, stacklevel=4)

"""Two attitudes -> how far apart they are."""

from __future__ import annotations

from typing import Any, Literal, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _inputs, _strapd
from ._attitude import Attitude

Track = Union[Attitude, "tuple[npt.ArrayLike, npt.ArrayLike]"]
Align = Literal["none", "first", "first-heading", "heading", "best"]


def _track(name: str, track: Track) -> tuple[_inputs.Nanos, _inputs.Floats]:
    if isinstance(track, Attitude):
        return np.ascontiguousarray(track.t), np.ascontiguousarray(track.q)
    if not isinstance(track, tuple) or len(track) != 2:
        raise ValueError(f"{name}: an Attitude or a pair (t, q) is expected, not {type(track).__name__}")
    t, q = track
    rows = _inputs.rows(name, q, 4)
    try:
        nanos = _inputs._nanos("t", t)
    except ValueError as why:
        raise ValueError(f"{name}: {why}") from None
    if len(nanos) != len(rows):
        raise ValueError(f"{name}: {len(nanos)} stamps for {len(rows)} quaternions")
    return nanos, rows


def _covariance(track: Track) -> Optional[npt.NDArray[np.float64]]:
    """Covariances of a track that states all of them."""
    if isinstance(track, Attitude) and track._cov is not None and np.isfinite(track._cov).all():
        return np.ascontiguousarray(track._cov)
    return None


def compare(a: Track, b: Track, align: Align = "first", *, world: str = "enu") -> dict[str, Any]:
    """How far the estimate ``a`` is from the reference ``b``: the numbers of ``strapd compare --json``, in degrees.

    :param a: an :class:`Attitude`, or ``(t, q)`` with ``q`` (n, 4) as w, x, y, z, body to world; NaN is no attitude, and counted.
    :param b: the same.
    :param align: the constant rotation of the world that is taken out first: ``none``, ``first``, ``first-heading``, ``heading``, ``best``.
    :param world: world of the pairs (t, q): ``ned`` has an FRD body, all others FLU.
    """
    a_t, a_q = _track("a", a)
    b_t, b_q = _track("b", b)
    return _strapd.compare(
        a_t,
        a_q,
        a.world if isinstance(a, Attitude) else world,
        _covariance(a),
        b_t,
        b_q,
        b.world if isinstance(b, Attitude) else world,
        align,
    )

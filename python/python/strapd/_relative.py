"""Attitudes of two bodies -> the angle of the joint between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, Optional

import numpy as np
import numpy.typing as npt

from . import _strapd
from ._attitude import Attitude
from ._compare import Track, _covariance, _track

RelativeHeading = Literal["auto", "hinge", "recorded", "start"]


@dataclass(frozen=True)
class Relative:
    """Attitude of a second body relative to a first, one row an instant of the first. Angles in rad."""

    t: npt.NDArray[np.int64]
    """Stamps, ns."""
    q: npt.NDArray[np.float64]
    """(n, 4), w, x, y, z: axes of the second body to axes of the first."""
    angle: npt.NDArray[np.float64]
    """Angle from the first instant: about the hinge axis, signed and continuous; without a hinge the angle of the rotation."""
    off_axis: npt.NDArray[np.float64]
    """Angle of what is left beside the rotation about the hinge axis."""
    sigma: npt.NDArray[np.float64]
    """Standard deviation of ``angle``; NaN where one of the attitudes has no covariance."""
    heading_offset: npt.NDArray[np.float64]
    """Angle about the vertical that was added to the heading of the second body."""
    heading: str
    """Source of the heading that was used: ``hinge``, ``recorded`` or ``start``."""
    hinge: Optional[dict[str, Any]]
    """Axes in both bodies, misfit, heading offsets at both ends and their sigma; ``None`` where the motion shows no hinge."""
    no_hinge: Optional[str]
    """Reason why there is no hinge."""


def relative(a: Track, b: Track, heading: RelativeHeading = "auto", *, world: str = "enu") -> Relative:
    """Attitude of the body ``b`` relative to the body ``a``: the numbers of ``strapd relative``.

    :param a: an :class:`Attitude`, or ``(t, q)`` with ``q`` (n, 4) as w, x, y, z, body to world; NaN is no attitude.
    :param b: the same; interpolated at the instants of ``a``.
    :param heading: source of the heading of one relative to the other: ``hinge`` (the joint has one axis), ``recorded`` (both know
        north), ``start`` (equal at the first common instant), ``auto`` (``hinge`` if the motion shows one, else ``recorded``).
    :param world: world of the pairs (t, q): ``ned`` has an FRD body, all others FLU.
    """
    a_t, a_q = _track("a", a)
    b_t, b_q = _track("b", b)
    found = _strapd.relative(
        a_t,
        a_q,
        a.world if isinstance(a, Attitude) else world,
        _covariance(a),
        b_t,
        b_q,
        b.world if isinstance(b, Attitude) else world,
        _covariance(b),
        heading,
    )
    return Relative(**found)

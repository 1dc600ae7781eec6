"""What a user gives as samples -> arrays the compiled half takes: float64 and int64, C-contiguous.

An array that is so already is taken as it is, without a copy; everything else is converted, which copies it.
"""

from __future__ import annotations

import os
import warnings
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._errors import ResolutionWarning

Floats = npt.NDArray[np.float64]
Nanos = npt.NDArray[np.int64]

#: Float seconds that differ by more than this from their neighbours are worth a warning.
COARSE_SECS = 1e-7
#: 292 years, in which nanoseconds fit 64 bits, less a little.
LONGEST_SECS = 9.2e9


def rows(name: str, value: npt.ArrayLike, width: int, n: Optional[int] = None) -> Floats:
    """A float64 array of shape ``(n, width)``."""
    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(np.float64), np.nan)
    try:
        array = np.asarray(value)
    except ValueError as why:
        raise ValueError(f"{name}: no array of shape (n, {width}): {why}") from None
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name}: numbers are expected, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != width:
        turned = array.ndim == 2 and array.shape[0] == width
        hint = f"\n  help: {name}.T has that shape" if turned else ""
        raise ValueError(f"{name}: of shape {array.shape}, and (n, {width}) is needed{hint}")
    if array.shape[0] == 0:
        raise ValueError(f"{name}: empty")
    if n is not None and array.shape[0] != n:
        raise ValueError(f"{name}: {array.shape[0]} rows for {n} samples of gyr")
    return np.ascontiguousarray(array, dtype=np.float64)


def rates(gyr: npt.ArrayLike) -> Floats:
    """The samples of the gyro. A bad one is counted later; that all are bad is a wrong argument."""
    array = rows("gyr", gyr, 3)
    if not np.isfinite(array[0]).all() and not np.isfinite(array).all(axis=1).any():
        raise ValueError("gyr: no row of it is finite")
    return array


def counted(rate_hz: float, first: int, n: int) -> Nanos:
    """Stamps of samples that are counted, from 0. The period's nanoseconds and the rest apart: n of them lose nothing."""
    rate = float(rate_hz)
    if not 0.0 < rate <= 1e9:
        raise ValueError(f"rate_hz: {rate_hz} is no sample rate")
    period = 1e9 / rate
    whole = int(period)
    if (first + n) * (whole + 1) >= 2**63:
        raise ValueError(f"rate_hz: {n} samples at {rate_hz} Hz last longer than 292 years")
    i = np.arange(first, first + n, dtype=np.int64)
    if period == whole:
        return i * whole
    nanos: Nanos = i * whole + np.floor(i * (period - whole) + 0.5).astype(np.int64)
    return nanos


def stamps(t: Optional[npt.ArrayLike], rate_hz: Optional[float], n: int, first: int = 0) -> Nanos:
    """Nanoseconds of ``n`` samples: of integers, of float seconds, of datetime64; or counted."""
    if t is None and rate_hz is None:
        raise ValueError("t: needed, or rate_hz")
    if t is not None and rate_hz is not None:
        raise ValueError("rate_hz: t says when already\n  help: leave one of the two out")
    if rate_hz is not None:
        return counted(rate_hz, first, n)
    nanos = _nanos("t", t)
    if nanos.shape[0] != n:
        raise ValueError(f"t: {nanos.shape[0]} stamps for {n} samples of gyr")
    _check_order(nanos)
    return nanos


def intervals(dt: npt.ArrayLike, n: int) -> Nanos:
    """How long each sample was taken over, in nanoseconds; 0 is not known."""
    array = np.asarray(dt)
    if array.ndim == 0:
        array = np.full(n, array)
    nanos = _nanos("dt", array)
    if nanos.shape[0] != n:
        raise ValueError(f"dt: {nanos.shape[0]} of them for {n} samples of gyr")
    return nanos


def _nanos(name: str, value: Any) -> Nanos:
    try:
        array = np.asarray(value)
    except ValueError as why:
        raise ValueError(f"{name}: no array of shape (n,): {why}") from None
    if array.ndim != 1:
        raise ValueError(f"{name}: of shape {array.shape}, and (n,) is needed")
    kind = array.dtype.kind
    if kind in "mM":
        if np.isnat(array).any():
            raise ValueError(f"{name}: not a time (NaT) at {int(np.argmax(np.isnat(array)))}")
        unit = "datetime64[ns]" if kind == "M" else "timedelta64[ns]"
        nanos: Nanos = np.ascontiguousarray(array.astype(unit).view(np.int64))
        return nanos
    if kind == "u" and array.size and int(array.max()) > np.iinfo(np.int64).max:
        raise ValueError(f"{name}: {int(array.max())} ns does not fit 63 bits")
    if kind in "iu":
        return np.ascontiguousarray(array, dtype=np.int64)
    if kind != "f":
        raise ValueError(f"{name}: integer nanoseconds, float seconds or datetime64 are expected, not {array.dtype}")
    return _from_seconds(name, array)


def _from_seconds(name: str, array: npt.NDArray[Any]) -> Nanos:
    secs = np.ascontiguousarray(array, dtype=np.float64)
    if not np.isfinite(secs).all():
        at = int(np.argmax(~np.isfinite(secs)))
        raise ValueError(f"{name}: {secs[at]} at {at} is no time")
    largest = float(np.abs(secs).max()) if secs.size else 0.0
    if largest > LONGEST_SECS:
        raise ValueError(
            f"{name}: {largest:g} as float seconds is no time\n  help: nanoseconds are integers: {name}.astype('int64')"
        )
    step = float(np.spacing(np.asarray(largest, dtype=array.dtype)))
    if step > COARSE_SECS:
        warnings.warn(
            f"{name}: {array.dtype} seconds near {largest:.0f} are {step * 1e9:.0f} ns apart, and rounded to that; "
            "integer nanoseconds or datetime64[ns] are exact",
            ResolutionWarning,
            # The caller of estimate, integrate or push.
            stacklevel=6,
        )
    # Whole seconds apart from the rest: their nanoseconds are exact.
    whole = np.floor(secs)
    return whole.astype(np.int64) * 1_000_000_000 + np.rint((secs - whole) * 1e9).astype(np.int64)


def _check_order(nanos: Nanos) -> None:
    """A stamp out of order is a bad sample; an order that is none is a wrong argument."""
    if nanos.shape[0] < 3:
        return
    steps = np.diff(nanos)
    decreasing = int(np.count_nonzero(steps < 0))
    if 2 * decreasing > steps.shape[0]:
        raise ValueError(f"t: decreases at {decreasing} of {steps.shape[0]} steps")
    if not steps.any():
        raise ValueError(f"t: all {nanos.shape[0]} stamps are {int(nanos[0])} ns")


def calibration(known: Union[str, os.PathLike[str], dict[str, Any]]) -> dict[str, Any]:
    """A calibration as a dict, from a dict or a file (``docs/calibration.md``)."""
    if isinstance(known, dict):
        return known
    try:
        import tomllib
    except ImportError:
        raise ValueError("calibration: Python 3.11 reads such files\n  help: give a dict") from None
    try:
        with open(known, "rb") as file:
            found: dict[str, Any] = tomllib.load(file)
            return found
    except (OSError, TypeError, tomllib.TOMLDecodeError) as why:
        raise ValueError(f"calibration: {known}: {why}") from None

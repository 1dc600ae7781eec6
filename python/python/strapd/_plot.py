"""An attitude over time -> a picture by matplotlib: angles with the sigmas it states, or its errors against a reference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _angles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ._attitude import Attitude

#: Points of a line: more than a screen has.
POINTS = 4000
#: Colours of roll (x), pitch (y) and yaw (z), as on the page and in reports (docs/page.md, "Colours"): told apart by everybody.
COLOURS = ("#D55E00", "#009E73", "#0072B2")
#: Sigmas of the bands.
SIGMAS = 3


def _figure(figure: Optional[Figure]) -> Figure:
    if figure is not None:
        return figure
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise ImportError("plot() needs matplotlib\n  help: pip install matplotlib") from None
    new: Figure = plt.figure(figsize=(9, 6), layout="constrained")
    return new


def _unbroken(angles: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Without a line across the picture where an angle goes from 180 to -180 degrees."""
    angles = angles.copy()
    angles[1:][np.abs(np.diff(angles)) > 180] = np.nan
    return angles


def _limits(values: Any, low: Any, high: Any) -> tuple[float, float]:
    """From where to where: all of the line, and the band but for its widest moments, such as the first sample's."""
    # Where sigma is not known the line is all there is.
    low, high = (np.where(np.isfinite(band), band, values) for band in (low, high))
    lowest = min(np.nanmin(values), np.nanquantile(low, 0.03))
    highest = max(np.nanmax(values), np.nanquantile(high, 0.97))
    margin = 0.05 * max(highest - lowest, 1e-9)
    return float(lowest - margin), float(highest + margin)


def plot(
    att: Attitude,
    reference: Union[Attitude, tuple[npt.ArrayLike, npt.ArrayLike], None] = None,
    align: _angles.Align = "first-heading",
    figure: Optional[Figure] = None,
) -> Figure:
    """See :meth:`strapd.Attitude.plot`."""
    if len(att) == 0:
        raise ValueError("there is no attitude to plot")
    against = None if reference is None else _pair(reference)
    figure = _figure(figure)
    # Every so many; of errors, too: the band says what is usual, not what is worst.
    part = att[:: max(1, -(-len(att) // POINTS))]
    if against is None:
        values = _angles.roll_pitch_yaw(part.q)
        bands = _angles.sigmas_of(values, part.covariance)
        names = ["roll", "pitch", "yaw"]
        title = f"attitude, world {att.world}, body {att.body}"
    else:
        values = _angles.errors(part.t, part.q, against, align)
        bands = np.degrees(part.sigma)
        names = [f"error about {axis}" for axis in "xyz"]
        total = np.linalg.norm(values, axis=1)
        title = f"error against the reference, aligned by {align}: rms {np.sqrt(np.nanmean(total**2)):.3g} deg, at most {np.nanmax(total):.3g}"
    axes: Any = figure.subplots(3, 1, sharex=True)
    seconds = (part.t - att.t[0]) * 1e-9
    for i, (axis, name, colour) in enumerate(zip(axes, names, COLOURS)):
        middle = values[:, i] if against is None else np.zeros(len(part))
        low, high = middle - SIGMAS * bands[:, i], middle + SIGMAS * bands[:, i]
        axis.fill_between(seconds, low, high, color=colour, alpha=0.2, linewidth=0, label=f"{SIGMAS} sigma")
        line = _unbroken(values[:, i]) if against is None else values[:, i]
        axis.plot(seconds, line, color=colour, linewidth=1, label=name)
        axis.set_ylabel(f"{name}, deg")
        axis.set_ylim(*_limits(values[:, i], low, high))
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right", fontsize="small")
    axes[0].set_title(title, fontsize="medium")
    axes[-1].set_xlabel("s")
    axes[-1].set_xlim(seconds[0], max(seconds[-1], seconds[0] + 1e-9))
    return figure


def _pair(reference: Any) -> tuple[_angles.Nanos, _angles.Floats]:
    from ._compare import _track

    t, q = _track("reference", reference)
    is_there = np.isfinite(q).all(axis=1)
    return t[is_there], q[is_there]

"""Samples in arrays -> attitude."""

from __future__ import annotations

import json
import warnings
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

from . import _inputs, _strapd
from ._attitude import Attitude
from ._errors import Error, LossWarning, SmoothingWarning
from ._settings import Aid, Kind, Settings

if TYPE_CHECKING:
    from typing_extensions import Unpack


def _ready(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings as the compiled half takes them."""
    if settings.get("calibration") is not None:
        settings["calibration"] = _inputs.calibration(settings["calibration"])
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in settings.items()}


def _optional(name: str, value: Optional[npt.ArrayLike], n: int, width: int = 3) -> Optional[_inputs.Floats]:
    return None if value is None else _inputs.rows(name, value, width, n)


def loss(summary: dict[str, Any]) -> Optional[str]:
    """What was lost, in words."""
    samples, gaps = summary["samples"], summary["gaps"]
    said = []
    if samples["lost"]:
        used = ("accepted", "reordered", "restamped", "repeated", "trimmed")
        why = [f"{n} {name.replace('_', ' ')}" for name, n in samples["by_verdict"].items() if n and name not in used]
        said.append(f"lost {samples['lost']} of {samples['total']} samples ({', '.join(why)})")
    if gaps["held"] or gaps["resets"]:
        n = gaps["held"] + gaps["resets"]
        said.append(f"{n} gaps were not integrated over, {gaps['not_integrated_s']:.3f} s in all")
    return "; ".join(said) or None


def tell(what: Optional[str], strict: bool, depth: int) -> None:
    """Shouts what was lost, or raises it; who is told called so many functions ago."""
    if what is None:
        return
    if strict:
        raise Error(what, "loss")
    warnings.warn(what, LossWarning, stacklevel=depth)


def tell_smoothing(summary: dict[str, Any], depth: int) -> None:
    """Shouts where a recording was not smoothed as asked; who is told called so many functions ago."""
    for finding in summary["findings"]:
        if finding["code"] in ("not-smoothed", "smoothing"):
            warnings.warn(finding["what"], SmoothingWarning, stacklevel=depth)


def _summary(outcome: tuple[str, list[str], dict[str, Any]]) -> dict[str, Any]:
    """The summary as a replay has it, with the calibration; of flags its warnings make arguments."""
    answer, warned, calibration = outcome
    return {**json.loads(answer), "warnings": warned, "calibration": calibration}


#: Names that other libraries give ``rate_hz``.
_RATES = ("fs", "freq", "frequency", "sample_rate", "sampling_rate", "sample_rate_hz", "rate", "hz")


def _refuse_other_names(settings: dict[str, Any]) -> None:
    for name in _RATES:
        if name in settings:
            raise TypeError(f'there is no setting "{name}"\n  help: rate_hz={settings[name]!r}')


def _run(
    gyr: npt.ArrayLike,
    t: Optional[npt.ArrayLike],
    rate_hz: Optional[float],
    beside: tuple[Optional[npt.ArrayLike], Optional[npt.ArrayLike], Optional[npt.ArrayLike]],
    dt: Optional[npt.ArrayLike],
    strict: bool,
    settings: dict[str, Any],
) -> Attitude:
    rates = _inputs.rates(gyr)
    n = rates.shape[0]
    if t is None and rate_hz is None:
        _refuse_other_names(settings)
    acc, mag, orientation = beside
    columns, outcome = _strapd.estimate(
        rates,
        _inputs.stamps(t, rate_hz, n),
        _optional("acc", acc, n),
        _optional("mag", mag, n),
        _optional("orientation", orientation, n, 4),
        None if dt is None else _inputs.intervals(dt, n),
        _ready(settings),
    )
    summary = _summary(outcome)
    tell(loss(summary), strict, depth=4)
    tell_smoothing(summary, depth=4)
    return Attitude(columns, summary)


def estimate(
    gyr: npt.ArrayLike,
    acc: Optional[npt.ArrayLike] = None,
    mag: Optional[npt.ArrayLike] = None,
    t: Optional[npt.ArrayLike] = None,
    rate_hz: Optional[float] = None,
    aid: Aid = "auto",
    *,
    kind: Optional[Kind] = None,
    method: str = "auto",
    dt: Optional[npt.ArrayLike] = None,
    orientation: Optional[npt.ArrayLike] = None,
    smooth: bool = False,
    strict: bool = False,
    **settings: Unpack[Settings],
) -> Attitude:
    """Attitude of a body from its gyro, accelerometer and magnetometer: one row a sample.

    The numbers are those of ``strapd replay`` on a log of these samples, to the bit.

    :param gyr: (n, 3) rates, rad/s unless ``gyro_unit`` says otherwise; x forward, y left, z up unless ``body`` does.
        A row with NaN is a bad sample: counted, and the attitude is carried across.
    :param acc: (n, 3) specific force, m/s^2 or g (told by its length). A row with NaN is none.
    :param mag: (n, 3) magnetic field, any unit. A row with NaN is none.
    :param t: (n,) integer nanoseconds, float seconds or datetime64.
    :param rate_hz: samples a second, in place of ``t``.
    :param aid: what corrects the gyro: ``gravity``, ``gravity+mag``, ``none``; ``auto`` takes what there is.
    :param kind: what a sample means in time: the ``rate`` at its stamp, the ``average`` over the interval that ends
        there (as without it where the ordinary step is at most 20 ms; ``rate`` above), or the ``delta-angle`` turned in it; ``rotation``: the rotation vector of the whole turn in it, coning included.
    :param dt: how long each sample was taken over, as ``t``; where it is not the step between stamps.
    :param orientation: (n, 4) w, x, y, z, for ``init="first-orientation"``.
    :param smooth: the whole recording at once (``strapd replay --smooth``): better than any filter, and calibrated from
        the recording itself. What could not be smoothed as asked is a :class:`SmoothingWarning`.
    :param strict: raise :class:`Error` where samples were lost, instead of a :class:`LossWarning`.
    :param settings: see :class:`Settings`.
    :raises ValueError: an argument that cannot be, by name.
    :raises Error: the samples do not allow what is asked for.
    """
    if aid == "auto" and mag is not None:
        aid = "gravity+mag"
    if aid in ("gravity", "gravity+mag") and acc is None:
        raise ValueError(f"acc: needed for aid={aid!r}")
    if aid == "gravity+mag" and mag is None:
        raise ValueError("mag: needed for aid='gravity+mag'")
    given: dict[str, Any] = {"aid": aid, "kind": kind, "method": method, **settings}
    if smooth:
        if acc is None:
            raise ValueError("acc: needed for smooth=True")
        given["smooth"] = True
    return _run(gyr, t, rate_hz, (acc, mag, orientation), dt, strict, given)


def integrate(
    gyr: npt.ArrayLike,
    t: Optional[npt.ArrayLike] = None,
    rate_hz: Optional[float] = None,
    kind: Optional[Kind] = None,
    method: str = "auto",
    *,
    dt: Optional[npt.ArrayLike] = None,
    orientation: Optional[npt.ArrayLike] = None,
    strict: bool = False,
    covariance: bool = True,
    **settings: Unpack[Settings],
) -> Attitude:
    """Attitude from the gyro alone, relative to the first sample: :func:`estimate` with ``aid="none"``.

    :param covariance: ``False`` carries none, which is faster: the attitude has the same bits, its ``sigma`` is NaN.
    """
    given: dict[str, Any] = {"aid": "none", "kind": kind, "method": method, **settings}
    if not covariance:
        if given.get("noise") is not None:
            raise ValueError("noise: of no use with covariance=False\n  help: leave one of the two out")
        given["noise"] = "none"
    return _run(gyr, t, rate_hz, (None, None, orientation), dt, strict, given)


class Estimator(_strapd.Live):
    """Attitude of one sensor as its samples come, without latency: what ``strapd serve`` says of them.

    It begins with its first sample, level where that has a specific force, and learns the rest on the way. Late samples are
    dropped and counted. Not for several threads at once.
    """

    def __new__(
        cls,
        *,
        aid: Aid = "auto",
        kind: Optional[Kind] = None,
        method: str = "commit",
        rate_hz: Optional[float] = None,
        finals: bool = False,
        **settings: Unpack[Settings],
    ) -> Estimator:
        given: dict[str, Any] = {"aid": aid, "kind": kind, "method": method, "finals": finals, **settings}
        self = super().__new__(cls, _ready(given), rate_hz)
        self._rate_hz = rate_hz
        return self

    _rate_hz: Optional[float]

    def push(
        self,
        gyr: npt.ArrayLike,
        acc: Optional[npt.ArrayLike] = None,
        mag: Optional[npt.ArrayLike] = None,
        t: Optional[npt.ArrayLike] = None,
        dt: Optional[npt.ArrayLike] = None,
    ) -> Attitude:
        """Takes rows of samples; the attitudes that are known by then."""
        rates = _inputs.rows("gyr", gyr, 3)
        n = rates.shape[0]
        columns = self.push_rows(
            rates,
            _inputs.stamps(t, self._rate_hz, n, self.taken),
            _optional("acc", acc, n),
            _optional("mag", mag, n),
            None if dt is None else _inputs.intervals(dt, n),
        )
        return Attitude(columns, self.summary)

    def set_heading(self, heading: float) -> None:
        """Sets the heading of the next sample, degrees, as the yaw of the attitudes: ``set_heading(0)`` is a tare.

        Tilt, bias and their sigmas stay; the attitude says ``reset``.
        """
        super().set_heading(heading)

    def measure_heading(self, heading: float, sigma: float, t: Any = None) -> None:
        """Takes a heading that something else has measured: a course of GNSS, a compass, another tracker.

        :param heading: degrees, as the yaw of the attitudes; a course clockwise from north is ``90 - course`` in ENU.
        :param sigma: one standard deviation, degrees.
        :param t: its stamp on the clock of the samples, up to 3 s back; without it that of the next sample.

        Without a magnetometer the first turns the world to it; the others correct heading and bias. ``headings`` counts.
        """
        super().measure_heading(heading, sigma, t)

    @property
    def headings(self) -> dict[str, int]:
        """Measured headings so far: ``used``, ``doubted`` (beyond four sigmas), ``unpaired``, and ``turns`` of the world."""
        return dict(zip(("used", "doubted", "unpaired", "turns"), self.heading_counts()))

    def finish(self) -> Attitude:
        """No more samples: the attitudes that waited for some. The estimator is closed."""
        columns = self.finish_rows()
        return Attitude(columns, self.summary)

    @property
    def last(self) -> Optional[Attitude]:
        """The newest attitude, alone."""
        columns = self.last_rows()
        return Attitude(columns, self.summary) if len(columns["t"]) else None

    @property
    def summary(self) -> dict[str, Any]:
        """What became of the samples so far; empty before the first."""
        outcome = self.outcome()
        return {} if outcome is None else _summary(outcome)

"""Samples of a sensor as numpy arrays: read from a recorded log, or simulated with their truth."""

from __future__ import annotations

from typing import Any, Literal, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _strapd
from ._estimation import tell
from ._recordings import Path, arguments, note, place, word
from ._settings import Kind

Floats = npt.NDArray[np.float64]
Nanos = npt.NDArray[np.int64]
Motion = Literal[
    "top", "coning", "random", "walking", "running", "circling", "arm", "car", "vibration", "drone", "hand", "boat"
]

#: What :func:`read` takes: how samples are found in a log, and by which clock.
OF_READING = frozenset("field columns delimiter where ignore_covariance_flag time threads".split())


class Samples:
    """Samples of one sensor: arrays over memory of the compiled half, none copied on the way.

    ``t``
        int64 (n,), nanoseconds; ``log_t`` when each was recorded.
    ``gyr``
        float64 (n, 3): rad/s; x forward, y left, z up. NaN where a message has none.
    ``acc``
        float64 (n, 3): m/s^2 (g where the format says so little that nobody knows), or ``None``. NaN where a message has none.
    ``mag``
        float64 (m, 3): in the unit of the recording, or ``None``.
    ``acc_t``, ``mag_t``
        int64 (m,): when those were taken. ``t`` itself where they came with the rates.
    ``orientation``
        float64 (n, 4): **w, x, y, z**, body to world (z up), as the device itself had it, or ``None``.
    ``dt``
        int64 (n,), ns: what each sample was taken over, 0 where it is not said; or ``None``.
    ``kind``
        what the format says a sample means (``rate``, ``average``, ``delta-angle``, ``rotation``), or ``None``.
    ``lost``
        payloads that could not be decoded, and damaged places of the file.
    """

    topic: str
    t: Nanos
    log_t: Nanos
    gyr: Floats
    acc: Optional[Floats]
    acc_t: Nanos
    mag: Optional[Floats]
    mag_t: Nanos
    orientation: Optional[Floats]
    dt: Optional[Nanos]
    kind: Optional[Kind]
    lost: int

    def __init__(self, columns: dict[str, Any]) -> None:
        self.topic = columns.get("topic", "")
        self.t = columns["t"]
        self.log_t = columns["log_t"]
        self.gyr = columns["gyr"]
        self.acc = columns["acc"]
        self.acc_t = self.t if columns["acc_t"] is None else columns["acc_t"]
        self.mag = columns["mag"]
        self.mag_t = self.t if columns["mag_t"] is None else columns["mag_t"]
        self.orientation = columns["orientation"]
        self.dt = columns["dt"]
        self.kind = columns["kind"]
        self.lost = columns.get("lost", 0)

    def __len__(self) -> int:
        return int(self.t.shape[0])

    @property
    def t_s(self) -> Floats:
        """Seconds since the first."""
        return (self.t - self.t[:1]).astype(np.float64) * np.float64(1e-9)

    def __repr__(self) -> str:
        n = len(self)
        secs = 0.0 if n == 0 else (int(self.t[-1]) - int(self.t[0])) * 1e-9
        beside = [name for name in ("acc", "mag", "orientation", "dt") if getattr(self, name) is not None]
        return f"<strapd.{type(self).__name__}: {self.topic or 'samples'}, {n} over {secs:.3f} s; gyr{''.join(f', {name}' for name in beside)}>"


class Simulation(Samples):
    """Samples of a motion whose truth is known exactly.

    ``truth``
        stamps (m,) in ns and attitudes (m, 4), w, x, y, z, body to ENU: what :func:`compare` takes. At every instant, also where no
        sample is.
    ``truth_rate``
        float64 (m, 3): rad/s about the body axes.
    """

    truth: tuple[Nanos, Floats]
    truth_rate: Floats

    def __init__(self, columns: dict[str, Any]) -> None:
        super().__init__(columns)
        self.truth = (columns["truth_t"], columns["truth_q"])
        self.truth_rate = columns["truth_rate"]


def read(path: Path, topic: Optional[str] = None, *, strict: bool = False, **how: Any) -> Samples:
    """The samples of one topic of a recorded log: what ``strapd cat`` prints.

    :param topic: its name; needed where a log has several.
    :param strict: raise :class:`Error` where something of the log was lost, instead of a :class:`LossWarning`.
    :param how: ``time`` (``header``, ``log``, ``publish``: which stamp is ``t``), ``field``, ``columns``, ``delimiter``, ``where`` as in
        ``strapd replay``.
    """
    strange = set(how) - OF_READING
    if strange:
        raise TypeError(f"there is no argument {min(strange)!r}; there are topic, strict, {', '.join(sorted(OF_READING))}")
    words, _ = arguments({"topic": topic, **how})
    columns, said = _strapd.read(place(path), words)
    if columns["lost"]:
        tell("\n".join(said) or f"{path}: {columns['lost']} samples were lost", strict, depth=3)
    else:
        note(said)
    return Samples(columns)


def simulate(
    motion: Motion,
    *,
    rate_hz: float = 2000.0,
    duration: float = 10.0,
    seed: int = 1,
    noise: Union[str, dict[str, float], None] = None,
    kind: Kind = "rate",
    mag: Union[bool, float] = False,
    start_stamp: int = 1_700_000_000_000_000_000,
    **about: Union[str, float],
) -> Simulation:
    """Samples of a synthetic sensor whose true attitude is known exactly: ``strapd simulate``, to the bit.

    :param rate_hz: samples a second.
    :param duration: seconds from the first sample to the last.
    :param seed: of everything random; the same seed gives the same samples.
    :param noise: errors of the sensor: a class (``consumer_mems``, ``consumer_imu``, ``tactical``, ...) or figures of a data sheet,
        ``{"arw": 0.15, "bias_instability": 0.5}``; none without it.
    :param kind: what a sample is.
    :param mag: a magnetometer too, with every sample or so many times a second (48 uT, dip 60 degrees).
    :param start_stamp: of the first instant, ns.
    :param about: the motion's own numbers under the names of the command's flags: ``worn`` of ``walking`` and ``running``;
        ``half_angle_deg``, ``frequency_hz`` of ``coning``; ``rms``, ``f_max``, ``sines`` of ``random``; ``case``, ``spin_hz``,
        ``tilt_deg`` of ``top``.
    """
    for name, value, least, most in (("seed", seed, 0, 2**64 - 1), ("start_stamp", start_stamp, -(2**63), 2**63 - 1)):
        if not least <= value <= most:
            raise ValueError(f"{name}: {value} is not within {least} and {most}")
    mag_hz = None
    if mag is not False and mag is not None:
        mag_hz = rate_hz if mag is True else float(mag)
    columns = _strapd.simulate(
        motion,
        {name: word(name, value) for name, value in about.items()},
        float(rate_hz),
        float(duration),
        seed,
        "none" if noise is None else word("noise", noise),
        kind,
        mag_hz,
        start_stamp,
    )
    return Simulation(columns)

"""Settings of an estimation. Made from the library's table by ``cargo run -p strapd-attitude --example settings -- python``; a test holds it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal, Optional, TypedDict, Union

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Sequence

Vector = Union["Sequence[float]", npt.NDArray[np.float64]]
Kind = Literal["rate", "average", "delta-angle", "rotation"]
Aid = Literal["auto", "none", "gravity", "gravity+mag"]


class Settings(TypedDict, total=False):
    """What can be said of a sensor and of the run, under the names of the command's flags (``docs/settings.md``)."""

    stamps: Optional[Literal["auto", "as-recorded"]]
    window: Optional[int]
    order: Union[int, str, None]
    linear_acceleration: Optional[bool]
    accel_sign: Optional[Literal["specific", "kinematic"]]
    mag_mount: Optional[Vector]
    mag_hard_iron: Optional[float]
    declination: Optional[float]
    undo_truncation: Union[Literal["auto", "on", "off"], float, None]
    sensor_delay: Optional[float]
    gyro_unit: Optional[Literal["rad", "deg", "mrad"]]
    gyro_axes: Optional[str]
    gyro_scale: Union[float, Vector, None]
    accel_axes: Optional[str]
    accel_scale: Union[float, Vector, None]
    mag_axes: Optional[str]
    body: Optional[str]
    world: Optional[Literal["start", "level", "enu", "ned", "nwu"]]
    mount: Optional[Vector]
    init: Union[Literal["identity", "gravity", "first-orientation"], Vector, None]
    bias: Union[Literal["none", "auto"], Vector, None]
    calibration: Union[str, os.PathLike[str], dict[str, Any], None]
    max_gap: Optional[float]
    on_gap: Optional[Literal["hold", "bridge", "reset"]]
    earth_rate: Optional[float]
    regularise_stamps: Optional[bool]
    mend: Optional[bool]
    gyro_range: Optional[float]
    spikes: Optional[Literal["repair", "keep"]]
    noise: Union[str, dict[str, Any], None]
    start: Optional[float]
    until: Optional[float]


#: Names of all settings, as the functions of a log take them.
SETTINGS = frozenset(
    (
        "time",
        "rate_hz",
        "stamps",
        "method",
        "window",
        "order",
        "sample_kind",
        "aid",
        "smooth",
        "linear_acceleration",
        "accel_sign",
        "mag_mount",
        "mag_hard_iron",
        "declination",
        "undo_truncation",
        "sensor_delay",
        "gyro_unit",
        "gyro_axes",
        "gyro_scale",
        "accel_axes",
        "accel_scale",
        "mag_axes",
        "body",
        "world",
        "mount",
        "init",
        "bias",
        "calibration",
        "max_gap",
        "on_gap",
        "earth_rate",
        "regularise_stamps",
        "mend",
        "gyro_range",
        "spikes",
        "noise",
        "start",
        "until",
    )
)

#: Those that the environment may say too, with its variables.
ENVIRONMENT = {
    "time": "STRAPD_TIME",
    "stamps": "STRAPD_STAMPS",
    "method": "STRAPD_METHOD",
    "sample_kind": "STRAPD_SAMPLE_KIND",
    "aid": "STRAPD_AID",
    "undo_truncation": "STRAPD_UNDO_TRUNCATION",
    "gyro_unit": "STRAPD_GYRO_UNIT",
    "body": "STRAPD_BODY",
    "world": "STRAPD_WORLD",
}

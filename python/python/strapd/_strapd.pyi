from typing import Any, Optional

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, disjoint_base

_Floats = npt.NDArray[np.float64]
_Nanos = npt.NDArray[np.int64]
_Outcome = tuple[str, list[str], dict[str, Any]]

__all__ = ["Live", "__version__", "at", "check_log", "check_settings", "compare", "estimate", "info", "read", "relative", "replay", "simulate"]

__version__: str

def estimate(
    gyr: _Floats,
    t: _Nanos,
    acc: Optional[_Floats],
    mag: Optional[_Floats],
    orientation: Optional[_Floats],
    dt: Optional[_Nanos],
    settings: dict[str, Any],
    /,
) -> tuple[dict[str, Any], _Outcome]: ...
def at(t: _Nanos, q: _Floats, status: npt.NDArray[np.uint16], instants: _Nanos, /) -> tuple[_Floats, int, int]: ...
def compare(
    t: _Nanos,
    q: _Floats,
    world: str,
    cov: Optional[_Floats],
    ref_t: _Nanos,
    ref_q: _Floats,
    ref_world: str,
    align: str,
    /,
) -> dict[str, Any]: ...
def relative(
    t: _Nanos,
    q: _Floats,
    world: str,
    cov: Optional[_Floats],
    second_t: _Nanos,
    second_q: _Floats,
    second_world: str,
    second_cov: Optional[_Floats],
    heading: str,
    /,
) -> dict[str, Any]: ...
def check_settings(settings: dict[str, Any]) -> None: ...
def info(path: str, /) -> tuple[str, list[str]]: ...
def check_log(path: str, topic: Optional[str], /) -> tuple[str, list[str]]: ...
def replay(
    path: str, words: dict[str, list[str]], known: Optional[dict[str, Any]], /
) -> tuple[list[tuple[str, dict[str, Any]]], str, list[dict[str, Any]], list[str], list[str]]: ...
def read(path: str, words: dict[str, list[str]], /) -> tuple[dict[str, Any], list[str]]: ...
def simulate(
    motion: str,
    about: dict[str, str],
    rate_hz: float,
    duration: float,
    seed: int,
    noise: str,
    kind: str,
    mag_hz: Optional[float],
    start: int,
    /,
) -> dict[str, Any]: ...

@disjoint_base
class Live:
    def __new__(cls, settings: dict[str, Any], rate_hz: Optional[float] = None, /) -> Self: ...
    def push_one(
        self, gyr: Any, acc: Any = None, mag: Any = None, t: Any = None
    ) -> Optional[tuple[int, tuple[float, float, float, float]]]: ...
    def push_rows(
        self, gyr: _Floats, t: _Nanos, acc: Optional[_Floats], mag: Optional[_Floats], dt: Optional[_Nanos], /
    ) -> dict[str, Any]: ...
    def set_heading(self, heading: float) -> None: ...
    def measure_heading(self, heading: float, sigma: float, t: Any = None) -> None: ...
    def heading_counts(self) -> tuple[int, int, int, int]: ...
    def finish_rows(self) -> dict[str, Any]: ...
    def last_rows(self) -> dict[str, Any]: ...
    def outcome(self) -> Optional[_Outcome]: ...
    @property
    def taken(self) -> int: ...

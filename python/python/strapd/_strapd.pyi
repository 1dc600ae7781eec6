from typing import Any, Optional, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, disjoint_base

_Floats = npt.NDArray[np.float64]
_Nanos = npt.NDArray[np.int64]

__all__ = ["Live", "Written", "__version__", "check_settings", "compare", "estimate"]

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
) -> tuple[dict[str, Any], dict[str, Any]]: ...
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
def check_settings(settings: dict[str, Any]) -> None: ...

@disjoint_base
class Live:
    def __new__(cls, settings: dict[str, Any], rate_hz: Optional[float] = None, /) -> Self: ...
    def push_one(
        self, gyr: Any, acc: Any = None, mag: Any = None, t: Any = None
    ) -> Optional[tuple[int, tuple[float, float, float, float]]]: ...
    def push_rows(
        self, gyr: _Floats, t: _Nanos, acc: Optional[_Floats], mag: Optional[_Floats], dt: Optional[_Nanos], /
    ) -> dict[str, Any]: ...
    def finish_rows(self) -> dict[str, Any]: ...
    def last_rows(self) -> dict[str, Any]: ...
    def facts(self) -> Optional[dict[str, Any]]: ...
    @property
    def taken(self) -> int: ...

@final
class Written:
    def __new__(cls) -> Self: ...
    def push(self, piece: bytes) -> None: ...
    def finish(self) -> dict[str, Any]: ...

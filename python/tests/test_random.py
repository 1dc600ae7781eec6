"""Arguments nobody thought of: a result or an exception of ours, never a panic, never memory that stays."""

from __future__ import annotations

import os
import pathlib
import warnings

import numpy as np
import pytest
import strapd
from conftest import FIXTURES
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

EXAMPLES = int(os.environ.get("STRAPD_EXAMPLES", "300"))

floats = st.floats(width=64) | st.sampled_from([0.0, 1e-300, 1e300, 9.81, 1.0, -35.0, float("nan"), float("inf")])
dtypes = st.sampled_from(["f8", "f4", ">f8", "i8", "u2", "f2", "bool", "c16", "O", "U3", "M8[us]"])
stamps = st.integers(-(2**63), 2**63 - 1) | st.integers(0, 10**10)


def shape(n: int) -> st.SearchStrategy[tuple[int, ...]]:
    return st.just((n, 3)) | hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=6)


anything = st.none() | st.booleans() | st.integers() | floats | st.text(max_size=8) | st.lists(floats, max_size=5)
values = {
    "method": st.sampled_from(["auto", "magnus", "causal", "commit", "dcm-left", "coning2", "rk4", "rotvec-sum"]) | anything,
    "window": st.integers(0, 30) | anything, "order": st.sampled_from([2, 4, 6, 8, "exact"]) | anything,
    "kind": st.sampled_from(["rate", "average", "delta-angle", "rotation"]), "aid": st.sampled_from(["auto", "none", "gravity", "gravity+mag"]),
    "gyro_unit": st.sampled_from(["rad", "deg", "mrad"]) | anything, "body": st.sampled_from(["flu", "frd", "YxZ", "XXX"]) | anything,
    "world": st.sampled_from(["start", "level", "enu", "ned", "nwu"]) | anything, "mount": anything,
    "init": st.sampled_from(["identity", "gravity", "first-orientation", (0.5, 0.5, 0.5, 0.5)]) | anything,
    "bias": st.sampled_from(["none", "auto", (0.1, 0.2, 0.3)]) | anything, "max_gap": floats | anything,
    "on_gap": st.sampled_from(["hold", "bridge", "reset"]) | anything, "earth_rate": floats | anything,
    "regularise_stamps": st.booleans(), "gyro_range": floats | anything,
    "noise": st.sampled_from(["consumer", "navigation", {"arw": 1e-3}, {"arw": [1, 2, 3], "rrw": 1e300}]) | anything,
    "mag_hard_iron": floats | anything, "declination": floats | anything, "undo_truncation": st.sampled_from(["auto", "on", "off", 0.01]) | anything,
    "sensor_delay": floats | anything, "start": floats | anything, "until": floats | anything,
    "calibration": st.dictionaries(st.sampled_from(["bias", "G", "lead", "x"]), anything | st.dictionaries(st.sampled_from(["value", "sigma"]), anything), max_size=2),
    "accel_sign": st.sampled_from(["specific", "kinematic"]),
}  # fmt: skip


@st.composite
def calls(draw: st.DrawFn) -> dict[str, object]:
    n = draw(st.integers(0, 40))
    array = lambda: draw(hnp.arrays(np.float64, (n, 3), elements=floats) | hnp.arrays(draw(dtypes), draw(shape(n))))  # noqa: E731
    steps = st.lists(st.integers(-(10**8), 10**9), min_size=n, max_size=n).map(lambda steps: np.cumsum(np.array(steps, dtype=np.int64)))
    call: dict[str, object] = {"gyr": array()}
    call["t"] = draw(steps | st.lists(stamps, min_size=n, max_size=n) | hnp.arrays(draw(dtypes), (n,)) | st.none())
    if draw(st.booleans()):
        call["rate_hz"] = draw(floats)
    for name in ("acc", "mag", "dt", "orientation"):
        if draw(st.booleans()):
            call[name] = array()
    for name in draw(st.lists(st.sampled_from(sorted(values)), max_size=4, unique=True)):
        call[name] = draw(values[name])
    return call


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck), database=None)
@given(calls())
def test_arguments_nobody_thought_of(call: dict[str, object]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = strapd.estimate(**call)
        except (ValueError, TypeError, OverflowError, strapd.Error) as refused:
            # A panic of the compiled half is a BaseException of its own.
            assert "panicked" not in str(refused)
            return
    assert found.q.shape == (len(found), 4) and np.isfinite(found.q).all()
    assert np.abs(np.linalg.norm(found.q, axis=1) - 1).max(initial=0) < 1e-9
    assert found.summary["samples"]["total"] == len(np.asarray(call["gyr"]))


ALLOWED = (ValueError, TypeError, OverflowError, strapd.Error)


@settings(max_examples=max(EXAMPLES // 3, 50), deadline=None, database=None)
@given(st.dictionaries(st.sampled_from(sorted(values)), anything, max_size=2), st.data())
def test_flags_nobody_thought_of(flags: dict[str, object], data: st.DataObject) -> None:
    for name in data.draw(st.lists(st.sampled_from(sorted(values)), max_size=3, unique=True)):
        flags[name] = data.draw(values[name])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = strapd.replay(FIXTURES / "constant_rate.mcap", threads=1, **flags)
        except ALLOWED as refused:
            assert "panicked" not in str(refused)
            return
    assert isinstance(found, strapd.Attitude) and np.isfinite(found.q).all()


@settings(max_examples=max(EXAMPLES // 10, 20), deadline=None, database=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.tuples(st.integers(0, 18_280), st.binary(min_size=1, max_size=8)), max_size=4), st.integers(0, 18_281), st.sampled_from([".mcap", ".bag", ".csv"]))
def test_logs_that_nobody_wrote(tmp_path: pathlib.Path, changes: list[tuple[int, bytes]], length: int, ending: str) -> None:
    raw = bytearray((FIXTURES / "constant_rate_ros1.mcap").read_bytes())
    for at, piece in changes:
        raw[at : at + len(piece)] = piece
    log = tmp_path / f"log{ending}"
    log.write_bytes(bytes(raw[:length]) if length % 3 else bytes(raw))
    for look in (strapd.replay, strapd.read, strapd.open, strapd.check):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                look(log)
            except ALLOWED as refused:
                assert "panicked" not in str(refused)


def test_memory_does_not_stay() -> None:
    gyr = np.tile([0.1, 0.2, 0.3], (100_000, 1))

    def resident() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    for _ in range(5):
        strapd.integrate(gyr, rate_hz=1000.0)
    before = resident()
    for _ in range(40):
        strapd.integrate(gyr, rate_hz=1000.0)
        with pytest.raises(strapd.Error):
            strapd.integrate(gyr[:600], rate_hz=1000.0, init="first-orientation")
    # A run's columns are 13 MB: one kept each time would be 500.
    assert resident() - before < 40_000_000

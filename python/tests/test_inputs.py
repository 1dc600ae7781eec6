"""An argument that cannot be is a ValueError that names it; what can be taken without a copy is."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import strapd
from conftest import same_bits, turning
from strapd import _inputs

T, GYR, ACC = turning(200)


@pytest.mark.parametrize(
    "said, arguments",
    [
        ("gyr: of shape (3, 200)", {"gyr": GYR.T, "t": T}),
        ("help: gyr.T has that shape", {"gyr": GYR.T, "t": T}),
        ("gyr: of shape (200,)", {"gyr": GYR[:, 0], "t": T}),
        ("gyr: of shape (200, 4)", {"gyr": np.zeros((200, 4)), "t": T}),
        ("gyr: of shape ()", {"gyr": 1.0, "t": T}),
        ("gyr: empty", {"gyr": np.zeros((0, 3)), "t": T[:0]}),
        ("gyr: numbers are expected, not <U1", {"gyr": [["a"] * 3], "t": [0]}),
        ("gyr: numbers are expected, not complex128", {"gyr": GYR + 0j, "t": T}),
        ("gyr: numbers are expected, not bool", {"gyr": GYR > 0, "t": T}),
        ("gyr: numbers are expected, not object", {"gyr": GYR.astype(object), "t": T}),
        ("gyr: no array of shape (n, 3)", {"gyr": [[1, 2, 3], [1, 2]], "t": [0, 1]}),
        ("gyr: no row of it is finite", {"gyr": GYR * np.nan, "t": T}),
        ("t: needed, or rate_hz", {"gyr": GYR}),
        ("rate_hz: t says when already", {"gyr": GYR, "t": T, "rate_hz": 100}),
        ("rate_hz: 0 is no sample rate", {"gyr": GYR, "rate_hz": 0}),
        ("rate_hz: nan is no sample rate", {"gyr": GYR, "rate_hz": float("nan")}),
        ("rate_hz: 200 samples at 1e-17 Hz last longer", {"gyr": GYR, "rate_hz": 1e-17}),
        ("t: 199 stamps for 200 samples", {"gyr": GYR, "t": T[:-1]}),
        ("t: of shape (200, 1)", {"gyr": GYR, "t": T[:, None]}),
        ("t: decreases at 199 of 199 steps", {"gyr": GYR, "t": T[::-1]}),
        ("t: all 200 stamps are 7 ns", {"gyr": GYR, "t": np.full(200, 7)}),
        ("t: nan at 3 is no time", {"gyr": GYR, "t": np.where(T == T[3], np.nan, T * 1e-9)}),
        ("t: inf at 0 is no time", {"gyr": GYR, "t": np.full(200, np.inf)}),
        ("help: nanoseconds are integers", {"gyr": GYR, "t": T.astype(float) + 1.7e18}),
        ("t: not a time (NaT) at 0", {"gyr": GYR, "t": np.full(200, "NaT", dtype="datetime64[ns]")}),
        ("t: 18446744073709551615 ns does not fit", {"gyr": GYR, "t": np.full(200, 2**64 - 1, dtype=np.uint64)}),
        ("t: integer nanoseconds, float seconds or datetime64 are expected, not <U2", {"gyr": GYR, "t": ["10"] * 200}),
        ("acc: 199 rows for 200 samples of gyr", {"gyr": GYR, "acc": ACC[:-1], "t": T}),
        ("acc: of shape (3, 200)", {"gyr": GYR, "acc": ACC.T, "t": T}),
        ("acc: needed for aid='gravity+mag'", {"gyr": GYR, "mag": ACC, "t": T}),
        ("acc: needed for aid='gravity'", {"gyr": GYR, "aid": "gravity", "t": T}),
        ("mag: needed for aid='gravity+mag'", {"gyr": GYR, "acc": ACC, "aid": "gravity+mag", "t": T}),
        ("mag: 2 rows for 200", {"gyr": GYR, "acc": ACC, "mag": ACC[:2], "t": T}),
        ("dt: 3 of them", {"gyr": GYR, "t": T, "dt": [1, 2, 3]}),
        ("orientation: of shape (200, 3)", {"gyr": GYR, "t": T, "orientation": ACC}),
        ("aid: there is no \"magic\"", {"gyr": GYR, "t": T, "aid": "magic"}),
        ("kind: there is no \"mean\"", {"gyr": GYR, "t": T, "kind": "mean"}),
        ("method: there is no \"best\"", {"gyr": GYR, "t": T, "method": "best"}),
        ("window and order belong to method magnus", {"gyr": GYR, "t": T, "window": 4}),
        ("window -1: expected a number of samples", {"gyr": GYR, "t": T, "method": "magnus", "window": -1}),
        ("order: there is no \"3\"", {"gyr": GYR, "t": T, "method": "magnus", "order": 3}),
        ("world: ", {"gyr": GYR, "t": T, "world": "moon"}),
        ("body: ", {"gyr": GYR, "t": T, "body": "XXY"}),
        ("init 1,2,3: expected identity, gravity, first-orientation, or 4 numbers q=w,x,y,z", {"gyr": GYR, "t": T, "init": [1, 2, 3]}),
        ("init q=1,2,3,4: a unit quaternion w,x,y,z", {"gyr": GYR, "t": T, "init": [1, 2, 3, 4]}),
        ("init level: expected identity, gravity", {"gyr": GYR, "t": T, "init": "level"}),
        ("init NaN,NaN,NaN,NaN: expected identity", {"gyr": GYR, "t": T, "init": [np.nan] * 4}),
        ("bias some: expected none, auto, or 3 numbers x,y,z in rad/s", {"gyr": GYR, "t": T, "bias": "some"}),
        ("bias 1,2: expected none, auto, or 3 numbers", {"gyr": GYR, "t": T, "bias": [1, 2]}),
        ("max_gap", {"gyr": GYR, "t": T, "max_gap": -1}),
        ("max_gap x: expected a number from 0 to 86400 in s", {"gyr": GYR, "t": T, "max_gap": "x"}),
        ("sensor_delay: 3 s is no delay of a sensor", {"gyr": GYR, "t": T, "sensor_delay": 3.0}),
        ("earth_rate: in world start", {"gyr": GYR, "t": T, "earth_rate": 48.0}),
        ("mag_hard_iron: no magnetic field is used", {"gyr": GYR, "t": T, "mag_hard_iron": 0.1}),
        ("noise loud: `loud` is no class", {"gyr": GYR, "t": T, "noise": "loud"}),
        ("noise: arw is missing", {"gyr": GYR, "t": T, "noise": {"rrw": 1}}),
        ("noise: arw is a number from 0 up, in deg/sqrt(h)", {"gyr": GYR, "t": T, "noise": {"arw": -1}}),
        ("undo_truncation on=2: a step in rad/s above 0 and below 1", {"gyr": GYR, "t": T, "undo_truncation": 2.0}),
        ("calibration: there is no 'x'", {"gyr": GYR, "t": T, "calibration": {"x": 1}}),
        ("calibration: 'G' has not 9 values", {"gyr": GYR, "t": T, "calibration": {"G": [1, 2, 3]}}),
        ("calibration: `bias`: 99 is no error of a sensor", {"gyr": GYR, "t": T, "calibration": {"bias": [99, 0, 0]}}),
        ("calibration: /nowhere.toml", {"gyr": GYR, "t": T, "calibration": "/nowhere.toml"}),
        ("regularise_stamps yes: expected true or false", {"gyr": GYR, "t": T, "regularise_stamps": "yes"}),
        ("t: 1 stamps for 200", {"gyr": GYR, "t": [0]}),
    ],
)
def test_what_can_not_be_is_refused_by_name(said: str, arguments: dict[str, object]) -> None:
    with pytest.raises(ValueError) as error:
        strapd.estimate(**arguments)
    assert said in str(error.value), str(error.value)
    assert "--" not in str(error.value), "flags are the command's"


def test_a_setting_that_is_none_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="there is no setting \"colour\""):
        strapd.estimate(GYR, t=T, colour=1)
    # Names that other libraries have, in place of stamps.
    for name in ("fs", "freq", "sample_rate"):
        with pytest.raises(TypeError, match=f'there is no setting "{name}"\n  help: rate_hz=100.0'):
            strapd.estimate(GYR, **{name: 100.0})


def test_what_these_samples_do_not_allow_is_an_error_of_its_kind() -> None:
    with pytest.raises(strapd.Error, match="bias auto") as error:
        strapd.integrate(GYR, t=T, bias="auto")
    assert error.value.kind == "refused" and "--" not in str(error.value)


@pytest.mark.parametrize("value", [GYR.astype(np.float32), np.asfortranarray(GYR), GYR[::-1][::-1], GYR.astype(">f8"), GYR.tolist(), np.ma.masked_array(GYR)])
def test_any_layout_of_numbers_is_converted(value: object) -> None:
    found = strapd.integrate(value, t=T)
    same_bits(found.q, strapd.integrate(np.ascontiguousarray(value, dtype=np.float64), t=T).q)


def test_what_is_float64_and_contiguous_is_not_copied() -> None:
    assert np.shares_memory(_inputs.rows("gyr", GYR, 3), GYR)
    assert np.shares_memory(_inputs.stamps(T, None, len(T)), T)
    assert np.shares_memory(_inputs.rows("gyr", GYR[50:90], 3), GYR), "a part of the rows"
    read_only = GYR.copy()
    read_only.flags.writeable = False
    assert np.shares_memory(_inputs.rows("gyr", read_only, 3), read_only)
    before = GYR.copy()
    strapd.integrate(read_only, t=T)
    assert (read_only == before).all()


def test_masked_rows_are_bad_samples() -> None:
    masked = np.ma.masked_array(GYR, mask=np.zeros_like(GYR, dtype=bool))
    masked[7, 1] = np.ma.masked
    with pytest.warns(strapd.LossWarning, match="lost 1 of 200 samples \\(1 not finite\\)"):
        assert strapd.integrate(masked, t=T).lost == 1


def test_times_of_every_kind_are_the_same_nanoseconds() -> None:
    for t in [T * 1e-9, T.astype("datetime64[ns]"), T.astype("timedelta64[ns]"), T.tolist(), T.astype(np.uint64)]:
        same_bits(strapd.integrate(GYR, t=t).t, T)
    micros = (T // 1000).astype("datetime64[us]")
    same_bits(strapd.integrate(GYR, t=micros).t, T)
    same_bits(_inputs.stamps(np.array([-1.5, -0.25, 0.0]), None, 3), np.array([-1_500_000_000, -250_000_000, 0]))


def test_float_seconds_since_1970_say_their_resolution() -> None:
    now = 1_700_000_000
    with pytest.warns(strapd.ResolutionWarning, match="t: float64 seconds near 1700000002 are 238 ns apart") as told:
        found = strapd.integrate(GYR, t=T * 1e-9 + now)
    assert told[0].filename == __file__, "it points at who called"
    assert np.abs(found.t - (T + now * 10**9)).max() <= 119
    with pytest.warns(strapd.ResolutionWarning, match="float32 seconds near 2 are"):
        strapd.integrate(GYR, t=(T * 1e-9).astype(np.float32))


def test_bad_samples_are_counted_and_shouted() -> None:
    gyr = GYR.copy()
    gyr[20, 0], gyr[30, 2], gyr[40, 1] = np.nan, np.inf, 1e9
    with pytest.warns(strapd.LossWarning, match="lost 3 of 200 samples \\(1 huge, 2 not finite\\)") as told:
        found = strapd.estimate(gyr, ACC, t=T)
    assert told[0].filename == __file__
    assert found.lost == 3 and len(found) == 197 and np.isfinite(found.q).all()
    assert found.flags("rejected-before").sum() == 3
    with pytest.raises(strapd.Error, match="lost 3 of 200") as error:
        strapd.estimate(gyr, ACC, t=T, strict=True)
    assert error.value.kind == "loss"
    late = T.copy()
    late[100] = late[20]
    with pytest.warns(strapd.LossWarning, match="late|duplicate"):
        strapd.integrate(GYR, t=late)
    gap = T + np.where(np.arange(200) >= 100, 3_000_000_000, 0)
    with pytest.warns(strapd.LossWarning, match="1 gaps were not integrated over, 3.0"):
        held = strapd.integrate(GYR, t=gap)
    assert held.gaps["held"] == 1 and held.lost == 0 and held.flags("held").sum() == 1


def test_a_force_or_field_with_nan_is_none() -> None:
    acc = ACC.copy()
    acc[10:20] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = strapd.estimate(GYR * 0.01, acc, t=T)
    assert found.lost == 0 and len(found) == 200 and found.summary["aid"]["by"] == "gravity"


def test_one_sample_is_an_attitude() -> None:
    assert len(strapd.estimate(GYR[:1], ACC[:1], t=T[1:2])) == 1
    assert strapd.integrate(GYR[:2], rate_hz=10).t.tolist() == [0, 100_000_000]


def test_a_smoother_needs_forces() -> None:
    with pytest.raises(ValueError, match="acc"):
        strapd.estimate(GYR, t=T, smooth=True)
    with pytest.raises(ValueError, match="aid none"):
        strapd.estimate(GYR, ACC, t=T, smooth=True, aid="none")

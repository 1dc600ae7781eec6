"""Samples as arrays: out of logs as `strapd cat` prints them, out of motions as `strapd simulate` writes them."""

from __future__ import annotations

import json
import pathlib
import warnings

import numpy as np
import pytest
import strapd
from conftest import FIXTURES, LOGS, Recorded, same_bits, say


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_a_log_is_read_as_cat_prints_it(command: str, path: pathlib.Path) -> None:
    recorded = Recorded(command, path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", strapd.LossWarning)
        found = strapd.open(path).read()
    same_bits(found.t, recorded.t)
    same_bits(found.gyr, recorded.gyr)
    for ours, theirs in ((found.acc, recorded.acc), (found.orientation, recorded.orientation)):
        if ours is None:
            assert np.isnan(theirs).all()
        else:
            np.testing.assert_array_equal(ours, theirs)
    assert found.kind == recorded.kind and len(found) == len(recorded.t)
    assert (np.zeros(len(found), np.int64) if found.dt is None else found.dt).tolist() == recorded.dt.tolist()


def test_what_is_read_is_estimated_to_the_bits_of_a_replay() -> None:
    found = strapd.read(FIXTURES / "xsens_mti.mcap")
    same_bits(strapd.estimate(found.gyr, found.acc, t=found.t).q, strapd.replay(FIXTURES / "xsens_mti.mcap").q)


def test_arrays_are_over_the_memory_they_were_read_into() -> None:
    found = strapd.read(FIXTURES / "xsens_mti.mcap")
    for array in (found.t, found.gyr, found.acc, found.orientation):
        assert array is not None and array.flags.c_contiguous and array.flags.aligned
        owner = array
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        assert not owner.flags.owndata


def test_a_magnetometer_of_its_own_topic_has_stamps_of_its_own() -> None:
    found = strapd.read(FIXTURES / "xsens_mti.mcap")
    assert found.topic == "/imu/data" and found.mag is not None and found.mag.shape == (953, 3) and found.mag_t.shape == (953,)
    assert found.mag_t is not found.t and found.acc_t is found.t
    assert 0.2 < np.linalg.norm(found.mag, axis=1).mean() < 2 and (np.diff(found.mag_t) > 0).all()


def test_other_clocks_are_asked_for() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", strapd.LossWarning)
        header, log = (strapd.read(FIXTURES / "faults.mcap", time=time) for time in ("header", "log"))
    assert (header.log_t == log.t).all() and (header.t != log.t).any() and len(header) == len(log)
    with pytest.raises(ValueError, match="time: there is no .clock"):
        strapd.read(FIXTURES / "ximu3.mcap", time="clock")


def test_what_is_lost_of_a_log_is_shouted(tmp_path: pathlib.Path) -> None:
    with pytest.warns(strapd.LossWarning, match="could not be decoded") as told:
        found = strapd.read(FIXTURES / "faults.mcap")
    assert told[0].filename == __file__ and found.lost > 0
    with pytest.raises(strapd.Error) as error:
        strapd.read(FIXTURES / "faults.mcap", strict=True)
    assert error.value.kind == "loss"
    with pytest.raises(strapd.Error, match="no topic"):
        strapd.read(FIXTURES / "faults.mcap", "/nothing")
    with pytest.raises(TypeError, match="there is no argument .aid"):
        strapd.read(FIXTURES / "faults.mcap", aid="none")


@pytest.mark.parametrize(
    "motion, flags, arguments",
    [
        ("top", ["--case=looping"], {"case": "looping"}),
        ("top", ["--spin-hz=12", "--tilt-deg=30"], {"spin_hz": 12, "tilt_deg": 30}),
        ("coning", ["--half-angle-deg=2.5", "--sample-kind=average"], {"half_angle_deg": 2.5, "kind": "average"}),
        ("random", ["--rms=0.5", "--f-max=3", "--sines=7", "--seed=9"], {"rms": 0.5, "f_max": 3, "sines": 7, "seed": 9}),
        ("walking", ["--worn=foot", "--noise=consumer_imu", "--mag=25"], {"worn": "foot", "noise": "consumer_imu", "mag": 25}),
        (
            "hand",
            ["--noise=arw=0.15,bias-instability=0.5", "--mag", "--sample-kind=delta-angle"],
            {"noise": {"arw": 0.15, "bias_instability": 0.5}, "mag": True, "kind": "delta-angle"},
        ),
        ("boat", ["--start-stamp=1.5"], {"start_stamp": 1_500_000_000}),
    ],
)
def test_a_simulation_has_the_bits_of_the_commands(
    command: str, tmp_path: pathlib.Path, motion: str, flags: list[str], arguments: dict[str, object]
) -> None:
    out = tmp_path / "simulated.ndjson"
    # The first three seconds of what is carried are a rest.
    say(command, "simulate", motion, *flags, "--rate-hz=100", "--duration=9", "--quiet", "-o", out)
    found = strapd.simulate(motion, rate_hz=100, duration=9, **arguments)
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    rates = [line for line in lines if "gyro" in line]
    truths = [line for line in lines if line["id"] == "truth"]
    nanos = lambda lines: [line["stamp"]["sec"] * 10**9 + line["stamp"]["nsec"] for line in lines]  # noqa: E731
    assert nanos(rates) == found.t.tolist()
    assert [line["gyro"] for line in rates] == found.gyr.tolist() and [line["accel"] for line in rates] == found.acc.tolist()
    if found.mag is None:
        assert not any("mag" in line for line in rates)
    else:
        assert [line.get("mag") for line in rates] == [None if np.isnan(row).any() else row.tolist() for row in found.mag]
    t, q = found.truth
    assert nanos(truths) == t.tolist()
    assert [[line["q"][axis] for axis in "wxyz"] for line in truths] == q.tolist()


def test_truth_is_what_a_comparison_takes() -> None:
    top = strapd.simulate("top", rate_hz=2000, duration=2)
    start = top.truth[1][0]
    found = strapd.compare(strapd.integrate(top.gyr, t=top.t, kind=top.kind, init=start), top.truth, align="none")
    # The floor of the integrator, docs/accuracy.md.
    assert found["total"]["max_deg"] < 1e-10 and found["samples"] == 4001
    assert top.orientation is None and np.allclose(top.truth_rate, top.gyr)


@pytest.mark.parametrize(
    "motion, arguments, said",
    [
        ("flying", {}, "motion: there is no .flying"),
        ("coning", {"worn": "foot"}, "worn: the motion .coning. has no such thing"),
        ("walking", {"worn": "head"}, "worn: there is no .head"),
        ("random", {"sines": 0}, "sines: 0 or more"),
        ("random", {"rms": "much"}, "rms: .much. is no number"),
        ("boat", {"noise": "loud"}, "noise: loud"),
        ("boat", {"kind": "sum"}, "kind: there is no .sum"),
        ("boat", {"rate_hz": float("nan")}, "sample rate"),
        ("boat", {"rate_hz": 1e6, "duration": 1e9}, "are more than 100000000"),
        ("boat", {"duration": -1.0}, "duration"),
        ("boat", {"seed": -1}, "seed: -1"),
        ("boat", {"start_stamp": 2**63}, "start_stamp: "),
        ("boat", {"start_stamp": 2**63 - 1}, "help: an earlier start_stamp"),
        ("top", {"rate_hz": 10.0}, "help: rate_hz above"),
    ],
)
def test_what_can_not_be_simulated_is_a_value_error(motion: str, arguments: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        strapd.simulate(motion, **arguments)

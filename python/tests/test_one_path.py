"""Samples of a recording, through `estimate`, give what `replay` of the recording gives: attitude to the bit, and words."""

from __future__ import annotations

import functools
import pathlib
import warnings
from typing import Any, Union

import numpy as np
import pytest
import strapd
from conftest import FIXTURES, SHARED, same_bits, say

#: Every recording, whatever its format.
FILES = [path for path in sorted(FIXTURES.iterdir()) if path.suffix not in (".md", "") and not path.name.endswith("-wal")]

SETTINGS: list[dict[str, Any]] = [
    {},
    {"aid": "none"},
    {"aid": "gravity"},
    *({"aid": aid, "kind": kind} for aid in ("none", "gravity") for kind in ("rate", "average", "delta-angle", "rotation")),
    {"bias": "auto"},
    {"aid": "none", "bias": "auto", "init": "gravity"},
    {"method": "commit"},
    {"aid": "none", "method": "commit"},
    {"aid": "none", "method": "magnus", "window": 8, "order": 6},
    {"aid": "none", "method": "causal"},
    {"aid": "none", "method": "dcm-left", "world": "ned"},
    {"aid": "none", "undo_truncation": "auto"},
    {"undo_truncation": "off", "noise": "uncalibrated"},
    {"smooth": True},
    {"smooth": True, "kind": "rate"},
    {"smooth": True, "kind": "average", "bias": "auto"},
    {"smooth": True, "aid": "gravity", "undo_truncation": "on"},
]

#: What a replay says of the file, and arrays have not.
OF_THE_FILE = {"topic", "output_topic", "decoded_as", "input_axes", "first_losses", "left_out", "samples", "clock", "calibration", "file_problems"}


@functools.cache
def samples(path: pathlib.Path, topic: str, clock: str) -> strapd.Samples:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", strapd.LossWarning)
        return strapd.read(path, topic, time=clock)


@functools.cache
def topics(path: pathlib.Path) -> list[str]:
    return [imu["topic"] for imu in strapd.open(path).info["imu"]]


Run = Union[tuple[strapd.Attitude, list[str]], str]


def run(what: Any, *arguments: Any, **settings: Any) -> Run:
    """The attitude and what was warned of how it was smoothed; or why there is none, without its help."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            found = what(*arguments, **settings)
        except (strapd.Error, ValueError) as error:
            return str(error)
    return found, [str(one.message) for one in said if one.category is strapd.SmoothingWarning]


def same(ours: Run, theirs: Run) -> None:
    if isinstance(ours, str) or isinstance(theirs, str):
        # Neither has one; the words name other things.
        assert isinstance(ours, str) and isinstance(theirs, str), (ours, theirs)
        return
    (att, said), (replayed, their_words) = ours, theirs
    for name in ("t", "q", "rate", "_cov", "bias"):
        same_bits(getattr(att, name), getattr(replayed, name))
    # A message that cannot be decoded is no row of an array.
    seen = ~np.uint16(strapd.STATUS_BITS["rejected-before"])
    assert (att.reset == replayed.reset).all() and (att.status & seen == replayed.status & seen).all()
    assert att.smoothing == replayed.smoothing and said == their_words
    facts, others = att.summary, replayed.summary
    for name in set(others) - OF_THE_FILE - {"warnings", "findings", "recorded", "against_recorded"}:
        # What the recording states is handed on by whoever calls.
        handed_on = name == "sample_kind_by" and (facts[name], others[name]) == ("setting", "recording")
        assert handed_on or facts[name] == others[name], name
    codes = lambda summary: [f["code"] for f in summary["findings"] if f["code"] in ("smoothing", "not-smoothed", "beyond-class")]  # noqa: E731
    assert codes(facts) == codes(others)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_what_is_read_gives_what_is_replayed(path: pathlib.Path, settings: dict[str, Any]) -> None:
    for topic in topics(path):
        replayed = run(strapd.replay, path, topic=topic, **settings)
        clock = "header" if isinstance(replayed, str) else replayed[0].summary["clock"]
        read = samples(path, topic, clock)
        if read.acc is not None and read.acc_t is not read.t:
            # Forces with stamps of their own are no argument of `estimate`.
            continue
        ours = run(strapd.estimate, read.gyr, read.acc, t=read.t, dt=read.dt, orientation=read.orientation, **{"kind": read.kind, **settings})
        same(ours, replayed)


def cut() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sensor whose driver casts its rates to whole steps."""
    walk = strapd.simulate("walking", rate_hz=100, duration=60, noise="consumer,truncation=0.1", seed=3)
    assert walk.acc is not None
    return walk.t, walk.gyr, walk.acc


@pytest.mark.parametrize("settings", [{}, {"smooth": True}, {"bias": "auto"}, {"aid": "none", "undo_truncation": "on"}, {"method": "commit"}], ids=str)
@pytest.mark.parametrize("form", ["csv", "ndjson"])
def test_rates_that_a_driver_cut_are_mended_in_a_table_as_in_arrays(tmp_path: pathlib.Path, form: str, settings: dict[str, Any]) -> None:
    t, gyr, acc = cut()
    path = tmp_path / f"cut.{form}"
    rows = zip(t.tolist(), gyr.tolist(), acc.tolist())
    if form == "csv":
        lines = ["stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z", *(",".join(map(repr, [at, *w, *f])) for at, w, f in rows)]
    else:
        lines = [f'{{"stamp_ns":{at},"gyro":{w},"accel":{f}}}' for at, w, f in rows]
    path.write_text("\n".join(lines) + "\n")
    replayed = run(strapd.replay, path, **settings)
    ours = run(strapd.estimate, gyr, acc, t=t, **settings)
    same(ours, replayed)
    assert not isinstance(replayed, str) and not isinstance(ours, str)
    # Otherwise this test shows nothing.
    assert all("the driver cut the rates" in " ".join(att.warnings) for att in (ours[0], replayed[0]))


def fields(walk: strapd.Simulation, bent: float) -> np.ndarray:
    """Its field, beside iron that comes and goes."""
    assert walk.mag is not None
    return walk.mag + bent * np.sin(walk.t_s[:, None] * [0.9, 1.7, 2.3]) * np.linalg.norm(walk.mag[0])


def test_what_could_not_be_smoothed_as_asked_is_said_as_by_the_command(command: str, tmp_path: pathlib.Path) -> None:
    car = strapd.simulate("car", noise="consumer", rate_hz=100, duration=120, seed=1)
    hand = strapd.simulate("hand", noise="consumer_imu", rate_hz=100, duration=40, seed=5, mag=True)
    random = np.random.default_rng(7)
    forces = random.normal(size=hand.gyr.shape)
    forces *= 9.81 / np.linalg.norm(forces, axis=1, keepdims=True)
    outcomes = set()
    for name, gyr, acc, mag, t in [
        ("hand", hand.gyr, hand.acc, None, hand.t),
        ("car", car.gyr, car.acc, None, car.t),
        ("any force", hand.gyr, forces, None, hand.t),
        ("iron", hand.gyr, hand.acc, fields(hand, 3.0), hand.t),
        ("much iron", hand.gyr, hand.acc, fields(hand, 30.0), hand.t),
    ]:
        path = tmp_path / "log.ndjson"
        with path.open("w") as file:
            for i in range(len(t)):
                more = "" if mag is None else f',"mag":{mag[i].tolist()}'
                file.write(f'{{"stamp_ns":{t[i]},"gyro":{gyr[i].tolist()},"accel":{acc[i].tolist()}{more}}}\n')
        settings = {"smooth": True, "aid": "gravity" if mag is None else "gravity+mag"}
        ours, replayed = run(strapd.estimate, gyr, acc, mag, t=t, **settings), run(strapd.replay, path, **settings)
        same(ours, replayed)
        assert not isinstance(ours, str) and not isinstance(replayed, str), (name, ours)
        att, said = ours
        outcomes.add(att.smoothing)
        text = say(command, "replay", path, "--smooth", f"--aid={settings['aid']}", "-o", "null:", "--json", "--quiet")
        assert f'"outcome":"{att.smoothing}"' in text.replace(" ", ""), name
        assert bool(said) == (att.smoothing != "converged"), name
        if att.smoothing == "filter":
            assert "NOT SMOOTHED" in said[0] and "NOT SMOOTHED" in repr(att) and "NOT SMOOTHED" in " ".join(att.warnings)
            filtered = strapd.estimate(gyr, acc, mag, t=t, aid=settings["aid"])
            same_bits(att.q, filtered.q)
            same_bits(att.bias, filtered.bias)
    assert "converged" in outcomes and outcomes - {"converged"}, outcomes


def test_a_bias_that_nothing_tells_is_said_of_a_filter_and_of_a_smoother() -> None:
    # Upright at 1 m/s, never at rest: the force towards the middle and nothing else.
    t = np.arange(0.0, 60.0, 0.01)
    rate = 0.6 * np.sin(0.7 * t) + 0.4 * np.sin(1.9 * t + 1.0)
    gyr = np.column_stack([0.001 * np.sin(31.0 * t), 0.001 * np.cos(29.0 * t), rate])
    acc = np.column_stack([np.zeros_like(t), rate, np.full_like(t, 9.81)])
    for smooth in (False, True):
        att = strapd.estimate(gyr, acc, rate_hz=100.0, smooth=smooth)
        assert att.bias_unobserved and "bias not observed" in repr(att), (smooth, att)
    live = strapd.Estimator(rate_hz=100.0)
    live.push(gyr, acc)
    assert live.summary["aid"]["bias_unobserved"]
    hand = strapd.simulate("hand", noise="consumer_imu", rate_hz=100, duration=30, seed=5)
    assert not strapd.estimate(hand.gyr, hand.acc, t=hand.t).bias_unobserved


def test_the_bias_of_a_smoothed_recording_is_the_smoothers() -> None:
    hand = strapd.simulate("hand", noise="consumer_imu", rate_hz=100, duration=90, seed=5)
    smoothed = strapd.estimate(hand.gyr, hand.acc, t=hand.t, smooth=True)
    filtered = strapd.estimate(hand.gyr, hand.acc, t=hand.t)
    assert smoothed.smoothing == "converged" and filtered.smoothing is None and "smoothed" in repr(smoothed)
    assert smoothed.bias_sigma is not None and smoothed.calibration is not None
    # As it is saved (flu, no calibration before: the sensor's own axes), which is the smoother's at the end.
    known = smoothed.calibration["bias"]
    np.testing.assert_allclose(smoothed.bias, known["value"], rtol=1e-3)
    # The filter's is another, and has its own place.
    assert np.abs(smoothed.bias - filtered.bias).max() > 1e-6
    learned = smoothed.summary["aid"]["learned"]["gyro_bias_rad_s"]
    assert np.abs(smoothed.bias - learned).max() > 1e-6


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs ../shared (optional recordings)")
def test_recordings_of_other_makers_are_on_the_one_path() -> None:
    held = 0
    for path in sorted(path for folder in ("real", "native") for path in (SHARED / "logs" / folder).iterdir()):
        try:
            named = topics(path)
        except strapd.Error:
            continue
        for settings in ({"until": 20.0}, {"until": 20.0, "smooth": True}):
            for topic in named[:1]:
                replayed = run(strapd.replay, path, topic=topic, **settings)
                clock = "header" if isinstance(replayed, str) else replayed[0].summary["clock"]
                read = samples(path, topic, clock)
                # The unit of a single force, which nothing confirms, is known from its message alone.
                if read.acc is not None and read.acc_t is read.t and len(read) > 1:
                    told = {"t": read.t, "dt": read.dt, "orientation": read.orientation, "kind": read.kind}
                    same(run(strapd.estimate, read.gyr, read.acc, **told, **settings), replayed)
                    held += 1
    assert held >= 10

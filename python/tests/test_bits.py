"""The numbers are the command's, to the bit."""

from __future__ import annotations

import json
import pathlib
import struct
import warnings

import numpy as np
import pytest
import strapd
from conftest import FIXTURES, LOGS, Recorded, Said, same_bits, say
from mcap.reader import make_reader

OPTIONS: list[tuple[list[str], dict[str, object]]] = [
    ([], {}),
    (["--aid=none"], {"aid": "none"}),
    (["--aid=none", "--method=commit"], {"aid": "none", "method": "commit"}),
    (["--method=commit", "--undo-truncation=off"], {"method": "commit", "undo_truncation": "off"}),
    (["--aid=none", "--method=magnus", "--window=6", "--order=4"], {"aid": "none", "method": "magnus", "window": 6, "order": 4}),
    (["--aid=none", "--method=dcm-left", "--world=ned"], {"aid": "none", "method": "dcm-left", "world": "ned"}),
    (["--bias=0.01,-0.02,0.003", "--world=nwu"], {"bias": (0.01, -0.02, 0.003), "world": "nwu"}),
    (
        ["--noise=industrial", "--mount=q=0.5,0.5,0.5,0.5", "--sensor-delay=0.002", "--on-gap=bridge", "--max-gap=0.2"],
        {"noise": "industrial", "mount": (0.5, 0.5, 0.5, 0.5), "sensor_delay": 0.002, "on_gap": "bridge", "max_gap": 0.2},
    ),
    (["--init=q=0.5,0.5,-0.5,0.5", "--gyro-range=3", "--start=0.5", "--until=3"], {"init": np.array([0.5, 0.5, -0.5, 0.5]), "gyro_range": 3, "start": 0.5, "until": 3}),
    (["--aid=none", "--regularise-stamps"], {"aid": "none", "regularise_stamps": True}),
]


@pytest.mark.parametrize("flags, arguments", OPTIONS, ids=lambda value: " ".join(value) if isinstance(value, list) else "")
@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_arrays_give_the_bits_of_a_replay(
    command: str, tmp_path: pathlib.Path, path: pathlib.Path, flags: list[str], arguments: dict[str, object]
) -> None:
    recorded = Recorded(command, path)
    try:
        said = Said(command, tmp_path, path, *flags)
    except AssertionError as refused:
        # What the command refuses is refused here.
        assert "--regularise-stamps" in flags and "regularise-stamps" in str(refused)
        with pytest.raises(strapd.Error) as error, warnings.catch_warnings():
            warnings.simplefilter("ignore", strapd.LossWarning)
            strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, kind=recorded.kind, **arguments)
        assert error.value.kind == "refused"
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", strapd.LossWarning)
        found = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, dt=recorded.dt, kind=recorded.kind, **arguments)
    same_bits(found.t, said.t)
    same_bits(found.q, said.q)
    same_bits(found.rate, said.rate)
    same_bits(np.degrees(found.sigma), said.sigma_deg)
    assert found.world == said.world
    for name in strapd.STATUS_BITS:
        theirs = np.array([name in status for status in said.status])
        if path.name == "faults.mcap" and name == "rejected-before":
            # A message that cannot be decoded is no row of an array.
            assert not (found.flags(name) & ~theirs).any()
            continue
        assert (found.flags(name) == theirs).all(), name


@pytest.mark.parametrize("flags, arguments", OPTIONS, ids=lambda value: " ".join(value) if isinstance(value, list) else "")
@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_a_log_gives_the_bits_of_the_command(
    command: str, tmp_path: pathlib.Path, path: pathlib.Path, flags: list[str], arguments: dict[str, object]
) -> None:
    try:
        said = Said(command, tmp_path, path, *flags)
    except AssertionError as refused:
        assert "--regularise-stamps" in flags and "regularise-stamps" in str(refused)
        with pytest.raises(strapd.Error) as error:
            strapd.replay(path, **arguments)
        assert error.value.kind == "refused"
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", strapd.LossWarning)
        found = strapd.replay(path, **arguments)
    same_bits(found.t, said.t)
    same_bits(found.q, said.q)
    same_bits(found.rate, said.rate)
    same_bits(np.degrees(found.sigma), said.sigma_deg)
    for name in strapd.STATUS_BITS:
        assert (found.flags(name) == np.array([name in status for status in said.status])).all(), name
    assert found.world == said.world
    ours = dict(found.summary)
    theirs = json.loads(say(command, "replay", path, *flags, "--json", "--quiet", "-o", "null:"))["topics"][0]
    assert ours.pop("calibration") is not None and ours.pop("file_problems") is not None
    assert {key: value for key, value in ours.items()} == theirs
    assert found.lost == theirs["samples"]["lost"] and found.gaps == theirs["gaps"]


def test_lines_and_tables_give_the_bits_of_the_command(command: str, tmp_path: pathlib.Path) -> None:
    for name, form in (("samples.csv", "csv"), ("samples.ndjson", "ndjson")):
        path = tmp_path / name
        path.write_text(say(command, "cat", FIXTURES / "xsens_mti.mcap", "--format", form))
        said, found = Said(command, tmp_path, path), strapd.replay(path)
        same_bits(found.q, said.q)
        same_bits(np.degrees(found.sigma), said.sigma_deg)
    # Columns that nobody can guess.
    rows = (tmp_path / "samples.csv").read_text().splitlines()[1:]
    bare = tmp_path / "bare.csv"
    bare.write_text("\n".join(["a!b!c!d", *("!".join(row.split(",")[i] for i in (0, 2, 3, 4)) for row in rows)]) + "\n")
    how = {"columns": "stamp=1:ns,gyro=2:3:4", "delimiter": "!"}
    said = Said(command, tmp_path, bare, f"--columns={how['columns']}", f"--delimiter={how['delimiter']}")
    same_bits(strapd.replay(bare, **how).q, said.q)


def test_a_log_is_smoothed_as_by_the_command(command: str, tmp_path: pathlib.Path) -> None:
    path = FIXTURES / "xsens_mti.mcap"
    said, found = Said(command, tmp_path, path, "--smooth", "--sample-kind=average"), strapd.replay(path, smooth=True, kind="average")
    same_bits(found.q, said.q)
    same_bits(np.degrees(found.sigma), said.sigma_deg)


def magnetometer() -> tuple[np.ndarray, np.ndarray]:
    """Stamps and fields of /imu/mag in the Xsens log, by another reader."""
    stamps, fields = [], []
    with (FIXTURES / "xsens_mti.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/imu/mag"]):
            sec, nanosec, name = struct.unpack_from("<iII", message.data, 4)
            stamps.append(sec * 1_000_000_000 + nanosec)
            fields.append(struct.unpack_from("<3d", message.data, 4 + (12 + name + 7) // 8 * 8))
    return np.array(stamps), np.array(fields)


@pytest.mark.parametrize("declination", [0.0, 3.5])
def test_nine_axes_give_the_bits_of_a_replay(command: str, tmp_path: pathlib.Path, declination: float) -> None:
    recorded = Recorded(command, FIXTURES / "xsens_mti.mcap")
    stamps, mag = magnetometer()
    assert (stamps == recorded.t).all()
    lines = tmp_path / "nine.ndjson"
    with lines.open("w") as file:
        for t, gyr, acc, field in zip(recorded.t.tolist(), recorded.gyr.tolist(), recorded.acc.tolist(), mag.tolist()):
            file.write(json.dumps({"class": "RATE", "id": "imu", "stamp_ns": t, "gyro": gyr, "accel": acc, "mag": field}) + "\n")
    flags = ["--aid=gravity+mag", f"--declination={declination}"]
    said = Said(command, tmp_path, lines, *flags)
    found = strapd.estimate(recorded.gyr, recorded.acc, mag, t=recorded.t, declination=declination)
    assert found.summary["aid"]["by"] == "gravity+mag" and found.world == said.world == "enu"
    same_bits(found.q, said.q)
    same_bits(np.degrees(found.sigma), said.sigma_deg)
    # The field turns the heading: otherwise this test shows nothing.
    alone = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t)
    assert strapd.compare(found, alone, align="none")["heading"]["max_deg"] > 1.0
    # And of a topic of its own, by the command.
    by_topic = strapd.replay(FIXTURES / "xsens_mti.mcap", aid="gravity+mag", declination=declination)
    assert strapd.compare(found, by_topic, align="none")["total"]["max_deg"] < 0.5


def test_counted_stamps_are_those_of_time_index(command: str, tmp_path: pathlib.Path) -> None:
    recorded = Recorded(command, FIXTURES / "coning.mcap")
    said = Said(command, tmp_path, FIXTURES / "coning.mcap", "--time=index", "--rate-hz=333.3", "--aid=none")
    found = strapd.integrate(recorded.gyr, rate_hz=333.3)
    same_bits(found.t - found.t[0], said.t - said.t[0])
    same_bits(found.q, said.q)


def test_the_first_orientation_begins(command: str, tmp_path: pathlib.Path) -> None:
    recorded = Recorded(command, FIXTURES / "xsens_mti.mcap")
    said = Said(command, tmp_path, FIXTURES / "xsens_mti.mcap", "--init=first-orientation", "--aid=none")
    found = strapd.integrate(recorded.gyr, t=recorded.t, orientation=recorded.orientation, init="first-orientation")
    same_bits(found.q, said.q)
    assert found.world == said.world == "enu"


def test_what_was_learned_is_what_the_command_saves(command: str, tmp_path: pathlib.Path) -> None:
    path, saved = FIXTURES / "xsens_mti.mcap", tmp_path / "imu.toml"
    say(command, "replay", path, "-o", "null:", "--quiet", "--save-calibration", saved)
    recorded = Recorded(command, path)
    first = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t)
    from strapd._inputs import calibration

    theirs = calibration(saved)
    assert first.calibration is not None
    for key in ("bias", "G", "ba", "lead"):
        ours = np.where(first.calibration[key]["observed"], first.calibration[key]["value"], 0.0)
        # The file has nine digits, and sigmas three.
        np.testing.assert_allclose(ours, np.array(theirs[key]["value"]), rtol=1e-8, atol=0)
        np.testing.assert_allclose(first.calibration[key]["sigma"], theirs[key]["sigma"], rtol=6e-3)
    # A run that begins with the file is the command's; one with the dict goes through, and begins better.
    said = Said(command, tmp_path, path, f"--calibration={saved}")
    same_bits(strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, calibration=saved).q, said.q)
    again = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, calibration=first.calibration)
    assert again.sigma[0, 2] < first.sigma[0, 2] or (again.q != first.q).any()


@pytest.mark.parametrize("path", ["coning.mcap", "ximu3.mcap", "xsens_mti.mcap"])
def test_live_samples_in_any_pieces_give_the_bits_of_a_replay_by_commit(command: str, tmp_path: pathlib.Path, path: str) -> None:
    recorded = Recorded(command, FIXTURES / path)
    said = Said(command, tmp_path, FIXTURES / path, "--method=commit", "--undo-truncation=off")
    live, pieces, at = strapd.Estimator(undo_truncation="off"), [], 0
    random = np.random.default_rng(1)
    while at < len(recorded.t):
        to = at + int(random.integers(1, 60))
        pieces.append(live.push(recorded.gyr[at:to], recorded.acc[at:to], t=recorded.t[at:to]).q)
        at = to
    pieces.append(live.finish().q)
    same_bits(np.concatenate(pieces), said.q)
    one = strapd.Estimator(undo_truncation="off")
    told = [one.push_one(gyr, acc, t=t) for t, gyr, acc in zip(recorded.t, recorded.gyr, recorded.acc)]
    same_bits(np.array([q for _, q in told]), said.q[: len(told)])
    assert [t for t, _ in told] == said.t[: len(told)].tolist()


def test_two_comparisons_are_one(command: str, tmp_path: pathlib.Path) -> None:
    for world in ("level", "ned"):
        a, b = tmp_path / "a.csv", tmp_path / "b.csv"
        path = FIXTURES / "coning_jitter.mcap"
        say(command, "replay", path, f"--world={world}", "--quiet", "--force", "-o", a)
        say(command, "replay", path, "--aid=none", f"--world={world.replace('level', 'start')}", "--quiet", "--force", "-o", b)
        recorded = Recorded(command, path)
        est = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, world=world)
        ref = strapd.integrate(recorded.gyr, t=recorded.t, world=world.replace("level", "start"))
        for align in ("none", "first", "first-heading", "heading", "best"):
            theirs = json.loads(say(command, "compare", a, b, "--json", f"--align={align}"))
            ours = strapd.compare(est, ref, align=align)
            for key in ("samples", "span_s", "left_out", "total", "heading", "inclination", "drift_deg_per_h", "relative_1s", "align"):
                assert ours[key] == theirs[key], (world, align, key)
            # The file holds sigmas alone, no covariances.
            assert ours["sigma"]["samples"] == theirs["sigma"]["samples"]


def test_a_smoothed_recording_is_the_commands(command: str, tmp_path: pathlib.Path) -> None:
    path = FIXTURES / "xsens_mti.mcap"
    recorded = Recorded(command, path)
    said = Said(command, tmp_path, path, "--aid=gravity", "--smooth")
    found = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, dt=recorded.dt, kind=recorded.kind, aid="gravity", smooth=True)
    same_bits(found.t, said.t)
    same_bits(found.q, said.q)
    same_bits(np.degrees(found.sigma), said.sigma_deg)
    filtered = strapd.estimate(recorded.gyr, recorded.acc, t=recorded.t, dt=recorded.dt, kind=recorded.kind, aid="gravity")
    assert not np.array_equal(found.q, filtered.q)

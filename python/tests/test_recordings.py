"""Recorded logs: the command's words, its losses, its findings, in this process."""

from __future__ import annotations

import json
import logging
import os
import pathlib
import shutil

import numpy as np
import pytest
import strapd
from conftest import FIXTURES, LOGS, same_bits, say
from strapd import _recordings


def test_what_is_lost_is_shouted_in_the_commands_words() -> None:
    with pytest.warns(strapd.LossWarning, match="lost 8 of 602 samples(.|\n)*1 gaps were not integrated over") as told:
        found = strapd.replay(FIXTURES / "faults.mcap")
    assert told[0].filename == __file__
    assert found.lost == 8 and found.flags("held").any()
    with pytest.raises(strapd.Error, match="lost 8 of 602") as error:
        strapd.replay(FIXTURES / "faults.mcap", strict=True)
    assert error.value.kind == "loss"


def test_the_commands_errors_are_ours(tmp_path: pathlib.Path) -> None:
    for path, said in [
        (tmp_path, "a folder without a recording"),
        (tmp_path / "none.mcap", "No such file"),
        (FIXTURES / "README.md", "."),
    ]:
        with pytest.raises(strapd.Error, match=said) as error:
            strapd.replay(path)
        assert error.value.kind == "failed" and "error:" not in str(error.value)
        with pytest.raises(strapd.Error):
            strapd.open(path)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((FIXTURES / "xsens_mti.mcap").read_bytes()[:60_000])
    with pytest.warns(strapd.LossWarning, match="cut"):
        assert 100 < len(strapd.replay(cut)) < 953
    dash = tmp_path / "-dash.mcap"
    shutil.copy(FIXTURES / "constant_rate.mcap", dash)
    here = os.getcwd()
    try:
        os.chdir(tmp_path)
        assert len(strapd.replay("-dash.mcap")) == 251
    finally:
        os.chdir(here)


def test_arguments_that_can_not_be_are_value_errors() -> None:
    path = FIXTURES / "constant_rate.mcap"
    for flags, said in [
        ({"aid": "magic"}, "aid"),
        ({"bias": (1, 2)}, "bias 1.0,2.0: expected none"),
        ({"max_gap": -1.0}, "max.gap"),
        ({"method": "best"}, "method"),
    ]:
        with pytest.raises(ValueError, match=said) as error:
            strapd.replay(path, **flags)
        assert "--" not in str(error.value)
    for name in ("output", "force", "page", "colour"):
        with pytest.raises(TypeError, match=f"there is no argument '{name}'"):
            strapd.replay(path, **{name: 1})
    with pytest.raises(ValueError, match="path: '-' is no file"):
        strapd.replay("-")
    with pytest.raises(ValueError, match="path: a text or a path"):
        strapd.replay(os.fsencode(path))
    with pytest.raises(strapd.Error, match="no topic"):
        strapd.replay(path, topic="/nothing")


def test_values_become_flags() -> None:
    words, known = _recordings.arguments(
        {
            "kind": "average", "bias": (0.1, -2, 1e-20), "init": np.array([1.0, 0, 0, 0]), "regularise_stamps": True,
            "ignore_covariance_flag": False, "topic": None, "max_gap": np.float64(0.1), "window": 4, "declination": 1 / 3,
            "noise": {"arw": 1e-4, "turn_on_bias": (1, 2, 3)}, "field": ["gyro=a.b", "stamp=c"],
            "undo_truncation": 1e-3,
        }
    )  # fmt: skip
    assert words == {
        "sample_kind": ["average"], "bias": ["0.1,-2.0,1e-20"], "init": ["q=1.0,0.0,0.0,0.0"], "regularise_stamps": ["true"],
        "max_gap": ["0.1"], "window": ["4"], "declination": ["0.3333333333333333"], "noise": ["arw=0.0001,turn-on-bias=1.0/2.0/3.0"],
        "field": ["gyro=a.b", "stamp=c"], "undo_truncation": ["on=0.001"],
    }  # fmt: skip
    assert known is None and _recordings.arguments({"calibration": {"bias": [0, 0, 0]}}) == ({}, {"bias": [0, 0, 0]})


def test_the_words_of_the_library_name_arguments_too() -> None:
    """Flags become arguments, those of arrays or of a log, and dashes that are none are left."""
    gyr = np.zeros((600, 3))
    with pytest.raises(strapd.Error) as error:
        strapd.integrate(gyr, rate_hz=100, init="first-orientation")
    said = str(error.value)
    assert said.startswith("init first-orientation: the first samples carry no orientation") and "help: init gravity" in said
    with pytest.raises(strapd.Error) as error:
        strapd.replay(FIXTURES / "constant_rate.mcap", init="first-orientation")
    assert "help: init gravity" in str(error.value) and "--" not in str(error.value) and error.value.kind == "refused"
    assert error.value.help is not None and error.value.help.startswith("init gravity")


def test_several_topics_come_by_name() -> None:
    with pytest.warns(strapd.LossWarning):
        found = strapd.replay(FIXTURES / "px4_flight.ulg", topic="all", aid="none", kind="rate")
        one = strapd.replay(FIXTURES / "px4_flight.ulg", topic="vehicle_angular_velocity", aid="none", kind="rate")
    assert isinstance(found, dict) and {"sensor_combined", "vehicle_angular_velocity"} <= set(found)
    same_bits(found["vehicle_angular_velocity"].q, one.q)


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_logs_say_what_the_command_says(command: str, path: pathlib.Path) -> None:
    assert strapd.open(path).info == json.loads(say(command, "info", path, "--json", "--quiet"))
    findings = json.loads(say(command, "check", path, "--json", "--quiet"))["findings"]
    assert [found.code for found in strapd.check(path)] == [found["code"] for found in findings]
    assert [found.evidence for found in strapd.check(path)] == [found["evidence"] for found in findings]


def test_names_are_quoted_as_the_command_quotes_them(command: str, tmp_path: pathlib.Path) -> None:
    for name in ("a b.mcap", "it's.mcap", "=a.mcap", "$(id).mcap"):
        path = shutil.copy(FIXTURES / "constant_rate.mcap", tmp_path / name)
        assert strapd.open(path).info["next"] == json.loads(say(command, "info", path, "--json", "--quiet"))["next"]


def test_the_environment_counts_as_for_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    path = FIXTURES / "xsens_mti.mcap"
    plain = strapd.replay(path, aid="none")
    monkeypatch.setenv("STRAPD_AID", "none")
    same_bits(strapd.replay(path).q, plain.q)
    # What is said in the call comes first.
    assert strapd.replay(path, aid="gravity").summary["aid"]["by"] == "gravity"
    monkeypatch.setenv("STRAPD_AID", "magic")
    with pytest.raises(ValueError, match="aid: there is no .magic"):
        strapd.replay(path)


def test_a_calibration_is_a_dict_or_a_file(command: str, tmp_path: pathlib.Path) -> None:
    path, saved = FIXTURES / "xsens_mti.mcap", tmp_path / "imu.toml"
    say(command, "replay", path, "-o", "null:", "--quiet", "--save-calibration", saved)
    first = strapd.replay(path)
    assert first.calibration is not None
    known = {key: part for key, part in first.calibration.items() if key != "sensor"}
    by_dict, by_file = (strapd.replay(path, calibration=one) for one in (known, saved))
    # The file has nine digits, and sigmas three: the largest here, 0.01003 rad/s, is 0.3 % less in it, which is 0.0035 deg.
    assert strapd.compare(by_dict, by_file, align="none")["total"]["max_deg"] < 5e-3
    # The numbers themselves are those of the dict: without a filter sigmas weigh nothing.
    by_dict, by_file = (strapd.replay(path, calibration=one, aid="none") for one in (known, saved))
    assert strapd.compare(by_dict, by_file, align="none")["total"]["max_deg"] < 1e-7
    assert not np.array_equal(by_dict.q, first.q)
    saved.write_text("bias = 3")
    with pytest.raises(ValueError, match="calibration: .*imu.toml: line 1"):
        strapd.replay(path, calibration=saved)


def test_what_is_no_loss_is_logged_and_not_lost(tmp_path: pathlib.Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "named.ulg"
    shutil.copy(FIXTURES / "constant_rate.mcap", path)
    with caplog.at_level(logging.WARNING, "strapd"):
        assert len(strapd.replay(path)) == 251
    assert "named.ulg" in caplog.text and "MCAP" in caplog.text


def test_findings_have_codes() -> None:
    found = strapd.check(FIXTURES / "faults.mcap")
    by_code = {finding.code: finding for finding in found}
    assert by_code["not-finite"].severity == "error" and by_code["not-finite"].evidence["count"] == 2
    assert by_code["gap-held"].flags.startswith("--on-gap bridge") and "held" in str(by_code["gap-held"])
    assert all(finding.severity != "error" for finding in strapd.check(FIXTURES / "constant_rate.mcap"))


def test_a_log_says_what_is_in_it() -> None:
    log = strapd.open(FIXTURES / "xsens_mti.mcap")
    assert {topic["topic"] for topic in log.topics} == {"/imu/data", "/imu/mag"} and log.problems == []
    assert repr(log).endswith("xsens_mti.mcap: MCAP, 1906 messages; /imu/data 953 at 50 Hz>")
    assert log.rates == {"/imu/data": pytest.approx(50, abs=1)}
    same_bits(log.replay(aid="none").q, strapd.replay(log.path, aid="none").q)
    assert [finding.code for finding in log.check()] == [finding.code for finding in strapd.check(log.path)]

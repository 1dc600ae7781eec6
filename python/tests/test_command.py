"""Logs through the command: its words, its losses, its absence."""

from __future__ import annotations

import os
import pathlib
import shutil
import stat
import sysconfig
import tempfile

import numpy as np
import pytest
import strapd
from conftest import FIXTURES, same_bits, say
from strapd import _command


def test_what_is_lost_is_shouted_in_the_commands_words() -> None:
    with pytest.warns(strapd.LossWarning, match="lost 8 of 602 samples(.|\n)*1 gaps were not integrated over") as told:
        found = strapd.replay(FIXTURES / "faults.mcap")
    assert told[0].filename == __file__
    assert found.lost == 8 and found.status is None
    with pytest.raises(strapd.Error, match="lost 8 of 602") as error:
        strapd.replay(FIXTURES / "faults.mcap", strict=True)
    assert error.value.kind == "loss"
    with pytest.raises(ValueError, match="flags: the command hands over no status"):
        found.flags("held")


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
    words = _command.arguments(
        {
            "kind": "average", "bias": (0.1, -2, 1e-20), "init": np.array([1.0, 0, 0, 0]), "regularise_stamps": True,
            "ignore_covariance_flag": False, "topic": None, "max_gap": np.float64(0.1), "window": 4, "declination": 1 / 3,
            "noise": {"arw": 1e-4, "turn_on_bias": (1, 2, 3)}, "field": ["gyro=a.b", "stamp=c"],
        }
    )  # fmt: skip
    assert words == [
        "--sample-kind=average", "--bias=0.1,-2.0,1e-20", "--init=q=1.0,0.0,0.0,0.0", "--regularise-stamps", "--max-gap=0.1",
        "--window=4", "--declination=0.3333333333333333", "--noise=arw=0.0001,turn-on-bias=1.0/2.0/3.0", "--field=gyro=a.b", "--field=stamp=c",
    ]  # fmt: skip


def test_the_librarys_words_name_arguments_too() -> None:
    """Both halves turn flags into arguments, and leave dashes that are none."""
    gyr = np.zeros((600, 3))
    with pytest.raises(strapd.Error) as error:
        strapd.integrate(gyr, rate_hz=100, init="first-orientation")
    said = str(error.value)
    assert said.startswith("init first-orientation: the first samples carry no orientation") and "help: init gravity" in said
    assert _command._in_python("--max-gap: a -- b, --sample-kind average, -1") == "max_gap: a -- b, sample_kind average, -1"


def test_several_topics_come_by_name() -> None:
    with pytest.warns(strapd.LossWarning):
        found = strapd.replay(FIXTURES / "px4_flight.ulg", topic="all", aid="none", kind="rate")
        one = strapd.replay(FIXTURES / "px4_flight.ulg", topic="vehicle_angular_velocity", aid="none", kind="rate")
    assert isinstance(found, dict) and {"sensor_combined", "vehicle_angular_velocity"} <= set(found)
    same_bits(found["vehicle_angular_velocity"].q, one.q)


def test_without_the_command_it_says_what_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> None:
    monkeypatch.setenv("STRAPD_BIN", "/nowhere/strapd")
    with pytest.raises(strapd.Error, match="STRAPD_BIN: /nowhere/strapd is no program") as error:
        strapd.replay(FIXTURES / "coning.mcap")
    assert error.value.kind == "command"
    monkeypatch.delenv("STRAPD_BIN")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sysconfig, "get_path", lambda *_: str(tmp_path))
    monkeypatch.setattr(_command.sys, "executable", str(tmp_path / "python"))
    with pytest.raises(strapd.Error, match="not in STRAPD_BIN, beside this Python or on PATH") as error:
        strapd.check(FIXTURES / "coning.mcap")
    assert error.value.kind == "command"


@pytest.mark.parametrize(
    "script, kind, said",
    [
        ("kill -9 $$", "killed", "signal 9"),
        ("exit 1", "failed", "code 1"),
        ("echo 'error: the disk is full' >&2; exit 1", "failed", "the disk is full"),
        ('for w; do case $w in --output=*) echo not attitudes >"${w#--output=}";; esac; done', "protocol", "something else"),
        ('for w; do case $w in --output=*) printf "\\211MCAP0\\r\\n" >"${w#--output=}";; esac; done; echo "{}"', "protocol", "cut short"),
        ('for w; do case $w in --output=*) printf "\\211MCAP0\\r\\n\\003\\377\\377\\377\\377\\377\\377\\377\\377" >"${w#--output=}";; esac; done', "protocol", "too long"),
    ],
)  # fmt: skip
def test_a_command_that_fails_is_an_error_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path, script: str, kind: str, said: str
) -> None:
    program = tmp_path / "strapd"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("STRAPD_BIN", str(program))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    descriptors = set(os.listdir("/proc/self/fd"))
    with pytest.raises(strapd.Error, match=said) as error:
        strapd.replay(FIXTURES / "coning.mcap")
    assert error.value.kind == kind
    assert os.listdir(tmp_path) == ["strapd"] and len(os.listdir("/proc/self/fd")) == len(descriptors)


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
    same_bits(log.replay(aid="none").q, strapd.replay(log.path, aid="none").q)
    assert [finding.code for finding in log.check()] == [finding.code for finding in strapd.check(log.path)]


def test_one_version(command: str) -> None:
    assert say(command, "--version").split() == ["strapd", strapd.__version__]

"""Where the command is that the wheel has brought."""

from __future__ import annotations

import pathlib
import sysconfig

import pytest
import strapd
from conftest import FIXTURES, say
from strapd import _command


def test_without_the_command_it_says_what_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> None:
    monkeypatch.setenv("STRAPD_BIN", "/nowhere/strapd")
    with pytest.raises(strapd.Error, match="STRAPD_BIN: /nowhere/strapd is no program") as error:
        _command.command()
    assert error.value.kind == "command"
    monkeypatch.delenv("STRAPD_BIN")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sysconfig, "get_path", lambda *_: str(tmp_path))
    monkeypatch.setattr(_command.sys, "executable", str(tmp_path / "python"))
    with pytest.raises(strapd.Error, match="not in STRAPD_BIN, beside this Python or on PATH") as error:
        _command.command()
    assert error.value.kind == "command"
    # Logs are read without it.
    assert len(strapd.replay(FIXTURES / "constant_rate.mcap")) == 251
    assert strapd.check(FIXTURES / "constant_rate.mcap") is not None


def test_one_version(command: str) -> None:
    assert say(command, "--version").split() == ["strapd", strapd.__version__]

"""The types that are promised are those that are there."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("mypy")
HERE = pathlib.Path(__file__).resolve().parent
CONFIG = HERE.parent / "pyproject.toml"

USE = """
import numpy as np
import strapd

att: strapd.Attitude = strapd.estimate(np.zeros((2, 3)), t=[0, 1], world="enu", max_gap=1.0)
n: int = len(att)
total: float = strapd.compare(att, att)["total"]["rms_deg"]
told = strapd.Estimator(aid="none").push_one([0, 0, 1], t=5)
if told is not None:
    stamp: int = told[0]
strapd.estimate(np.zeros((2, 3)), t=[0, 1], world="moon")  # type: ignore[arg-type]
strapd.estimate(np.zeros((2, 3)), t=[0, 1], colour=1)  # type: ignore[call-arg]
log: strapd.Log = strapd.open("a.mcap")
hz: float | None = log.rates["/imu"]
imu: strapd.Samples = log.read("/imu", time="log")
walk: strapd.Simulation = strapd.simulate("walking", rate_hz=100, noise={"arw": 0.1}, worn="foot")
strapd.estimate(walk.gyr, walk.acc, t=walk.t, kind=walk.kind).plot(walk.truth, align="none")
error: float = strapd.compare(att, walk.truth)["total"]["rms_deg"]
strapd.simulate("flying")  # type: ignore[arg-type]
att.plot(walk.truth, align="north")  # type: ignore[arg-type]
reveal_type(att.q)
"""


def run(*words: str, folder: pathlib.Path) -> str:
    done = subprocess.run([sys.executable, "-m", *words], capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_package_is_strictly_typed(tmp_path: pathlib.Path) -> None:
    run("mypy", "--strict", "--config-file", str(CONFIG), "-p", "strapd", folder=tmp_path)


def test_the_stubs_say_what_the_module_has(tmp_path: pathlib.Path) -> None:
    run("mypy.stubtest", "strapd._strapd", "--mypy-config-file", str(CONFIG), folder=tmp_path)


def test_who_uses_it_is_checked(tmp_path: pathlib.Path) -> None:
    (tmp_path / "use.py").write_text(USE)
    said = run("mypy", "--strict", "--config-file", str(CONFIG), "use.py", folder=tmp_path)
    assert "float64" in said

"""Where the recordings, the command and the shared logs are, and what the command says."""

from __future__ import annotations

import csv
import os
import pathlib
import signal
import subprocess

import numpy as np
import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
FIXTURES = REPOSITORY / "fixtures"
SHARED = REPOSITORY.parent / "shared"
#: The recordings.
LOGS = sorted(path for path in FIXTURES.iterdir() if path.suffix in (".mcap", ".ulg", ".bag"))

#: What the environment would add to the command line.
OURS = ("STRAPD_BIN", "STRAPD_EXAMPLES", "STRAPD_ALL_TRIALS", "STRAPD_HEAVY")
for name in [name for name in os.environ if name.startswith("STRAPD_") and name not in OURS]:
    del os.environ[name]

# Who runs the tests in the background of a shell has SIGINT ignored, and so would all that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    # At once, and not as a hundred failures.
    from strapd._command import command

    config.stash[COMMAND] = command()


COMMAND = pytest.StashKey[str]()


@pytest.fixture(scope="session")
def command(pytestconfig: pytest.Config) -> str:
    return pytestconfig.stash[COMMAND]


def say(command: str, *words: object, fine: tuple[int, ...] = (0, 3)) -> str:
    """What the command prints."""
    done = subprocess.run([command, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode in fine, done.stderr
    return done.stdout


class Recorded:
    """Samples of a log as ``strapd cat`` prints them."""

    def __init__(self, command: str, path: pathlib.Path) -> None:
        rows = list(csv.DictReader(say(command, "cat", path, "--format", "csv").splitlines()))
        number = lambda text: float(text) if text else float("nan")  # noqa: E731
        column = lambda *names: np.array([[number(row[name]) for name in names] for row in rows])  # noqa: E731
        self.t = np.array([int(row["stamp_ns"]) for row in rows])
        self.gyr = column("gyro_x", "gyro_y", "gyro_z")
        self.acc = column("accel_x", "accel_y", "accel_z")
        self.orientation = column("qw", "qx", "qy", "qz")
        self.dt = np.array([int(row["interval_ns"] or 0) for row in rows])
        # Nothing where the log does not state it: who estimates finds out, as the command does.
        self.kind = rows[0]["sample_kind"] or None


class Said:
    """Attitudes as ``strapd replay -o X.csv`` writes them: every digit."""

    def __init__(self, command: str, folder: pathlib.Path, path: object, *flags: str) -> None:
        out = folder / "attitude.csv"
        say(command, "replay", path, *flags, "--quiet", "--force", "-o", out)
        with out.open() as file:
            rows = list(csv.DictReader(file))
        column = lambda *names: np.array([[float(row[name]) for name in names] for row in rows])  # noqa: E731
        self.t = np.array([int(row["stamp_ns"]) for row in rows])
        self.q = column("qw", "qx", "qy", "qz")
        self.rate = column("wx", "wy", "wz")
        self.sigma_deg = column("sigma_x_deg", "sigma_y_deg", "sigma_z_deg")
        self.status = [set(row["status"].split("|")) - {"ok"} for row in rows]
        self.world = rows[0]["world"]


def same_bits(a: np.ndarray, b: np.ndarray) -> None:
    assert a.shape == b.shape and a.dtype == b.dtype, (a.shape, b.shape, a.dtype, b.dtype)
    different = np.ascontiguousarray(a).view(np.int64) != np.ascontiguousarray(b).view(np.int64)
    assert not different.any(), f"{np.count_nonzero(different)} of {different.size}, first at {np.argmax(different)}"


def turning(n: int, rate_hz: float = 100.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A made-up motion: stamps in ns, rates, level forces."""
    t = np.arange(n) / rate_hz
    gyr = np.stack([np.sin(t), 0.5 * np.cos(2 * t), 0.2 * np.ones(n)], axis=1)
    acc = np.tile([0.0, 0.0, 9.81], (n, 1))
    return (t * 1e9).round().astype(np.int64), gyr, acc

"""Recorded logs -> attitude, by the command ``strapd``.

The command writes attitudes as binary messages into a pipe; they are read from there into arrays, and nothing goes
through text or a file on the way.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import sys
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _strapd
from ._attitude import Attitude
from ._errors import Error
from ._estimation import tell

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterator

Path = Union[str, "os.PathLike[str]"]

#: Read at once from the command.
PIECE = 1 << 20

#: The flags of ``strapd replay`` that are arguments here, ``-`` as ``_``.
FLAGS = frozenset(
    """topic time rate_hz field method window order sample_kind aid accel_topic accel_sign mag_topic mag_mount mag_hard_iron
    declination undo_truncation sensor_delay gyro_unit body world mount init bias calibration max_gap on_gap earth_rate
    regularise_stamps gyro_range ignore_covariance_flag noise start until out_rate threads""".split()
)


def command() -> str:
    """Where the command is: ``STRAPD_BIN``, else beside this Python, else on ``PATH``."""
    # Here and below: who has arrays alone does not wait for what starts programs.
    import shutil
    import sysconfig

    named = os.environ.get("STRAPD_BIN")
    if named:
        if os.path.isfile(named) and os.access(named, os.X_OK):
            return named
        raise Error(f"STRAPD_BIN: {named} is no program", "command")
    scripts = [sysconfig.get_path("scripts"), os.path.dirname(sys.executable)]
    # Of an installation with --user.
    with contextlib.suppress(KeyError):
        scripts.append(sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user")))
    for place in scripts:
        found = shutil.which("strapd", path=place)
        if found:
            return found
    found = shutil.which("strapd")
    if found:
        return found
    raise Error(
        "the command strapd is not here, which reads logs: not in STRAPD_BIN, beside this Python or on PATH\n"
        "  help: install a wheel that has it, or `cargo install strapd` and set STRAPD_BIN",
        "command",
    )


def _word(name: str, value: Any) -> str:
    """A value as the command takes it."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        parts = [f"{key.replace('_', '-')}={_word(key, part).replace(',', '/')}" for key, part in value.items()]
        return ",".join(parts)
    if isinstance(value, (tuple, list)):
        words = ",".join(repr(float(number)) for number in value)
        return f"q={words}" if len(value) == 4 else words
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    # Every digit: the command is to get the same number.
    return repr(float(value)) if isinstance(value, (float, np.floating)) else str(value)


def arguments(flags: dict[str, Any]) -> list[str]:
    """Keyword arguments as flags."""
    words = []
    for name, value in flags.items():
        name = "sample_kind" if name == "kind" else name
        if name not in FLAGS:
            raise TypeError(f"there is no argument {name!r}; there are {', '.join(sorted(FLAGS))}")
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
        elif name == "field" and not isinstance(value, str):
            words.extend(f"{flag}={one}" for one in value)
        else:
            words.append(f"{flag}={_word(name, value)}")
    return words


def _path(path: Path) -> str:
    name = os.fspath(path)
    if isinstance(name, bytes):
        raise ValueError("path: a text or a path is expected, not bytes")
    if name in ("", "-"):
        raise ValueError(f"path: {name!r} is no file")
    # What begins with a dash is a name all the same.
    return os.path.join(os.curdir, name) if name.startswith("-") else name


def _in_python(what: str) -> str:
    """The command names its flags; here they are arguments."""
    return re.sub(r"--([a-z]+(?:-[a-z]+)*)", lambda flag: flag.group(1).replace("-", "_"), what)


def _failure(code: int, said: str) -> Exception:
    lines = said.strip().splitlines()
    begin = next((i for i, line in enumerate(lines) if line.startswith("error: ")), 0)
    what = "\n".join(lines[begin:]).removeprefix("error: ")
    if code < 0:
        return Error(f"the command was ended by signal {-code}" + (f": {what}" if what else ""), "killed")
    if code == 2:
        return ValueError(_in_python(what))
    return Error(_in_python(what) or f"the command ended with code {code}", "failed")


@contextlib.contextmanager
def _running(words: list[str], out: IO[bytes], err: IO[bytes], keep: tuple[int, ...] = ()) -> Iterator[subprocess.Popen[bytes]]:
    """The command, which is gone at the end whatever happens."""
    import subprocess

    program = subprocess.Popen(
        [command(), *words], stdin=subprocess.DEVNULL, stdout=out, stderr=err, pass_fds=keep, close_fds=True
    )
    try:
        yield program
    finally:
        if program.poll() is None:
            program.kill()
        program.wait()


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode("utf-8", "replace")


def _asked(words: list[str], fine: tuple[int, ...] = (0, 3)) -> tuple[Any, str]:
    """What the command answers in JSON, and what it says beside."""
    import tempfile

    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        with _running([*words, "--json", "--quiet"], out, err) as program:
            code = program.wait()
        if code not in fine:
            raise _failure(code, _text(err))
        return json.loads(_text(out)), _text(err)


def replay(path: Path, *, strict: bool = False, **flags: Any) -> Union[Attitude, dict[str, Attitude]]:
    """Attitude of a recorded log: ``strapd replay``.

    :param path: MCAP, ULog, ROS 1 bag, NDJSON or CSV.
    :param flags: every estimation flag of the command by its name, ``-`` as ``_``: ``topic``, ``aid``, ``method``, ``kind``, ``init``, ...
    :returns: one :class:`Attitude`, or with ``topic="all"`` a dict of one for each topic.
    :raises ValueError: an argument that can not be.
    :raises Error: the log can not be read; the message is the command's.
    """
    import tempfile

    words = ["replay", _path(path), *arguments(flags), "--compression=none", "--json", "--quiet"]
    with contextlib.ExitStack() as stack:
        out, err = (stack.enter_context(tempfile.TemporaryFile()) for _ in range(2))
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="strapd-"))
        from_command, to_us = os.pipe()
        closing = stack.enter_context(contextlib.ExitStack())
        stack.callback(os.close, from_command)
        closing.callback(os.close, to_us)
        _widen(to_us)
        # The command tells a format by a name; what it opens under this one is the pipe.
        name = os.path.join(folder, "attitude.mcap")
        os.symlink(f"/dev/fd/{to_us}", name)
        reader = _strapd.Written()
        with _running([*words, f"--output={name}"], out, err, (to_us,)) as program:
            # The command's end alone is left: when it ends, so does the pipe.
            closing.close()
            while piece := os.read(from_command, PIECE):
                reader.push(piece)
            code = program.wait()
        said = _text(err)
        if code not in (0, 3):
            raise _failure(code, said)
        summary = json.loads(_text(out))
        if code == 3:
            told = re.findall(r"^ *WARN (.*)$", said, re.MULTILINE)
            tell("\n".join(told) or f"{path}: samples were lost", strict, depth=3)
        columns = reader.finish()
    found = {}
    for topic in summary["topics"]:
        facts = {**topic, "calibration": None, "file_problems": summary["file_problems"]}
        rows = columns[topic["output_topic"]]
        unknown(rows["cov"], topic["final"]["sigma_deg"])
        found[topic["topic"]] = Attitude(rows, facts, has_status=False)
    if flags.get("topic") == "all":
        return found
    return next(iter(found.values()))


def unknown(covariance: npt.NDArray[np.float64], at_last: list[Optional[float]]) -> None:
    """A message says zeros of a covariance that is not known. Where that came about, the last one is not known either."""
    if None in at_last:
        covariance[(covariance == 0.0).all(axis=1)] = np.nan


def _widen(pipe: int) -> None:
    """Fewer turns between the two processes, where the system allows."""
    with contextlib.suppress(ImportError, AttributeError, OSError):
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, PIECE)


class Finding(NamedTuple):
    """Something that may spoil the attitude."""

    #: Its name, for programs.
    code: str
    #: error, warning or note.
    severity: str
    #: Of which topic; empty of the file.
    topic: str
    #: What was seen.
    text: str
    #: What to do.
    advice: str
    #: Arguments of the command that help.
    flags: str
    #: The numbers behind it.
    evidence: dict[str, Any]

    def __str__(self) -> str:
        flags = f" ({self.flags})" if self.flags else ""
        return f"{self.severity} {self.code}: {self.text}: {self.advice}{flags}"


def check(path: Path, *, topic: Optional[str] = None) -> list[Finding]:
    """Everything in a log that may spoil the attitude, worst first: ``strapd check``."""
    # Exit codes say how bad it is; the findings say it, too.
    answer, _ = _asked(["check", _path(path), *arguments({"topic": topic})], fine=(0, 1, 3, 4))
    return [
        Finding(
            found["code"],
            found["severity"],
            found.get("topic") or "",
            found["what"],
            found["advice"],
            found["flags"],
            found["evidence"],
        )
        for found in answer["findings"]
    ]


class Log:
    """A recorded log, by its path: what is in it, and what can be made of it."""

    def __init__(self, path: Path) -> None:
        self.path = _path(path)
        #: What ``strapd info --json`` says.
        self.info: dict[str, Any]
        self.info, _ = _asked(["info", self.path])

    @property
    def topics(self) -> list[dict[str, Any]]:
        """Topics with their types and numbers of messages."""
        return list(self.info["topics"])

    @property
    def problems(self) -> list[str]:
        """What is wrong with the file."""
        return list(self.info["problems"])

    def replay(self, **arguments: Any) -> Union[Attitude, dict[str, Attitude]]:
        """As :func:`replay`."""
        return replay(self.path, **arguments)

    def check(self, **arguments: Any) -> list[Finding]:
        """As :func:`check`."""
        return check(self.path, **arguments)

    def __repr__(self) -> str:
        imus = ", ".join(f"{imu['topic']} {imu['samples']} at {imu['rate_hz']:.6g} Hz" for imu in self.info["imu"])
        return f"<strapd.Log {self.path}: {self.info['format']}, {self.info['messages']} messages; {imus or 'no IMU'}>"


def open(path: Path) -> Log:  # noqa: A001
    """Looks into a recorded log: ``strapd info``."""
    return Log(path)

"""Recorded logs -> attitude, findings, what is in them: in this process, by the library that the command reads them with."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

import numpy as np

from . import _strapd
from ._attitude import Attitude
from ._estimation import tell, tell_smoothing
from ._settings import ENVIRONMENT, SETTINGS

if TYPE_CHECKING:
    from ._samples import Samples

Path = Union[str, "os.PathLike[str]"]

#: The flags of ``strapd replay`` that are arguments here, ``-`` as ``_``: every setting, and how a log is read.
FLAGS = SETTINGS | frozenset("topic field columns delimiter where accel_topic mag_topic ignore_covariance_flag out_rate threads".split())

#: Those that the environment may say too, as for the command.
OF_THE_ENVIRONMENT = {**ENVIRONMENT, "threads": "STRAPD_THREADS"}


def word(name: str, value: Any) -> str:
    """A value as the command takes it."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        parts = [f"{key.replace('_', '-')}={word(key, part).replace(',', '/')}" for key, part in value.items()]
        return ",".join(parts)
    if isinstance(value, (tuple, list)):
        words = ",".join(repr(float(number)) for number in value)
        return f"q={words}" if len(value) == 4 else words
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if name == "undo_truncation":
        return f"on={float(value)!r}"
    # Every digit: the library is to get the same number.
    return repr(float(value)) if isinstance(value, (float, np.floating)) else str(value)


def of_the_environment() -> dict[str, list[str]]:
    """What the environment says, as :func:`arguments`."""
    said = {name: os.environ.get(variable) for name, variable in OF_THE_ENVIRONMENT.items()}
    return {name: [word] for name, word in said.items() if word}


def arguments(flags: dict[str, Any]) -> tuple[dict[str, list[str]], Optional[dict[str, Any]]]:
    """Keyword arguments as the command's words by name, and the calibration where it is a dict."""
    words: dict[str, list[str]] = {}
    known = None
    for name, value in flags.items():
        name = "sample_kind" if name == "kind" else name
        if name not in FLAGS:
            raise TypeError(f"there is no argument {name!r}; there are {', '.join(sorted(FLAGS))}")
        if value is None or value is False:
            continue
        if value is True:
            words[name] = ["true"]
        elif name == "field" and not isinstance(value, str):
            words[name] = [str(one) for one in value]
        elif name == "calibration" and isinstance(value, dict):
            known = value
        else:
            words[name] = [word(name, value)]
    return words, known


def place(path: Path) -> str:
    """A path as a text that names a file."""
    name = os.fspath(path)
    if isinstance(name, bytes):
        raise ValueError("path: a text or a path is expected, not bytes")
    if name in ("", "-"):
        raise ValueError(f"path: {name!r} is no file")
    if "\0" in name:
        raise ValueError("path: a zero byte is in it")
    return name


def note(said: list[str]) -> None:
    """What the readers have to say beside losses, to Python's log: on stderr, unless the program says otherwise."""
    if said:
        import logging

        for line in said:
            logging.getLogger("strapd").warning("%s", line)


def replay(path: Path, *, strict: bool = False, **flags: Any) -> Union[Attitude, dict[str, Attitude]]:
    """Attitude of a recorded log: ``strapd replay``, to the bit.

    :param path: MCAP, ULog, ROS 1 bag, NDJSON or CSV.
    :param strict: raise :class:`Error` where samples were lost, instead of a :class:`LossWarning`.
    :param flags: every estimation flag of the command by its name, ``-`` as ``_``: ``topic``, ``aid``, ``method``, ``kind``, ``init``, ...
    :returns: one :class:`Attitude`, or with ``topic="all"`` a dict of one for each topic.
    :raises ValueError: an argument that cannot be.
    :raises Error: the log cannot be read; the message is the command's.
    """
    words, known = arguments(flags)
    words = {**of_the_environment(), **words}
    topics, answer, calibrations, lost, said = _strapd.replay(place(path), words, known)
    summary = json.loads(answer)
    if summary["lossy"]:
        tell("\n".join([*lost, *said]) or f"{path}: samples were lost", strict, depth=3)
    else:
        note(said)
    for facts in summary["topics"]:
        tell_smoothing(facts, depth=3)
    found = {}
    for (name, columns), facts, calibration in zip(topics, summary["topics"], calibrations):
        found[name] = Attitude(columns, {**facts, "calibration": calibration, "file_problems": summary["file_problems"]})
    if words.get("topic") == ["all"]:
        return found
    return next(iter(found.values()))


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
    answer, said = _strapd.check_log(place(path), topic)
    note(said)
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
        for found in json.loads(answer)["findings"]
    ]


class Log:
    """A recorded log, by its path: what is in it, and what can be made of it."""

    def __init__(self, path: Path) -> None:
        self.path = place(path)
        answer, said = _strapd.info(self.path)
        #: What ``strapd info --json`` says.
        self.info: dict[str, Any] = json.loads(answer)
        note(said)

    @property
    def topics(self) -> list[dict[str, Any]]:
        """Topics with their types and numbers of messages."""
        return list(self.info["topics"])

    @property
    def rates(self) -> dict[str, Optional[float]]:
        """Samples a second of each topic of samples; ``None`` where there are too few to tell."""
        return {imu["topic"]: imu["rate_hz"] for imu in self.info["imu"]}

    @property
    def problems(self) -> list[str]:
        """What is wrong with the file."""
        return list(self.info["problems"])

    def replay(self, **arguments: Any) -> Union[Attitude, dict[str, Attitude]]:
        """As :func:`replay`."""
        return replay(self.path, **arguments)

    def read(self, topic: Optional[str] = None, **how: Any) -> Samples:
        """Samples of a topic as arrays: :func:`strapd.read`."""
        from ._samples import read

        return read(self.path, topic, **how)

    def check(self, **arguments: Any) -> list[Finding]:
        """As :func:`check`."""
        return check(self.path, **arguments)

    def __repr__(self) -> str:
        rates = {topic: "unknown rate" if hz is None else f"{hz:.6g} Hz" for topic, hz in self.rates.items()}
        imus = ", ".join(f"{imu['topic']} {imu['samples']} at {rates[imu['topic']]}" for imu in self.info["imu"])
        return f"<strapd.Log {self.path}: {self.info['format']}, {self.info['messages']} messages; {imus or 'no IMU'}>"

    def _repr_html_(self) -> str:
        """For notebooks: the table of topics."""
        from ._html import of_log

        return of_log(self.path, self.info)


def open(path: Path) -> Log:  # noqa: A001
    """Looks into a recorded log: ``strapd info``."""
    return Log(path)

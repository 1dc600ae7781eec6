"""What can go wrong, beside ``ValueError`` for an argument that cannot be."""

from __future__ import annotations


class Error(RuntimeError):
    """A run that could not be carried out.

    ``kind`` says which, for programs: ``refused`` (these samples do not allow it), ``loss`` (samples were lost, and
    ``strict`` was asked for), ``no_match``, ``closed``, ``command`` (the command ``strapd`` is not here), ``failed`` (a log can
    not be read, or has no such topic). ``help`` is what helps, alone, where something is known to; the message says it too.
    """

    def __init__(self, message: str, kind: str = "failed", help: str | None = None) -> None:
        super().__init__(message)
        self.kind = kind
        self.help = help


class LossWarning(UserWarning):
    """Done, but samples were lost: the attitude was carried across them."""


class SmoothingWarning(UserWarning):
    """Done, but not as ``smooth=True`` asks: not smoothed at all, not settled, or without the field."""


class ResolutionWarning(UserWarning):
    """Float seconds that are too large to tell samples apart well."""

"""Where the command ``strapd`` is, for whoever starts it from Python: nothing in this package needs it."""

from __future__ import annotations

import contextlib
import os
import sys

from ._errors import Error


def command() -> str:
    """Its path: ``STRAPD_BIN``, else beside this Python, else on ``PATH``."""
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
        "the command strapd is not here: not in STRAPD_BIN, beside this Python or on PATH\n"
        "  help: install a wheel that has it, or `cargo install strapd` and set STRAPD_BIN",
        "command",
    )

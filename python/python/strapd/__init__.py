"""Gyro samples in, attitude you can trust out.

>>> import strapd
>>> att = strapd.estimate(gyr, acc, t=t)     # numpy arrays: rad/s, m/s^2, nanoseconds
>>> att.q, att.sigma, att.bias               # w, x, y, z; rad; rad/s
>>> strapd.replay("flight.mcap").rotation()  # a recorded log, as SciPy's Rotation

Quaternions are w, x, y, z and take **body to world**; the documentation is ``docs/python.md``.
"""

from ._attitude import STATUS_BITS, Attitude
from ._compare import compare
from ._errors import Error, LossWarning, ResolutionWarning, SmoothingWarning
from ._estimation import Estimator, estimate, integrate
from ._recordings import Finding, Log, check, replay

# Not in __all__: `from strapd import *` is to leave Python's own alone.
from ._recordings import open as open  # noqa: A004
from ._relative import Relative, relative
from ._samples import Samples, Simulation, read, simulate
from ._settings import Settings
from ._strapd import __version__

__all__ = [
    "STATUS_BITS",
    "Attitude",
    "Error",
    "Estimator",
    "Finding",
    "Log",
    "LossWarning",
    "Relative",
    "ResolutionWarning",
    "Samples",
    "Settings",
    "Simulation",
    "SmoothingWarning",
    "__version__",
    "check",
    "compare",
    "estimate",
    "integrate",
    "read",
    "relative",
    "replay",
    "simulate",
]

"""An attitude over time, as numpy arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    from matplotlib.figure import Figure
    from scipy.spatial.transform import Rotation

    from ._angles import Align
    from ._compare import Track

#: Names of the bits of ``status``.
STATUS_BITS = {
    "bridged": 1 << 0,
    "held": 1 << 1,
    "reset": 1 << 2,
    "rejected-before": 1 << 3,
    "reordered": 1 << 4,
    "saturated": 1 << 5,
    "undersampled": 1 << 6,
    "provisional": 1 << 7,
    "restamped": 1 << 8,
    "restarted": 1 << 9,
    "last": 1 << 10,
    "aided": 1 << 11,
    "rest": 1 << 12,
    "levelled": 1 << 13,
    "repaired": 1 << 14,
}


class Attitude:
    """Attitudes at n instants: arrays over memory of the compiled half, none copied on the way.

    ``t``, ``t_ns``
        int64 (n,), nanoseconds of the clock that the stamps were of.
    ``q``
        float64 (n, 4): **w, x, y, z**, body to world, unit norm, sign continuous.
    ``rate``
        float64 (n, 3): rad/s about the body axes, what was known of the bias removed.
    ``status``, ``reset``
        uint16 and uint32 (n,): what was noticed (``flags``), and how often the attitude was held or reset so far.
    ``summary``
        dict: counts, gaps, method, what was learned; the names are those of ``strapd replay --json``.
    """

    t: npt.NDArray[np.int64]
    q: npt.NDArray[np.float64]
    rate: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint16]
    reset: npt.NDArray[np.uint32]
    summary: dict[str, Any]

    def __init__(self, columns: dict[str, Any], summary: dict[str, Any]) -> None:
        self.t = columns["t"]
        self.q = columns["q"]
        self.rate = columns["rate"]
        # None where no covariance is carried.
        self._cov: Optional[npt.NDArray[np.float64]] = columns.get("cov")
        self._acceleration: Optional[npt.NDArray[np.float64]] = columns.get("linear_acceleration")
        self._temperature: Optional[npt.NDArray[np.float32]] = columns.get("temperature")
        self.status = columns["status"]
        self.reset = columns["reset"]
        self.summary = summary

    @property
    def t_ns(self) -> npt.NDArray[np.int64]:
        """The same as ``t``."""
        return self.t

    @property
    def t_s(self) -> npt.NDArray[np.float64]:
        """Seconds since the first."""
        return (self.t - self.t[:1]).astype(np.float64) * np.float64(1e-9)

    @property
    def quat_xyzw(self) -> npt.NDArray[np.float64]:
        """x, y, z, w, as SciPy before 1.14 and ROS have it (a copy)."""
        return self.q[:, [1, 2, 3, 0]]

    @property
    def sigma(self) -> npt.NDArray[np.float64]:
        """(n, 3): one standard deviation about each body axis, rad; NaN where it is not known."""
        return np.sqrt(self._upper[:, [0, 3, 5]])

    @property
    def covariance(self) -> npt.NDArray[np.float64]:
        """(n, 3, 3): of the error as a rotation vector in body axes, rad^2."""
        return self._upper[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)

    @property
    def linear_acceleration(self) -> npt.NDArray[np.float64]:
        """(n, 3): m/s^2 along the body axes, without gravity; NaN where no specific force goes with the sample.

        Asked for by ``linear_acceleration=True``.
        """
        return self._accelerations[:, :3]

    @property
    def linear_acceleration_sigma(self) -> npt.NDArray[np.float64]:
        """(n, 3): one standard deviation of each component, m/s^2."""
        return np.sqrt(self._accelerations[:, [3, 6, 8]])

    @property
    def world_linear_acceleration(self) -> npt.NDArray[np.float64]:
        """(n, 3): the same acceleration along the axes of the world, m/s^2."""
        w, xyz = self.q[:, :1], self.q[:, 1:]
        across = 2.0 * np.cross(xyz, self.linear_acceleration)
        return self.linear_acceleration + w * across + np.cross(xyz, across)

    @property
    def temperature(self) -> npt.NDArray[np.float32]:
        """(n,): degrees Celsius, as the recording has it beside its samples; NaN where it has none.

        ``summary["temperature"]`` holds the gyro's bias against it.
        """
        if self._temperature is None:
            return np.full(len(self), np.nan, dtype=np.float32)
        return self._temperature

    @property
    def _accelerations(self) -> npt.NDArray[np.float64]:
        if self._acceleration is None:
            raise AttributeError("no acceleration was asked for, or none can be told\n  help: linear_acceleration=True, and an accelerometer (acc)")
        return self._acceleration

    @property
    def _upper(self) -> npt.NDArray[np.float64]:
        """(n, 6): the upper triangle, NaN where it is not known."""
        return np.full((len(self), 6), np.nan) if self._cov is None else self._cov

    @property
    def world(self) -> str:
        """Axes of the world: start, level, enu, ned, nwu."""
        return str(self.summary["world"])

    @property
    def body(self) -> str:
        """Axes of the body: flu, or frd where the world is ned."""
        return str(self.summary["body"])

    @property
    def lost(self) -> int:
        """Samples that were lost; ``summary["samples"]["by_verdict"]`` says why."""
        return int(self.summary["samples"]["lost"])

    @property
    def gaps(self) -> dict[str, Any]:
        """Gaps: bridged, held, resets, total_s, not_integrated_s, longest_s."""
        gaps: dict[str, Any] = self.summary["gaps"]
        return gaps

    @property
    def warnings(self) -> list[str]:
        """Things to know."""
        return list(self.summary["warnings"])

    @property
    def smoothing(self) -> Optional[str]:
        """How smoothing ended: ``converged``, ``unsettled``, ``without_field``, or ``filter`` where the attitude is the filter's.

        ``None`` where nobody asked for it.
        """
        smooth = self.summary.get("smooth")
        return None if smooth is None else str(smooth["outcome"])

    @property
    def bias(self) -> npt.NDArray[np.float64]:
        """(3,): the gyro's bias at the end, rad/s about the body axes: what was removed beforehand and what was learned.

        Learned by what made the attitude: of a smoothed recording the smoother, else the filter. The filter's alone is
        ``summary["aid"]["learned"]``.
        """
        before = self.summary["bias_rad_s"]
        bias = np.array([before["x"], before["y"], before["z"]])
        learned = self._learned_bias()
        return bias if learned is None else bias + learned[0]

    @property
    def bias_sigma(self) -> Optional[npt.NDArray[np.float64]]:
        """(3,): one standard deviation of it; ``None`` where nothing was learned and the run does not say."""
        learned = self._learned_bias()
        if learned is not None:
            return learned[1]
        sigma = self.summary.get("bias_sigma_rad_s")
        return None if sigma is None else np.array(sigma)

    @property
    def bias_unobserved(self) -> bool:
        """Whether nothing tells the bias about the vertical, by what made the attitude, so that heading drifts by it."""
        if self.smoothing not in (None, "filter"):
            held = self.summary["smooth"]["held_bias"]
            return held is not None and not held["by_rest"]
        aid = self.summary["aid"]
        return aid is not None and bool(aid["bias_unobserved"])

    def _learned_bias(self) -> Optional[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
        """The bias beside what was removed beforehand, and its sigma, by what made the attitude."""
        if self.smoothing not in (None, "filter"):
            smoothed = self.summary["smooth"]["gyro_bias_deg_s"]
            return np.radians(smoothed["last"]), np.radians(smoothed["last_sigma"])
        aid = self.summary["aid"]
        if aid is None:
            return None
        return np.array(aid["learned"]["gyro_bias_rad_s"]), np.array(aid["sigma"]["gyro_bias_rad_s"])

    @property
    def calibration(self) -> Optional[dict[str, Any]]:
        """What is known of the sensor after the run, for ``calibration=`` of the next (``docs/calibration.md``)."""
        known: Optional[dict[str, Any]] = self.summary.get("calibration")
        return known

    def flags(self, name: str) -> npt.NDArray[np.bool_]:
        """(n,): where the status has this bit (``STATUS_BITS``)."""
        if name not in STATUS_BITS:
            raise ValueError(f"name: there is no status {name!r}\n  help: one of {', '.join(STATUS_BITS)}")
        found: npt.NDArray[np.bool_] = (self.status & STATUS_BITS[name]) != 0
        return found

    def rotation(self) -> Rotation:
        """As SciPy's ``Rotation``: ``rotation().apply(v_body)`` is v in world axes."""
        from scipy.spatial.transform import Rotation

        rotation: Rotation = Rotation.from_quat(self.quat_xyzw)
        return rotation

    def euler(self, seq: str = "ZYX", degrees: bool = False) -> npt.NDArray[np.float64]:
        """Angles by SciPy; ``ZYX`` is yaw, pitch, roll."""
        angles: npt.NDArray[np.float64] = self.rotation().as_euler(seq, degrees=degrees)
        return angles

    def at(self, times: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Quaternions (m, 4) at other instants, such as the frames of a camera: between samples, not the nearest of them.

        A cubic on the rotation group goes through the attitudes with the rates that the steps beside tell. NaN outside
        the run and in gaps that the attitude was held over, with a warning that counts them.

        :param times: int64 nanoseconds of the clock of ``t``, or datetime64.
        """
        from ._between import at

        return at(self, times)

    def to_dict(self) -> dict[str, npt.NDArray[Any]]:
        """Columns of one dimension by name, for pandas, polars and the like."""
        sigma = self.sigma
        columns: dict[str, npt.NDArray[Any]] = {"t_ns": self.t}
        columns.update({f"q{axis}": self.q[:, i] for i, axis in enumerate("wxyz")})
        columns.update({f"w{axis}": self.rate[:, i] for i, axis in enumerate("xyz")})
        columns.update({f"sigma_{axis}": sigma[:, i] for i, axis in enumerate("xyz")})
        if self._acceleration is not None:
            for name in ("linear_acceleration", "world_linear_acceleration"):
                columns.update({f"{name}_{axis}": getattr(self, name)[:, i] for i, axis in enumerate("xyz")})
        if self._temperature is not None:
            columns["temperature_c"] = self._temperature
        columns.update(status=self.status, reset=self.reset)
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """A table of :meth:`to_dict`."""
        import pandas

        return pandas.DataFrame(self.to_dict())

    def to_polars(self) -> polars.DataFrame:
        """A table of :meth:`to_dict`."""
        import polars

        return polars.DataFrame(self.to_dict())

    def to_arrow(self) -> pyarrow.Table:
        """A table of :meth:`to_dict`, with world, body and method in the metadata of its schema."""
        import pyarrow

        about = {name: str(self.summary[name]) for name in ("world", "body", "method", "sample_kind", "clock") if name in self.summary}
        return pyarrow.table(self.to_dict(), metadata={f"strapd.{name}": said for name, said in about.items()})

    def _of_arrow(self) -> Any:
        """The same by whoever is here: their tables hand themselves on without a copy."""
        try:
            return self.to_arrow()
        except ImportError:
            pass
        try:
            return self.to_polars()
        except ImportError:
            raise ImportError("Arrow is spoken through pyarrow or polars\n  help: pip install pyarrow") from None

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """Arrow's PyCapsule protocol: what polars, DuckDB, pandas and pyarrow take an Attitude by."""
        return self._of_arrow().__arrow_c_stream__(requested_schema)

    def __arrow_c_schema__(self) -> Any:
        """The columns and their types, by the same protocol."""
        return self[:0].to_arrow().schema.__arrow_c_schema__()

    def plot(
        self, reference: Optional[Track] = None, align: Align = "first-heading", figure: Optional[Figure] = None
    ) -> Figure:
        """Roll, pitch and yaw with bands of three sigma; with a reference the errors about the body axes. Needs matplotlib.

        :param reference: an :class:`Attitude`, or ``(t, q)``, on the same clock and in the same world.
        :param align: the constant rotation of the world that is taken out first: ``none``, ``first``, ``first-heading``.
        :param figure: an empty figure to draw in; else a new one.
        """
        from ._plot import plot

        return plot(self, reference, align, figure)

    def _repr_html_(self) -> str:
        """For notebooks: a few words and a picture, no script."""
        from ._html import of_attitude

        return of_attitude(self)

    def __len__(self) -> int:
        return int(self.t.shape[0])

    def __getitem__(self, part: Union[slice, npt.NDArray[Any]]) -> Attitude:
        """Some of the attitudes, by a slice (no copy), a mask or indices; the summary stays that of the run."""
        if isinstance(part, (int, np.integer)):
            raise TypeError("a slice, a mask or indices; att.q[i] is one quaternion")
        columns: dict[str, Any] = {"t": self.t[part], "q": self.q[part], "rate": self.rate[part]}
        if self._cov is not None:
            columns["cov"] = self._cov[part]
        if self._acceleration is not None:
            columns["linear_acceleration"] = self._acceleration[part]
        if self._temperature is not None:
            columns["temperature"] = self._temperature[part]
        columns.update(status=self.status[part], reset=self.reset[part])
        return Attitude(columns, self.summary)

    def __repr__(self) -> str:
        n = len(self)
        if n == 0:
            return "<strapd.Attitude: none>"
        secs = (int(self.t[-1]) - int(self.t[0])) * 1e-9
        w, x, y, z = self.q[-1]
        aid = self.summary["aid"]
        by = "gyro alone" if aid is None else aid["by"]
        if self.smoothing is not None:
            by += {"converged": ", smoothed", "filter": ", NOT SMOOTHED"}.get(self.smoothing, f", smoothed ({self.smoothing})")
        if self.bias_unobserved:
            by += ", bias not observed"
        lost = f", lost {self.lost} of {self.summary['samples']['total']} samples" if self.lost else ""
        return (
            f"<strapd.Attitude: {n} over {secs:.3f} s, {by}, world {self.world}, body {self.body}{lost}; "
            f"at last q w {w:.6f} x {x:.6f} y {y:.6f} z {z:.6f}>"
        )

"""Samples as they come."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest
import strapd
from conftest import say, turning

T, GYR, ACC = turning(300)
T += 10**9


def test_every_sample_has_its_attitude_at_once() -> None:
    est = strapd.Estimator()
    assert est.last is None and est.summary == {} and est.taken == 0
    told = [est.push_one(gyr, acc, t=t) for t, gyr, acc in zip(T.tolist(), GYR.tolist(), ACC.tolist())]
    assert [t for t, _ in told] == T.tolist() and est.taken == 300
    assert est.last is not None and tuple(est.last.q[0]) == told[-1][1]
    assert est.summary["samples"]["used"] == 300 and est.summary["aid"]["by"] == "gravity"


def test_samples_are_counted_where_a_rate_is_given() -> None:
    one, rows = strapd.Estimator(rate_hz=300.0), strapd.Estimator(rate_hz=300.0)
    # Loggers write 0 for no stamp: a first one is believed when the second has come.
    assert one.push_one(GYR[0]) is None
    told = [one.push_one(gyr) for gyr in GYR[1:].tolist()]
    found = [rows.push(GYR[:100]), rows.push(GYR[100:])]
    assert found[0].t[0] == 0 and len(found[0]) == 100
    assert [0] + [t for t, _ in told] == np.concatenate([part.t for part in found]).tolist()
    assert told[-1][1] == tuple(found[-1].q[-1])
    with pytest.raises(ValueError, match="t: the estimator was made with rate_hz"):
        one.push_one(GYR[0], t=0)


def test_what_is_no_sample_is_refused_by_name() -> None:
    est = strapd.Estimator()
    for said, arguments in [
        ("gyr: three numbers", ([1, 2],)),
        ("gyr: three numbers", ("abc",)),
        ("acc: three numbers", ([1, 2, 3], 5)),
        ("mag: three numbers", ([1, 2, 3], None, [None] * 3)),
        ("t: integer nanoseconds or float seconds", ([1, 2, 3], None, None, "now")),
        ("t: inf s is no time", ([1, 2, 3], None, None, float("inf"))),
        ("t: 1700000000000000000 s is no time", ([1, 2, 3], None, None, 1.7e18)),
        ("t: needed, unless", ([1, 2, 3],)),
    ]:
        with pytest.raises(ValueError, match=said):
            est.push_one(*arguments)
    with pytest.raises(ValueError, match="gyr: of shape"):
        est.push(GYR.T, t=T)
    with pytest.raises(ValueError, match="t: needed"):
        est.push(GYR)
    with pytest.raises(ValueError, match="rate_hz: -1 is no sample rate"):
        strapd.Estimator(rate_hz=-1)
    with pytest.raises(TypeError, match="there is no setting"):
        strapd.Estimator(colour=1)


def test_a_bad_sample_has_no_attitude_and_is_counted() -> None:
    est = strapd.Estimator()
    assert est.push_one([0, 0, 0.1], t=1.0) is not None
    assert est.push_one([0, 0, float("nan")], t=1.01) is None
    assert est.push_one([0, 0, 0.1], t=1.02) is not None
    assert est.push_one([0, 0, 0.1], t=1.005) is None, "late"
    # Whether the clock has jumped back shows the next.
    assert est.push_one([0, 0, 0.1], t=1.03) is not None
    assert est.summary["samples"]["by_verdict"]["not_finite"] == 1 and est.summary["samples"]["lost"] == 2


def test_a_gyro_alone_can_not_find_its_bias_live() -> None:
    with pytest.raises(strapd.Error, match="bias auto") as error:
        strapd.Estimator(bias="auto").push_one(GYR[0], t=0)
    assert error.value.kind == "refused"


def test_a_finished_estimator_is_closed() -> None:
    est = strapd.Estimator()
    est.push(GYR, ACC, t=T)
    est.finish()
    for use in (est.finish, lambda: est.push_one(GYR[0], t=0), lambda: est.push(GYR, t=T)):
        with pytest.raises(strapd.Error, match="finished") as error:
            use()
        assert error.value.kind == "closed"
    assert len(strapd.Estimator().finish()) == 0


def test_a_live_sensor_can_not_be_smoothed() -> None:
    with pytest.raises(ValueError, match=r"smooth: only a whole recording can be smoothed(.|\n)*estimate"):
        strapd.Estimator(smooth=True, method="auto")


def keys(of: dict[str, Any]) -> dict[str, Any]:
    """The names alone, nested as they are."""
    return {name: keys(value) if isinstance(value, dict) else None for name, value in of.items()}


def test_what_is_known_live_has_the_names_of_a_replay(command: str, tmp_path: pathlib.Path) -> None:
    table = tmp_path / "samples.csv"
    rows = np.column_stack([T, GYR, ACC]).tolist()
    lines = [",".join([str(int(t)), *map(repr, values)]) for t, *values in rows]
    table.write_text("stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n" + "\n".join(lines) + "\n")
    said = json.loads(say(command, "replay", table, "--json", "--quiet", "-o", "null:"))["topics"][0]
    est = strapd.Estimator()
    est.push(GYR, ACC, t=T)
    live, whole = est.summary, strapd.estimate(GYR, ACC, t=T).summary
    for summary in (live, whole):
        # A file has it in a file of its own (`--save-calibration`).
        assert summary.pop("calibration") is not None
        assert keys(summary) == keys(said)
    assert live["written"] == 300 and live["aid"]["learned"]["mag_hard_iron"] is None
    assert live["gaps"] == whole["gaps"]


def yaw(q: tuple[float, ...]) -> float:
    w, x, y, z = q
    return float(np.degrees(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))


def drifting(n: int) -> tuple[int, list[float], list[float]]:
    """Level, turned by 10 deg/s at 100 Hz, with 0.4 deg/s of bias."""
    return 10**9 + n * 10**7, [0.0, 0.0, float(np.radians(10.4))], [0.0, 0.0, 9.80665]


def test_a_heading_is_set_and_measured() -> None:
    est = strapd.Estimator()
    with pytest.raises(ValueError, match="no sample has come yet"):
        est.set_heading(0)
    told = {}
    for n in range(9000):
        t, gyr, acc = drifting(n)
        if n == 1000:
            est.set_heading(-77)
        if n > 2000 and n % 100 == 0:
            # 300 ms late, of a world that is 40 degrees off.
            est.measure_heading(40 + 0.1 * (n - 30), 2.0, t=t - 300_000_000)
        told[n] = est.push_one(gyr, acc, t=t)
    last = {n: yaw(said[1]) for n, said in told.items() if said is not None}
    assert abs(last[1000] + 77) < 1e-6
    for n in range(4000, 9000, 500):
        off = (last[n] - 40 - 0.1 * n + 180) % 360 - 180
        assert abs(off) < 1, (n, off)
    assert est.headings["turns"] == 1 and est.headings["doubted"] == 0 and est.headings["used"] >= 68
    for heading, sigma in [(float("nan"), 1), (0, 0), (0, -1), (1e9, 1)]:
        with pytest.raises(ValueError, match="heading, sigma: degrees"):
            est.measure_heading(heading, sigma)
    alone = strapd.Estimator(aid="none")
    alone.push_one([0, 0, 1], t=0)
    for ask in (lambda: alone.set_heading(0), lambda: alone.measure_heading(0, 1)):
        with pytest.raises(ValueError, match="whose vertical is known"):
            ask()

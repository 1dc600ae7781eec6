"""What an Attitude holds, and what it becomes."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import strapd
from conftest import same_bits, turning
from scipy.spatial.transform import Rotation


T, GYR, ACC = turning(500)
ATT = strapd.estimate(GYR, ACC, t=T)


def test_arrays_are_views_of_one_memory() -> None:
    for array in (ATT.q, ATT.rate, ATT._cov):
        assert array.base is not None and array.flags.c_contiguous and array.flags.aligned
        owner = array
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        # The memory is that of the compiled half: numpy does not own it.
        assert not owner.flags.owndata and np.shares_memory(owner, array)
    assert ATT.t_ns is ATT.t and ATT.q.dtype == np.float64 and ATT.t.dtype == np.int64
    part = ATT[100:200]
    assert len(part) == 100 and np.shares_memory(part.q, ATT.q) and np.shares_memory(part.t, ATT.t)


def test_shapes_and_units() -> None:
    n = len(ATT)
    assert n == 500 and ATT.q.shape == (n, 4) and ATT.rate.shape == ATT.sigma.shape == (n, 3)
    assert ATT.covariance.shape == (n, 3, 3)
    same_bits(np.sqrt(np.diagonal(ATT.covariance, axis1=1, axis2=2)), ATT.sigma)
    same_bits(ATT.covariance, ATT.covariance.transpose(0, 2, 1))
    assert np.abs(np.linalg.norm(ATT.q, axis=1) - 1).max() < 1e-14
    assert ATT.t_s[0] == 0 and ATT.t_s[-1] == pytest.approx(4.99)
    assert ATT.world == "level" and ATT.body == "flu" and ATT.lost == 0
    assert ATT.bias.shape == (3,) and ATT.bias_sigma is not None and (ATT.bias_sigma > 0).all()
    assert repr(ATT).startswith("<strapd.Attitude: 500 over 4.990 s, gravity, world level, body flu; at last q w ")


def test_without_a_covariance_the_attitude_has_the_same_bits() -> None:
    whole, bare = strapd.integrate(GYR, t=T), strapd.integrate(GYR, t=T, covariance=False)
    same_bits(whole.q, bare.q)
    same_bits(whole.rate, bare.rate)
    assert np.isfinite(whole.sigma).all() and np.isnan(bare.sigma).all() and bare.covariance.shape == (500, 3, 3)
    assert np.isnan(bare[10:20].sigma).all()
    live = strapd.Estimator(aid="none", noise="none")
    assert np.isnan(live.push(GYR, t=T).sigma).all()
    with pytest.raises(ValueError, match="covariance=False"):
        strapd.integrate(GYR, t=T, covariance=False, noise="consumer")


def test_a_quarter_turn_takes_x_to_y() -> None:
    gyr = np.tile([0.0, 0.0, np.pi / 2], (101, 1))
    att = strapd.integrate(gyr, rate_hz=100)
    np.testing.assert_allclose(att.q[-1], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-12)
    np.testing.assert_allclose(att.rotation()[-1].apply([1, 0, 0]), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(att.euler(degrees=True)[-1], [90, 0, 0], atol=1e-9)
    same_bits(att.quat_xyzw[:, 3], np.ascontiguousarray(att.q[:, 0]))


def test_scipy_integrates_the_same_constant_rate() -> None:
    w = np.array([0.3, -0.2, 0.5])
    att = strapd.integrate(np.tile(w, (1001, 1)), rate_hz=200)
    truth = Rotation.from_rotvec(w * att.t_s[:, None])
    assert (att.rotation().inv() * truth).magnitude().max() < 1e-12


def test_pickles_and_copies_are_the_same() -> None:
    for other in (pickle.loads(pickle.dumps(ATT)), copy.deepcopy(ATT)):
        for name in ("t", "q", "rate", "_cov", "status", "reset"):
            assert (getattr(other, name) == getattr(ATT, name)).all()
        assert other.summary == ATT.summary and repr(other) == repr(ATT)
    error = pickle.loads(pickle.dumps(strapd.Error("why", "loss")))
    assert (str(error), error.kind) == ("why", "loss")


def test_tables_have_a_column_a_number() -> None:
    columns = ATT.to_dict()
    assert list(columns) == ["t_ns", "qw", "qx", "qy", "qz", "wx", "wy", "wz", "sigma_x", "sigma_y", "sigma_z", "status", "reset"]
    assert all(column.shape == (500,) for column in columns.values())
    table = pytest.importorskip("pandas").DataFrame(columns)
    assert (table["qz"].to_numpy() == ATT.q[:, 3]).all() and len(ATT.to_pandas()) == 500


def test_parts_and_flags() -> None:
    assert (ATT[ATT.flags("aided")].q == ATT.q[ATT.flags("aided")]).all()
    assert len(ATT[np.array([3, 5])]) == 2
    with pytest.raises(TypeError, match=r"att.q\[i\]"):
        ATT[3]
    with pytest.raises(ValueError, match="there is no status 'fine'"):
        ATT.flags("fine")


def test_sigma_is_judged_alike_in_every_world() -> None:
    found = []
    for world in ("enu", "ned"):
        est = strapd.estimate(GYR, ACC, t=T, world=world)
        # x and y hang together: to the FRD body of NED the sign changes, as that of the error about y does.
        est._cov[:] = [4e-4, 1.9e-4, 0, 1e-4, 0, 1e-4]
        if world == "ned":
            est._cov[:] *= [1, -1, -1, 1, 1, 1]
        truth = (est.rotation() * Rotation.from_rotvec([0.01, 0.02 if world == "enu" else -0.02, 0.0])).as_quat()[:, [3, 0, 1, 2]]
        found.append(strapd.compare(est, (est.t, truth), align="none", world=world)["sigma"]["tilt"])
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0]["sigma_rms_deg"] > 0


def test_comparisons_take_pairs_and_say_what_is_missing() -> None:
    found = strapd.compare(ATT, (ATT.t, ATT.q), align="none")
    assert found["samples"] == 500 and found["total"]["max_deg"] < 1e-13
    turned = (Rotation.from_rotvec([0, 0, 0.1]) * ATT.rotation()).as_quat()[:, [3, 0, 1, 2]]
    found = strapd.compare((ATT.t, turned), ATT, align="none")
    assert found["heading"]["rms_deg"] == pytest.approx(np.degrees(0.1)) and found["inclination"]["max_deg"] < 1e-6
    assert strapd.compare((ATT.t, turned), ATT, align="heading")["total"]["max_deg"] < 1e-6
    gone = ATT.q.copy()
    gone[5] = np.nan
    assert strapd.compare(ATT, (ATT.t, gone))["left_out"]["bad_references"] == 1
    with pytest.raises(ValueError, match="align: .*no such alignment"):
        strapd.compare(ATT, ATT, align="north")
    with pytest.raises(ValueError, match="b: an Attitude or a pair"):
        strapd.compare(ATT, ATT.q)
    with pytest.raises(ValueError, match="b: 499 stamps for 500"):
        strapd.compare(ATT, (ATT.t[1:], ATT.q))
    with pytest.raises(strapd.Error, match="no instant in common") as error:
        strapd.compare(ATT, (ATT.t + 10**12, ATT.q))
    assert error.value.kind == "no_match"


def test_acceleration_without_gravity_is_that_of_the_body() -> None:
    exact = strapd.simulate("hand", rate_hz=100, duration=30, seed=2)
    att = strapd.estimate(exact.gyr, exact.acc, t=exact.t, kind="rate", linear_acceleration=True)
    # The force in the world by SciPy, less what holds a body up; the sensor has no errors.
    world = att.rotation().apply(exact.acc) - [0.0, 0.0, 9.81]
    assert np.abs(att.world_linear_acceleration - world).max() < 0.05
    assert np.allclose(att.rotation().apply(att.linear_acceleration), att.world_linear_acceleration, atol=1e-9)
    assert att.linear_acceleration_sigma.shape == (len(att), 3) and (att.linear_acceleration_sigma > 0).all()
    assert att[10:20].linear_acceleration.shape == (10, 3)
    assert {"linear_acceleration_x", "world_linear_acceleration_z"} <= set(att.to_dict())
    smooth = strapd.estimate(exact.gyr, exact.acc, t=exact.t, kind="rate", smooth=True, linear_acceleration=True)
    assert np.isfinite(smooth.linear_acceleration).all()
    live = strapd.Estimator(aid="gravity", kind="rate", linear_acceleration=True)
    rows = live.push(exact.gyr, exact.acc, t=exact.t)
    assert np.isfinite(rows.linear_acceleration).all() and pickle.loads(pickle.dumps(rows)).linear_acceleration.shape == rows.rate.shape
    plain = strapd.estimate(exact.gyr, exact.acc, t=exact.t, kind="rate")
    same_bits(plain.q, att.q)
    with pytest.raises(AttributeError, match="linear_acceleration=True"):
        plain.linear_acceleration
    assert "linear_acceleration_x" not in plain.to_dict()
    with pytest.raises(ValueError, match="no vertical"):
        strapd.integrate(exact.gyr, t=exact.t, linear_acceleration=True)


def test_a_temperature_stays_with_the_attitudes_of_a_recording(tmp_path: Path) -> None:
    def replayed(name: str, behind: Callable[[int], str]) -> strapd.Attitude:
        head = "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z" + name
        rows = (f"{10**9 + n * 10**7},0.1,0,{0.2 + 0.001 * (n % 7)},0,0,9.81{behind(n)}" for n in range(1000))
        (tmp_path / "log.csv").write_text("\n".join([head, *rows]) + "\n")
        return strapd.replay(tmp_path / "log.csv")

    att = replayed(",temperature_c", lambda n: f",{20 + n // 100}.25")
    assert att.temperature.dtype == np.float32 and (att.temperature == [20.25 + n // 100 for n in range(1000)]).all()
    assert (att[100:300:100].temperature == [21.25, 22.25]).all() and "temperature_c" in att.to_dict()
    assert att.summary["temperature"]["range_degc"] == [20.25, 29.25]
    none = replayed("", lambda n: "")
    assert np.isnan(none.temperature).all() and "temperature_c" not in none.to_dict()
    assert none.summary["temperature"] is None

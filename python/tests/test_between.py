"""Attitudes between samples, against a motion that is known at every instant."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import strapd

START = 1_700_000_000_000_000_000


def motion(t):
    """A body that turns about everything, up to 2.8 rad/s."""
    return Rotation.from_euler("ZYX", np.c_[0.8 * np.sin(0.9 * t) + 0.3 * t, 0.4 * np.sin(5 * t + 1), 0.3 * np.sin(7 * t)])


def wxyz(rotation):
    return rotation.as_quat()[:, [3, 0, 1, 2]]


def degrees(truth, q):
    return np.degrees((truth.inv() * Rotation.from_quat(q[:, [1, 2, 3, 0]])).magnitude()).max()


def sampled(rate_hz, jitter=0.0):
    """Its attitudes at samples, as a run has them."""
    t = np.arange(0, 10, 1 / rate_hz)
    t += jitter / rate_hz * np.random.default_rng(1).uniform(-0.5, 0.5, len(t))
    t_ns = START + np.round(t * 1e9).astype(np.int64)
    q = wxyz(motion((t_ns - START) * 1e-9))
    zeros = np.zeros((len(t), 3))
    columns = {"t": t_ns, "q": q, "rate": zeros, "cov": np.zeros((len(t), 6))}
    columns.update(status=np.zeros(len(t), np.uint16), reset=np.zeros(len(t), np.uint32))
    return strapd.Attitude(columns, {})


@pytest.mark.parametrize("jitter", [0.0, 0.4])
def test_frames_between_samples_are_those_of_the_motion_and_no_nearest_ones(jitter):
    frames = START + np.round(np.arange(0.1, 9.9, 1001 / 30000) * 1e9).astype(np.int64)
    truth = motion((frames - START) * 1e-9)
    errors = [degrees(truth, sampled(rate, jitter).at(frames)) for rate in (50, 100, 200)]
    assert errors[1] < 3e-4
    # Of third order: half the step, an eighth of the error.
    assert errors[0] / errors[1] > 5 and errors[1] / errors[2] > 5
    att = sampled(100, jitter)
    assert (att.at(att.t) == att.q).all()
    found = att.at(frames)
    assert (att.at(frames.astype("datetime64[ns]")) == found).all()
    # In any order, and one of them twice.
    order = np.r_[np.random.default_rng(2).permutation(len(frames)), 7]
    assert (att.at(frames[order]) == found[order]).all()


def test_instants_without_an_attitude_are_nan_and_counted():
    att = sampled(100)
    att.status[500] = strapd.STATUS_BITS["held"]
    t = att.t
    wanted = [t[0] - 1, t[0], t[499] + 5_000_000, t[500], t[500] + 5_000_000, t[-1], t[-1] + 1]
    with pytest.warns(UserWarning) as said:
        found = att.at(wanted)
    assert np.isnan(found).all(axis=1).tolist() == [True, False, True, False, False, False, True]
    words = [str(one.message) for one in said]
    assert any("2 of 7 are before the first" in word for word in words) and any("1 of 7 are in a gap" in word for word in words)
    for bad in ([0.5, 1.0], [[1, 2]]):
        with pytest.raises(ValueError, match="times: "):
            att.at(bad)
    with pytest.warns(UserWarning, match="there is no attitude"):
        assert np.isnan(att[:0].at(t[:3])).all()

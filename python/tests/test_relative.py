"""The angle of a joint, against SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import strapd


def knee(seconds=40.0, offset=1.0):
    """A thigh and a shank with a hinge between them, in worlds whose headings differ."""
    t = np.arange(0, seconds, 0.02)
    angle = 0.5 * (1 - np.cos(5 * t))
    thigh = Rotation.from_euler("ZYX", np.c_[0.8 * np.sin(0.3 * t), 0.4 * np.sin(5 * t + 1), 0.1 * np.sin(0.7 * t)])
    shank = thigh * Rotation.from_euler("Y", angle[:, None])
    worn = Rotation.from_rotvec([0.4, -0.2, 0.9]), Rotation.from_rotvec([-1.0, 0.3, 0.2])
    a, b = thigh * worn[0], Rotation.from_euler("Z", offset) * shank * worn[1]
    rows = [r.as_quat()[:, [3, 0, 1, 2]] for r in (a, b)]
    return (t * 1e9).astype(np.int64), rows, angle, worn[0].inv().apply([0, 1, 0]), a.inv() * Rotation.from_euler("Z", -offset) * b


def test_a_hinge_gives_the_angle_and_closes_the_headings():
    t, (a, b), angle, axis, truth = knee()
    found = strapd.relative((t, a), (t, b))
    assert found.heading == "hinge" and found.no_hinge is None
    sign = np.sign(np.dot(found.hinge["axis_first"], axis))
    assert np.abs(sign * found.angle - (angle - angle[0])).max() < 1e-5
    assert np.abs(np.abs(found.heading_offset) - 1.0).max() < 1e-5
    error = truth.inv() * Rotation.from_quat(found.q[:, [1, 2, 3, 0]])
    assert error.magnitude().max() < 1e-5
    assert np.isnan(found.sigma).all()


def test_what_is_no_hinge_stays_as_recorded_or_is_refused():
    t, (a, _), *_ = knee()
    found = strapd.relative((t, a), (t, a))
    assert found.heading == "recorded" and "bends" in found.no_hinge and np.abs(found.angle).max() < 1e-7
    with pytest.raises(strapd.Error, match="no hinge"):
        strapd.relative((t, a), (t, a), "hinge")
    with pytest.raises(strapd.Error, match="no instant in common"):
        strapd.relative((t, a), (t + 10**15, a))
    with pytest.raises(ValueError, match="no such source"):
        strapd.relative((t, a), (t, a), "compass")

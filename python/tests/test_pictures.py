"""Pictures: by matplotlib, and in notebooks."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
import strapd
from conftest import FIXTURES
from scipy.spatial.transform import Rotation
from strapd import _angles

WALK = strapd.simulate("walking", rate_hz=100, duration=20, noise="consumer_imu", seed=4)
ATT = strapd.estimate(WALK.gyr, WALK.acc, t=WALK.t)


def test_angles_and_errors_are_those_of_scipy() -> None:
    random = Rotation.random(300, rng=np.random.default_rng(1))
    q = random.as_quat()[:, [3, 0, 1, 2]]
    theirs = random.as_euler("ZYX", degrees=True)[:, ::-1]
    np.testing.assert_allclose(_angles.roll_pitch_yaw(q), theirs, atol=1e-9)
    small = Rotation.from_rotvec(np.random.default_rng(2).normal(0, 0.1, (300, 3)))
    t = np.arange(300) * 10
    estimate = (random * small).as_quat()[:, [3, 0, 1, 2]]
    np.testing.assert_allclose(_angles.errors(t, estimate, (t, q), "none"), np.degrees(small.as_rotvec()), atol=1e-9)
    # A constant heading between the two worlds goes by the first.
    turned = (Rotation.from_rotvec([0, 0, 1.0]) * random).as_quat()[:, [3, 0, 1, 2]]
    assert np.abs(_angles.errors(t, turned, (t, q), "first-heading")).max() < 1e-9
    assert np.abs(_angles.errors(t, turned, (t, q), "none")).max() > 50


def test_a_reference_is_taken_between_its_stamps_and_not_beyond() -> None:
    stamps = np.array([0, 100])
    quarter = np.array([[1.0, 0, 0, 0], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]])
    found = _angles.at(stamps, quarter, np.array([-1, 0, 50, 100, 101]))
    assert np.isnan(found[[0, 4]]).all()
    np.testing.assert_allclose(_angles.roll_pitch_yaw(found[1:4])[:, 2], [0, 45, 90], atol=1e-9)
    with pytest.raises(ValueError, match="no instant in common"):
        _angles.errors(stamps + 10**9, quarter, (stamps, quarter), "none")


def test_sigmas_of_angles_are_those_of_many_trials() -> None:
    random = np.random.default_rng(3)
    base = Rotation.from_euler("ZYX", [40, 35, -20], degrees=True)
    covariance = np.array([[4e-6, 1e-6, 0], [1e-6, 9e-6, 2e-6], [0, 2e-6, 2.5e-5]])
    trials = (base * Rotation.from_rotvec(random.multivariate_normal(np.zeros(3), covariance, 20000))).as_euler("ZYX", degrees=True)
    angles = base.as_euler("ZYX", degrees=True)[None, ::-1]
    # 20,000 trials know a sigma to half a percent.
    np.testing.assert_allclose(_angles.sigmas_of(angles, covariance[None])[0], trials.std(axis=0)[::-1], rtol=0.02)


def test_a_plot_has_the_angles_and_their_bands() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    figure = ATT.plot()
    assert [axis.get_ylabel() for axis in figure.axes] == ["roll, deg", "pitch, deg", "yaw, deg"]
    drawn = figure.axes[1].lines[0].get_ydata()
    np.testing.assert_allclose(drawn, _angles.roll_pitch_yaw(ATT.q)[:, 1])
    band = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    roll = _angles.roll_pitch_yaw(ATT.q)[:, 0]
    assert band.max() > roll.max() and band.min() < roll.min()
    # The first sample knows nothing: what follows is to be seen all the same.
    bottom, top = figure.axes[0].get_ylim()
    assert bottom < roll.min() and roll.max() < top < 0.5 * band.max()
    matplotlib.pyplot.close(figure)


def test_a_plot_without_sigmas_has_its_lines() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    part = ATT[:50]
    part._cov = np.full_like(part._cov, np.nan)
    figure = part.plot(figure=matplotlib.figure.Figure())
    assert all(np.isfinite(axis.get_ylim()).all() for axis in figure.axes)


def test_a_plot_against_the_truth_has_the_errors() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    figure = ATT.plot(WALK.truth)
    drawn = np.stack([axis.lines[0].get_ydata() for axis in figure.axes], axis=1)
    total = np.sqrt(np.mean(np.linalg.norm(drawn, axis=1) ** 2))
    assert total == pytest.approx(strapd.compare(ATT, WALK.truth, align="first-heading")["total"]["rms_deg"], rel=1e-6)
    assert "aligned by first-heading" in figure.axes[0].get_title()
    # Into a figure that is there already.
    other = matplotlib.figure.Figure()
    assert ATT.plot(ATT, align="none", figure=other) is other
    assert max(np.nanmax(np.abs(axis.lines[0].get_ydata())) for axis in other.axes) < 1e-6
    with pytest.raises(ValueError, match="align: there is no .north"):
        ATT.plot(WALK.truth, align="north", figure=matplotlib.figure.Figure())
    with pytest.raises(ValueError, match="no attitude"):
        ATT[:0].plot()
    matplotlib.pyplot.close(figure)


def test_notebooks_get_words_and_a_picture_without_a_script() -> None:
    html = ATT._repr_html_()
    assert "<script" not in html and "strapd.Attitude" in html and len(html) < 40_000
    svg = ElementTree.fromstring(re.search(r"<svg.*</svg>", html, re.DOTALL).group(0))
    paths = [path.get("d") for path in svg.iter("{http://www.w3.org/2000/svg}path") if path.get("fill") == "none"]
    assert len(paths) == 3 and all(path.startswith("M") and "nan" not in path for path in paths)
    numbers = [float(number) for number in re.findall(r"[-\d.]+", " ".join(paths))]
    assert min(numbers) >= 0 and max(numbers) <= 640
    for few in (ATT[:0], ATT[:1], ATT[:2]):
        assert "strapd.Attitude" in few._repr_html_()
    # Names in a log are somebody else's.
    evil = ATT[:5]
    evil.summary = {**evil.summary, "world": "<script>alert(1)</script>", "warnings": ["<b>"]}
    assert "<script" not in evil._repr_html_() and "<b>" not in evil._repr_html_()
    log = strapd.open(FIXTURES / "xsens_mti.mcap")._repr_html_()
    assert "<td>/imu/data</td><td>sensor_msgs/msg/Imu</td><td>953</td><td>50" in log

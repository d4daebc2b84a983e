"""The correction over time."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.correction import Correction
from mlscorr.estimate import Support
from mlscorr.frames import attitude_from_angles
from mlscorr.report.figures import correction_figure
from tests.beds.reports import START, because, drive, fabricate, page, words


@pytest.mark.long
def test_a_gap_breaks_the_curves_and_is_shaded(tmp_path):
    "No line suggests knowledge where the trajectory has none"
    trajectory = drive(gap=(20.0, 31.0))
    survey, correction, report = fabricate(trajectory)
    assert "Gaps of the trajectory" in words(page(tmp_path, survey, correction, report))
    figure = correction_figure(correction, report)
    curve = max(figure.axes[0].lines, key=lambda line: len(line.get_xdata()))
    (at,) = np.flatnonzero(np.isnan(curve.get_ydata()))
    np.testing.assert_allclose(curve.get_xdata()[[at - 1, at + 1]], [20.0, 31.0], atol=0.03)
    assert "Gap of the trajectory" in [text.get_text() for text in figure.legends[0].texts]


def test_outages_steps_and_extrapolated_stretches_are_told_apart():
    "Each is drawn where it was, and stands in the legend; what isn't there doesn't"
    _, correction, report = fabricate(drive())
    names = {
        "Extrapolated, outside the control",
        "GNSS outage: the position drifts",
        "GNSS re-acquired: the recorded position jumps",
    }
    support = replace(
        report.support, outages=((START + 10.0, START + 25.0),), steps=(START + 25.0,)
    )
    for known, expected in ((support, names), (Support(), set())):
        figure = correction_figure(correction, replace(report, support=known))
        texts = {text.get_text() for text in figure.legends[0].texts}
        assert texts & names == expected and "First and last control point" in texts
    panel = correction_figure(correction, replace(report, support=support)).axes[0]
    assert any(np.allclose(line.get_xdata(), 25.0, atol=1e-6) for line in panel.lines)


def test_the_attitude_panel_shows_the_smaller_turn_through_north():
    "From 359.999 to 0.001 deg is 0.002 deg, not a whole turn"
    trajectory = drive(1.0)
    old, new = (
        replace(trajectory, attitude=attitude_from_angles(0.0, 0.0, np.full(50, np.radians(a))))
        for a in (359.999, 0.001)
    )
    np.testing.assert_allclose(
        np.degrees(Correction(old, new).attitude_change), [[0, 0, 0.002]] * 50, atol=1e-9
    )


def test_an_outlier_does_not_squash_the_curve():
    "A rejected misclosure of 80 m is marked at the panel's edge; the axis stays in decimetres"
    _, correction, report = fabricate(drive())
    far = {"used": False, "why": because("outlier"), "before": np.array([80.0, -80.0, 0.1])}
    report.targets[1] = replace(report.targets[1], **far)
    figure = correction_figure(correction, report)
    assert all(np.ptp(panel.get_ylim()) < 3.0 for panel in figure.axes)
    assert any("Not used" in text.get_text() for text in figure.legends[0].texts)

"""Residuals of every target."""

import numpy as np

from mlscorr.report.figures import residual_figure
from tests.beds.reports import drive, fabricate


def test_each_residual_is_drawn_where_it_is():
    "In the order of time, both roles together, before and after, to 1e-12 m"
    report = fabricate(drive())[2]
    panels = np.reshape(residual_figure(report).axes, (3, 2))
    for name, column in (("before", 0), ("after", 1)):
        for axis in range(3):
            points = {}
            for container in panels[axis, column].containers:
                points |= dict(zip(*container[0].get_data(), strict=True))
            expected = [getattr(row, name)[axis] for row in report.targets]
            np.testing.assert_allclose([points[k] for k in sorted(points)], expected, atol=1e-12)


def test_the_scale_after_is_told():
    "A correction that leaves a hundredth has a finer scale, and the title says so"
    report = fabricate(drive())[2]
    title = residual_figure(report).axes[1].get_title(loc="left")
    assert "times finer" in title


def test_many_names_give_way_to_a_sentence():
    "More than 60 targets are not named under the axis"
    few, many = (residual_figure(fabricate(drive(), count)[2]).axes[-1] for count in (8, 80))
    assert next(text.get_text() for text in few.get_xticklabels()) == "T01"
    assert "in time order" in many.get_xlabel() and "T01" not in [
        text.get_text() for text in many.get_xticklabels()
    ]

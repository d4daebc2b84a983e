"""Frame common to all maps."""

import numpy as np
from matplotlib.figure import Figure

from mlscorr.report.maps import frame, track
from tests.beds.reports import drive


def test_the_track_breaks_at_gaps():
    "No line crosses a gap of 10 s; elsewhere the places are the trajectory's"
    way = drive(gap=(20.0, 30.0))
    plan = track(way)
    assert np.isnan(plan).any(axis=1).sum() == 1
    kept = plan[np.isfinite(plan).all(axis=1)]
    np.testing.assert_array_equal(kept[[0, -1]], way.position[[0, -1], :2])


def test_a_metre_east_is_as_long_as_a_metre_north_and_ticks_are_whole_metres():
    "Equal scales at UTM size; decimals only on a map of less than 5 m"
    axes = Figure().add_subplot()
    for size, expected in ((100.0, "532\N{NARROW NO-BREAK SPACE}040"), (2.0, ".")):
        frame(axes, np.array([532_000.0, 3_374_000.0]), np.array([532_000.0, 3_374_000.0]) + size)
        assert axes.get_aspect() == 1.0
        text = axes.xaxis.get_major_formatter()(532_040.0)
        assert expected.replace("\N{NARROW NO-BREAK SPACE}", text[3]) in text

"""The accuracy of a plan, in a sentence and over time."""

import numpy as np

from mlscorr.report.gap import accuracy_sentence
from mlscorr.report.gap._plan import accuracy_figure
from tests.beds.gap_documents import plan_document


def test_the_sentence_says_how_accurate_the_corrected_cloud_will_be():
    "RMS, the worst place, and on how many looks it rests"
    sentence = accuracy_sentence(plan_document()["accuracy"])
    assert "2 observations of control points" in sentence
    assert "3.2 cm (RMS along the drive). The largest is 6.0 cm at 414005.0 s" in sentence


def test_sigma_and_looks_stand_at_their_times():
    "Each pass has a panel of its own, its sigma in cm and its control points below"
    place = {"gps_time": 414_004.0}
    panels = accuracy_figure(plan_document(next_control=[place])).axes
    assert len(panels) == 2
    sigma, looks, places = panels[1].lines
    np.testing.assert_allclose(sigma.get_xydata(), [[0, 2], [5, 6], [10, 1]])
    assert looks.get_xdata().tolist() == [9.0] and places.get_xdata().tolist() == [4.0]


def test_all_that_is_named_is_seen():
    """The highest sigma of any pass is within the axis, and a place at the end of one has a star.

    Sigmas are sampled and rounded, so a place may lie a moment beyond the last of its pass.
    """
    places = [{"gps_time": 413_210.03}, {"gps_time": 413_999.9}]
    panels = accuracy_figure(plan_document(next_control=places)).axes
    stars = [panel.lines[2].get_xdata() for panel in panels]
    np.testing.assert_allclose(stars, [[10.03], [-0.1]])
    low, high = panels[0].get_ylim()
    assert low < 0 and high > 6.0  # cm

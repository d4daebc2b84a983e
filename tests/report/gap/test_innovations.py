"""The figure of the innovations."""

import numpy as np

from mlscorr.report.gap._innovations import innovations_figure, passes_of
from tests.beds.gap_documents import gap_document


def test_passes_are_drawn_apart():
    "A pause of a minute separates two passes; steps of a second don't"
    passes = passes_of(np.array(gap_document()["innovations"]["gps_time"]))
    assert len(passes) == 2
    assert passes[1, 0] - passes[0, 1] > 60.0


def test_innovations_that_are_all_too_small_are_told_by_their_rms():
    "A third of what is stated: RMS 0.34 beside 1, and not only that few lie outside of the stripe"
    document = gap_document()
    size = len(document["innovations"]["before"])
    document["innovations"]["before"] = [0.34 * (-1) ** k for k in range(size)]
    titles = [panel.get_title("left") for panel in innovations_figure(document).axes]
    assert "Before: RMS 0.34 (expected 1), 0.0 % beyond ±2 sigma (4.6 %)" in titles

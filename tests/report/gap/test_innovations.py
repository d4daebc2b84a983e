"""The figure of the innovations."""

import numpy as np

from mlscorr.report.gap.innovations import passes_of
from tests.beds.gap_documents import gap_document


def test_passes_are_drawn_apart():
    "A pause of a minute separates two passes; steps of a second don't"
    passes = passes_of(np.array(gap_document()["innovations"]["gps_time"]))
    assert len(passes) == 2
    assert passes[1, 0] - passes[0, 1] > 60.0

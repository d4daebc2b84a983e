"""Functions for what no effect explains."""

import numpy as np

from mlscorr.gap.infer.unknown import unknown_blocks


def test_the_unknown_leaves_out_what_a_survey_does_not_vary(study):
    "A survey of one pass has no block of passes; every block shows in some row"
    g = study.geometry(8, targets=12, patches=20, passes=1)
    blocks = unknown_blocks(g.rows, g.survey)
    assert not any("passes" in block.lead for block in blocks)
    assert all(np.abs(block.columns).max() > 0 for block in blocks)

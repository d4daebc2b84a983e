"""Functions for what no effect explains."""

import numpy as np

from mlscorr.gap.evidence import unknown_blocks
from mlscorr.gap.plan import Ruler
from mlscorr.gap.plan.draws import SizedMechanism, shift_by
from mlscorr.simulate import Mechanism


def test_the_unknown_leaves_out_what_a_survey_does_not_vary(study):
    "A survey of one pass has no block of passes; every block shows in some row"
    g = study.geometry(8, targets=12, patches=20, passes=1)
    blocks = unknown_blocks(g.rows, g.survey)
    assert not any("passes" in block.hint for block in blocks)
    assert all(np.abs(block.columns).max() > 0 for block in blocks)


def test_what_goes_up_and_down_with_a_covariate_is_in_a_fine_block(with_surface):
    "Of a wave of 3 turns over acceleration the fine functions hold nine tenths, the smooth a half"
    g, _ = with_surface
    wave = SizedMechanism("wave", Mechanism("beam", "acceleration", "wave"), chance=1)
    shift = shift_by(Ruler.of(g.rows, g.survey), wave)[g.rows.metric]
    held = {}
    for block in unknown_blocks(g.rows, g.survey):
        columns = block.columns[g.rows.metric]
        left = shift - columns @ np.linalg.lstsq(columns, shift, rcond=None)[0]
        held[block.hint] = 1 - (left @ left) / (shift @ shift)
    assert held["range error that varies with acceleration"] > 0.9
    assert held["range error that depends on acceleration"] < 0.5

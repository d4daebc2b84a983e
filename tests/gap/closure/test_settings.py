"""Numbers that follow from the geometry of targets and the size of samples."""

import numpy as np
import pytest

from mlscorr.gap.closure._settings import SETTINGS
from mlscorr.simulate import SETTINGS as SIMULATION

board_edge = SIMULATION.board_edge
hole_board = SIMULATION.hole_board


@pytest.mark.parametrize("size", [0.3, 0.6, 1.0])
def test_boards_lie_within_what_is_looked_at(size):
    "Corners of the boards of discs and holes of 0.3 to 1 m, and room for a disc's to move"
    disc, hole = (0.5 * np.sqrt(2.0) * edge * size for edge in (board_edge, hole_board))
    around = SETTINGS.around * size
    assert disc < around and hole < around + SETTINGS.search_margin


def test_paint_ends_before_what_lies_beside_begins():
    "Off disc and plate: farther than half a diagonal, nearer than the end of what is looked at"
    assert np.hypot(0.5, 0.5) < SETTINGS.background < SETTINGS.around
    assert SETTINGS.largest_offset < SETTINGS.extent < SETTINGS.background


def test_an_event_leaves_blocks_to_learn_from():
    "Every other block of an event of any width is held out: a quarter of it leaves two"
    assert int(1.0 / SETTINGS.event_share) // 2 >= 2
    assert 0.5 < SETTINGS.block_share < 1.0

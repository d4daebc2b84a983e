"""Records of columns: each is its own, whatever it holds."""

from dataclasses import dataclass

import numpy as np
import pytest

from mlscorr.survey import Columns, PointCloud


@dataclass(frozen=True, eq=False)
class Heights(Columns):
    "A record of one column"

    height: np.ndarray


def test_records_are_told_apart_as_keys():
    "Two records with other values are two keys of a cache, and one is the same as itself"
    low = Heights(np.zeros(3))
    high = Heights(np.ones(3))
    assert low != high
    assert {low: "low", high: "high"}[low] == "low"
    assert np.array_equal(high[1:].height, np.ones(2))


def test_columns_of_unlike_lengths_make_no_record():
    """Three points with one time are no cloud: all three would move by that one."""
    with pytest.raises(ValueError, match=r"PointCloud .*\(xyz 3, gps_time 1, intensity 3\)"):
        PointCloud(np.zeros((3, 3)), np.zeros(1), np.zeros(3))

"""The pulses behind rows are found, all of them and no others."""

import numpy as np

from tests.beds.gap_surveys import beams_of


def test_all_pulses_are_found_again(case):
    "Each row has its looks, and a patch the points that it had, up to the limit"
    _, _, rows, beams = case
    assert set(beams.item) == set(rows.item)
    assert beams.second.sum() == (rows.channel == "shared").sum() > 50
    number = np.bincount(beams.view)
    first = np.flatnonzero((beams.target < 0) & ~beams.second)
    of = {item: number[look] for item, look in zip(beams.item[first], first, strict=True)}
    rough = np.flatnonzero(rows.channel == "roughness")
    found = np.array([of[item] for item in rows.item[rough]])
    wanted = np.minimum(rows.points[rough], 400)
    assert np.mean(np.abs(found / wanted - 1) < 0.01) > 0.95


def test_beams_are_of_the_rows_alone(case):
    "Of one patch of the first pass, nothing is in the second file"
    survey, read, rows, _ = case
    first = np.flatnonzero((rows.channel == "roughness") & (rows.covariates["pass"] == 1.0))[:1]
    beams = beams_of(survey, rows.select(first), read)
    assert set(beams.item) == set(rows.item[first])

"""Location of most of the gap, in a sentence."""

from dataclasses import replace

import numpy as np
import pytest

from mlscorr.effects import EFFECTS
from mlscorr.gap.evidence import Split, Where
from mlscorr.gap.evidence.where import SPLITS, Extent
from mlscorr.gap.wording import ACTS_ON, headline

START = 413200.0  # s


def split(by, low, high, share=0.2, rows=0.2):
    "Eight bins alike, and the range in which a cause acts"
    edges = np.linspace(low, high, 9)
    alike = np.full(8, 0.125)
    band = np.tile([-3.0, 4.0], (8, 1))
    extent = Extent(low, high, share, rows)
    names = tuple("abcdefgh")
    return Split(by, edges, names, np.full(8, 50), np.ones(8), np.ones(8), alike, band, extent)


def where(*splits, before=17.0):
    none = np.zeros(0)
    empty = np.zeros((0, 2))
    return Where(before, 0.1, (-3.0, 4.0), splits, none, none, empty, none)


BRIGHT = split("intensity", 4.239, 4.653, share=0.48, rows=0.1)
FAST = split("speed", 8.0, 12.0, share=0.4, rows=0.15)


def test_a_cause_is_located_by_what_it_acts_on():
    "A clock offset acts on speed, 40 % there: that 48 % happen to be bright says nothing"
    said = headline(where(BRIGHT, FAST), "time_offset", "", START)
    assert said.startswith("40 % of the effect of the cause is at speeds of 8.0 m/s to 12 m/s")
    assert (
        "with 15 % of the residuals. The residuals together differ from the simulation by 17.0 mm"
    ) in said


def test_brightness_is_stated_in_counts_where_it_matters():
    "Range walk acts on the received intensity: 10^4.239 is 17338 counts"
    said = headline(where(BRIGHT, FAST), "range_walk", "", START)
    assert "at intensities of 17338 to 44978 (16 bits), with 10 %" in said


def test_a_time_is_that_of_the_survey():
    "A passing error from 9.3 s after the start is told in gps_time"
    passing = split("time", 9.3, 40.5, share=0.89, rows=0.5)
    said = headline(where(BRIGHT, passing), "position_bump", "", START)
    assert "between gps_time 413209.3 s and 413240.5 s, with 50 %" in said


def test_an_unknown_error_is_located_by_what_it_looks_like():
    "By speed if it grows with speed; otherwise by the bins that exceed their null band"
    hint = "height error that grows with speed squared"
    assert "at speeds of 8.0" in headline(where(BRIGHT, FAST), "unknown", hint, START)
    said = headline(where(BRIGHT, FAST), "an_effect_of_mine", "", START)
    assert said.startswith("No part of the survey is conspicuous.")
    loud = replace(FAST, before=np.full(8, 9.0), share=np.array([0.65, *[0.05] * 7]))
    assert "65 % of the effect of the cause is at speeds of 8.0 m/s to 8.5 m/s" in headline(
        where(BRIGHT, loud), "an_effect_of_mine", "", START
    )


@pytest.mark.parametrize(
    ("before", "words"),
    [(2.0, "There is no significant difference."), (9.0, "No part of the survey is conspicuous.")],
)
def test_without_a_cause_only_what_exceeds_chance_is_located(before, words):
    "Bins within their null bands are no place, whatever their share is"
    assert headline(where(BRIGHT, FAST, before=before), "none", "", START).startswith(words)


def test_each_effect_acts_on_something_that_a_survey_shows():
    "Every effect of the library has its covariates, and all of them are splits of the gap"
    assert set(ACTS_ON) == {kind.name for kind in EFFECTS}
    assert {by for covariates in ACTS_ON.values() for by in covariates} <= set(SPLITS)

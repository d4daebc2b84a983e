"""Summary of a survey in a notebook: its parts and their sizes in a few words."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from mlscorr.survey import Matched, Summary, Survey
from mlscorr.survey.summary import html_table
from mlscorr.wording import counted
from tests.beds.tied_passes import tied_passes


@dataclass(frozen=True, repr=False)
class Part(Summary):
    "Some fields of each kind"

    name: str
    vector: np.ndarray
    table: np.ndarray
    rows: object
    words: tuple
    sentence: str


def test_arrays_show_their_sizes_and_short_values_themselves():
    "Three numbers are shown, a table by its shape, long tuples by their number, long texts by type"
    part = Part("T1", np.zeros(3), np.zeros((5, 2)), None, ("word",) * 20, "long " * 20)
    assert repr(part) == (
        "Part(name='T1', vector=array([0., 0., 0.]), table=array (5, 2), rows=None, "
        "words=tuple of 20, sentence=str)"
    )


def test_a_survey_of_a_million_epochs_shows_in_a_line():
    "The repr of nouns does not grow with what they hold"
    survey = tied_passes(1)
    for value in (survey.trajectory, survey.ties, survey.matched):
        assert len(repr(value)) < 250
    assert repr(survey.ties) == f"Ties({len(survey.ties)} rows)"
    assert f"gps_time=array ({len(survey.trajectory.gps_time)},)" in repr(survey.trajectory)


def test_a_notebook_shows_a_survey_as_a_short_table():
    "Name, coordinates, clouds, trajectory, points and mounting; names from files can do no harm"
    nothing = Matched.none().surveyed
    trajectory = tied_passes(1).trajectory
    survey = Survey("<script>", Path("survey.toml"), None, (), trajectory, None, nothing, nothing)
    shown = survey._repr_html_()
    assert "&lt;script&gt;" in shown and "<script>" not in shown
    assert "control and" in shown and len(shown) < 1000


def test_a_sentence_covers_all_columns():
    "A row of one cell is as wide as the table"
    shown = html_table("Gap", [("One & all",), ("a", 1, None)])
    assert '<td colspan="3">One &amp; all</td>' in shown
    assert "<td>a</td><td>1</td><td>None</td>" in shown


@pytest.mark.parametrize(
    ("noun", "several"),
    [
        ("pass", "passes"),
        ("cloud file", "cloud files"),
        ("entry", "entries"),
        ("gap", "gaps"),
    ],
)
def test_one_thing_is_counted_in_the_singular(noun, several):
    "None and two are in the plural"
    assert [counted(n, noun) for n in range(3)] == [f"0 {several}", f"1 {noun}", f"2 {several}"]

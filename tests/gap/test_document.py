"""Contents of gap.json on a survey, its effects and their separability."""

import json
from dataclasses import replace

import numpy as np
import pytest
from gap_training import features

from mlscorr.effects import effect_class, make_effect
from mlscorr.gap import map_document, separability_document, windows_document
from mlscorr.gap.advice import distinct_parameters
from mlscorr.gap.evidence import Cause, CauseParameter, Separability
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.signatures import signatures


def test_separability_is_told_in_plain_numbers():
    "Two parameters of correlation 0.96 are one class; biases are 4.13 sigmas"
    normal = np.array([[4.0, 4.8, 0.0], [4.8, 6.25, 0.0], [0.0, 0.0, 1.0]])
    effects = ("range_bias", "vertical_datum", "time_offset")
    content = separability_document(Separability(effects, effects, ("m", "m", "s"), normal))
    assert content["classes"] == [["range_bias", "vertical_datum"]]
    assert content["correlation"]["matrix"][0][1] == pytest.approx(0.96)
    (part,) = content["detectable"]["range_bias"]
    assert (part["unit"], part["detectable"]) == ("m", pytest.approx(4.13 / 2))
    json.dumps(content)


def test_the_map_holds_the_way_and_all_targets():
    "At most twice 1500 epochs, and each target with its role"
    survey = features.geometry(3, targets=6, patches=0, rough=False).survey
    content = map_document(survey)
    assert len(content["trajectory"]) <= 3000
    assert np.allclose(content["trajectory"][0], survey.trajectory.position[0, :2], atol=0.01)
    assert [(t["name"], t["role"]) for t in content["targets"]] == [
        (name, "control") for name in survey.control.name
    ]


def test_an_event_is_told_no_farther_than_the_drive_reaches():
    "An error of an hour about a drive of minutes says nothing of the time before and after it"
    survey = features.geometry(3, targets=6, patches=0, rough=False).survey
    first, last = survey.trajectory.gps_time[[0, -1]]
    model = replace(STATED, windows=((first - 1800.0, 3600.0 + last - first, 2.0, "rise"),))
    cause = Cause("position_noise", 1.0, (), (), np.zeros(6), model=model)
    (window,) = windows_document(cause, survey)
    assert (window["start"], window["end"]) == (first, last)
    assert cause.intervals(survey.trajectory) == (("position_noise", first, last),)


def test_an_effect_is_told_as_a_scenario_names_it():
    "Name and parameters, which make the same effect again"
    effect = make_effect("position_bump", magnitude=[0.1, 0.0, -0.2], time=5.0, width=3.0)
    content = effect.document()
    assert make_effect(content.pop("name"), **content) == effect


def test_sizes_of_an_effect_and_of_noise_have_names_of_their_own():
    "A clock offset beside range noise has two magnitudes: each is told with its effect's name"
    g = features.geometry(3, targets=6, patches=20)
    kinds = [effect_class(name) for name in ("time_offset", "range_noise")]
    late, noisy = signatures(g.rows, g.survey, kinds)[0]
    sizes = CauseParameter("magnitude", "s", 0.005), CauseParameter("magnitude", "m", 0.02)
    parts = (late, np.array([0.005])), (noisy, np.array([0.02]))
    cause = Cause("time_offset+range_noise", 0.9, sizes, parts, np.zeros(len(g.rows)))
    told = [vars(parameter) for parameter in distinct_parameters(cause)]
    assert [row["name"] for row in told] == ["time_offset magnitude", "range_noise magnitude"]
    assert [(row["unit"], row["estimate"]) for row in told] == [("s", 0.005), ("m", 0.02)]
    alone = Cause("time_offset", 0.9, sizes[:1], parts[:1], np.zeros(len(g.rows)))
    assert distinct_parameters(alone) == sizes[:1]


def test_times_of_two_events_have_names_of_their_own():
    "A step beside a bump has two times: each is told with its effect's name, the width as it is"
    g = features.geometry(3, targets=6, patches=20)
    kinds = [effect_class(name) for name in ("position_step", "position_bump")]
    events = signatures(g.rows, g.survey, kinds)[0]
    step, bump = (next(each for each in events if each.name == kind.name) for kind in kinds)
    times = CauseParameter("time", "s", 3.0), CauseParameter("time", "s", 5.0)
    moment = (*times, CauseParameter("width", "s", 2.0))
    parts = (step, np.zeros(3)), (bump, np.zeros(3))
    cause = Cause("position_step+position_bump", 0.9, moment, parts, np.zeros(len(g.rows)))
    told = [vars(parameter) for parameter in distinct_parameters(cause)]
    assert [row["name"] for row in told] == ["position_step time", "position_bump time", "width"]

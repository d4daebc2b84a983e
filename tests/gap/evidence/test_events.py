"""Events between the times of the bank."""

import numpy as np
import pytest

from mlscorr.effects import make_effect
from mlscorr.gap.evidence import SETTINGS, infer_causes, weigh_labels
from mlscorr.gap.evidence.evidence import weigh_blocks
from mlscorr.gap.signatures import signatures
from tests.gap.inference import surveyed


@pytest.mark.long
def test_an_event_is_found_between_the_times_of_the_bank(with_surface):
    "Time within 1 s, width within 30 %, size within four sigmas"
    g, signs = with_surface
    effect = make_effect("position_bump", magnitude=[0.3, 0.2, -0.3], time=31.7, width=8.0)
    rows = surveyed(g, 32, effect)
    best = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).causes[0]
    assert best.effect == "position_bump"
    told = {parameter.name: parameter for parameter in best.parameters}
    assert told["time"].estimate == pytest.approx(31.7, abs=1.0)
    assert told["width"].estimate == pytest.approx(8.0, rel=0.3)
    for name, true in zip(("easting", "northing", "height"), effect.magnitude, strict=True):
        assert abs(told[name].estimate - true) < 4 * told[name].sigma


@pytest.mark.long
def test_an_event_beside_an_effect_is_found_when_it_acts(with_surface):
    "Within 3 s, where it can be known to 1.3 s; alone it would best explain what the other does"
    g, signs = with_surface
    event = make_effect("position_bump", magnitude=[0.18, 0.12, -0.18], time=31.7, width=8.0)
    rows = surveyed(g, 32, event, make_effect("range_bias", magnitude=0.05))
    best = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20).causes[0]
    assert set(best.effect.split("+")) == {"position_bump", "range_bias"}
    part = next(part for part, _ in best.parts if part.name == "position_bump")
    assert part.fixed["time"] == pytest.approx(31.7, abs=3.0)
    assert part.fixed["width"] == pytest.approx(8.0, rel=0.3)


@pytest.mark.parametrize("seed", range(4))
def test_a_refined_event_counts_over_none_as_all_models_have_it(study, seed):
    "Its log evidence is within 1 of that by all models: those that suit it best may hide none"
    g = study.geometry(5, targets=15, passes=1, patches=0)
    signs = signatures(g.rows, g.survey)[0]
    rows = surveyed(g, seed, make_effect("vertical_datum", magnitude=0.3))
    evidence = weigh_labels(rows, g.background, g.survey, signs, np.random.default_rng(1), 0)
    residual = evidence.observations.columns(rows.residual[:, None])
    assert evidence.refined
    for event in evidence.refined.values():
        models = evidence.blocks.models
        gain = weigh_blocks(evidence.observations, models, residual, event.table).gain
        by_all = np.logaddexp.reduce(event.table.weighed(gain)[:, 0])
        members = [s for s in signs if s.name == event.signature.name]
        expected = by_all - np.log(len(members) * SETTINGS.event_cell)
        assert event.gain == pytest.approx(expected, abs=1.0)


@pytest.mark.long
@pytest.mark.parametrize("time", [18.4, 27.3])
@pytest.mark.parametrize("size", [0.4, 1.0])
def test_a_jump_is_found_between_the_rows_next_to_it(with_surface, time, size):
    "To three sigmas, and alone: at a wrong time a second cause would explain what is left"
    g, signs = with_surface
    rows = surveyed(g, 32, make_effect("position_step", magnitude=[size, 0.0, 0.0], time=time))
    inference = infer_causes(rows, g.background, g.survey, signs, np.random.default_rng(1), 20)
    assert inference.verdict.label == "position_step"
    moment = next(p for p in inference.cause.parameters if p.name == "time")
    assert abs(moment.estimate - time) < 3 * moment.sigma < 3.0


@pytest.mark.parametrize("seed", [32, 34, 35])
def test_a_drift_of_metres_is_told_to_its_sigma(with_surface, seed):
    "Time and width of a bump of 3 m, to three sigmas of less than 0.2 s; whole steps would miss it"
    g, signs = with_surface
    shape = {"magnitude": [3.0, 0.0, 0.0], "time": 31.7, "width": 8.0}
    rows = surveyed(g, seed, make_effect("position_bump", **shape))
    evidence = weigh_labels(rows, g.background, g.survey, signs, np.random.default_rng(1), 0)
    event = evidence.refined["position_bump"]
    for key in ("time", "width"):
        assert abs(event.signature.fixed[key] - shape[key]) < 3 * event.sigma[key] < 0.6

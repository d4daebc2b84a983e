"""Effects that a geometry can separate."""

import numpy as np
import pytest

from mlscorr.effects import EFFECTS
from mlscorr.gap.evidence import SETTINGS, Observations, compare_signatures
from mlscorr.gap.evidence.observations import STATED
from mlscorr.gap.plan import next_data
from mlscorr.gap.signatures import signatures
from tests.gap.inference import dense


def test_detectable_biases_are_those_of_baarda(with_surface):
    "4.13 sigmas of a parameter alone: 80 % power at 0.1 % significance"
    g, signs = with_surface
    observed = Observations.of(g.rows, g.background)
    compared = compare_signatures(observed, signs)
    one = next(s for s in signs if s.name == "range_bias")
    column = one.jacobian[g.rows.metric, 0]
    sigma = 1 / np.sqrt(column @ np.linalg.solve(dense(g, STATED), column))
    told = compared.detectable[compared.names.index("range_bias")]
    assert told == pytest.approx(SETTINGS.detectable * sigma, rel=1e-6)


def test_targets_alone_confuse_a_datum_with_a_lever_arm_and_more_speed_does_not_help(study):
    "One class by its squared correlation; what is next to measure tells the two apart"
    g = study.geometry(6, targets=24, patches=0)
    signs, _ = signatures(g.rows, g.survey)
    compared = compare_signatures(Observations.of(g.rows, g.background), signs)
    assert any({"lever_arm", "vertical_datum"} <= set(names) for names in compared.classes)
    assert "vertical_datum" in compared.same("lever_arm", [0.0, 0.0, 0.1])
    for one in next_data(g.rows, g.survey, EFFECTS, ("time_offset", "clock_drift"), compared):
        assert one.after < one.before
        assert "scanner clock offset and scanner clock drift" in one.why

"""Surveys of features with an effect, whose gap is to be closed."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from gap_mechanisms import ACTUAL
from gap_training import features

from mlscorr.gap.closure import FoundCause, close_gap
from mlscorr.gap.closure.folds import make_folds, predict_whole
from mlscorr.gap.evidence import Observations, cause_of, weigh_labels
from mlscorr.gap.residuals import background
from mlscorr.gap.signatures import expected, signatures
from tests.gap.inference import surveyed


def noise_of_positions(g, effect, rng):
    "Noise of rows of one time (m,) that follows from noise of the recorded positions"
    trajectory = g.survey.trajectory
    rows = g.rows
    moved = effect.apply(trajectory, rows.reference, rng).position - trajectory.position
    at_rows = [np.interp(rows.gps_time, trajectory.gps_time, axis) for axis in moved.T]
    return np.einsum("mi,im->m", rows.partials[:, :3], at_rows)


KINDS = ("time_offset", "range_bias", "lever_arm", "position_bump", "position_noise", "dropout")


class Bed:
    "Two passes, 24 targets and 80 patches with an effect; every seventh row is a check point's"

    def __init__(self, *effects):
        g = features.geometry(3, targets=24, patches=80)
        fixed = [effect for effect in effects if not effect.random]
        self.rows = surveyed(g, 31, *fixed)
        self.survey = g.survey
        self.effects = effects
        for effect in effects[len(fixed) :]:
            if effect.name == "dropout":
                moved = -effect.magnitude * (self.rows.channel == "return_rate")
            else:
                moved = noise_of_positions(g, effect, np.random.default_rng(7))
            self.rows = replace(self.rows, residual=self.rows.residual + moved)
        signs, _ = signatures(self.rows, self.survey)
        self.signs = tuple(sign for sign in signs if sign.name in KINDS)
        self.used = np.arange(len(self.rows)) % 7 != 0
        rng = np.random.default_rng(0)
        self.evidence = weigh_labels(self.rows, g.background, g.survey, self.signs, rng, 0)

    def cause(self, label):
        return cause_of(self.rows, self.signs, self.evidence, label, 1.0)

    def simulated(self, effects):
        return expected(self.rows, self.survey, effects).shift

    @cached_property
    def observations(self):
        return Observations.of(self.rows, background(self.rows, self.survey))

    def found(self, cause):
        return FoundCause(self.rows, self.used, self.survey, self.signs, self.evidence, cause)

    def whitened(self, shift):
        "Square of a shift (m,) in the metric of the drift that was made"
        observed = self.observations
        white = observed.whitener(ACTUAL).whiten(observed.columns(shift[:, None]))
        return float(white.squares[0])

    def close(self, label, simulated=None):
        simulated = simulated or self.simulated
        rng = np.random.default_rng(2)
        return close_gap(self.found(self.cause(label)), simulated, rng)

    def folds(self, cause, simulated=None, progress=None):
        simulated = simulated or self.simulated
        rng = np.random.default_rng(2)
        model = self.evidence.likely_model(cause.effect)
        case = self.found(cause)
        whole = predict_whole(case, simulated)
        return make_folds(case, whole, self.observations, model, simulated, rng, progress)

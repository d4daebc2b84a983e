"""Surveys of features with an effect, whose gap is to be closed."""

import gap_features
import numpy as np

from mlscorr.gap.close.closure import close_gap
from mlscorr.gap.close.folds import make_folds
from mlscorr.gap.infer.causes import cause_of
from mlscorr.gap.infer.labels import weigh_labels
from mlscorr.gap.signatures.expectation import expected
from mlscorr.gap.signatures.signatures import signatures
from tests.beds.gap_inference import surveyed

KINDS = ("time_offset", "range_bias", "lever_arm", "position_bump", "position_noise")


class Bed:
    "Two passes, 24 targets and 80 patches with an effect; every seventh row is a check point's"

    def __init__(self, *effects):
        g = gap_features.geometry(3, targets=24, patches=80)
        self.rows, self.survey = surveyed(g, 31, *effects), g.survey
        signs, _ = signatures(self.rows, self.survey)
        self.signs = tuple(sign for sign in signs if sign.name in KINDS)
        self.used = np.arange(len(self.rows)) % 7 != 0
        rng = np.random.default_rng(0)
        self.evidence = weigh_labels(self.rows, g.background, g.survey, self.signs, rng, 0)

    def cause(self, label):
        return cause_of(self.rows, self.signs, self.evidence, label, 1.0)

    def simulated(self, effects):
        return expected(self.rows, self.survey, effects).shift

    def arguments(self, cause):
        rng = np.random.default_rng(2)
        return self.rows, self.used, self.survey, self.signs, cause, self.simulated, rng

    def close(self, label):
        rows, used, survey, signs, cause, simulated, rng = self.arguments(self.cause(label))
        return close_gap(rows, used, survey, signs, self.evidence, cause, simulated, rng)

    def folds(self, cause):
        rows, used, survey, signs, cause, simulated, rng = self.arguments(cause)
        return make_folds(rows, used, survey, signs, cause, False, simulated, rng)

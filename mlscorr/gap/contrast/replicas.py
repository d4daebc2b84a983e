"""Innovations of replicas of a survey: what they are like when the simulator is right."""

import numpy as np

from mlscorr.gap.contrast._settings import SETTINGS
from mlscorr.gap.evidence import Inference, Observations
from mlscorr.gap.residuals import Background, Rows


def replica_innovations(
    rows: Rows, background: Background, inference: Inference, rng: np.random.Generator
) -> np.ndarray:
    """Innovations (n, replicas) of surveys in which nothing acts.

    Their POS errs, and their noise has tails, as this one's do once its cause is taken off.

    Parameters
    ----------
    rows : Rows
    background : Background
        Of these.
    inference : Inference
        Of these; n is the number of its innovations.
    rng : numpy.random.Generator
    """
    observed = Observations.of(rows, background)
    model = inference.evidence.likely_model(inference.verdict.label)
    drawn = observed.whitener(model).draw(rng, SETTINGS.halves, inference.where.innovation[:, 1])
    return observed.whitener().innovations(drawn)[0][observed.second]

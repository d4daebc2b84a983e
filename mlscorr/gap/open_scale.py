"""Scale of a default POS sigma that nobody stated, estimated from the survey.

The inference averages over scales around a stated sigma, with a prior that is too narrow for a
default: a POS of another grade would resemble noise, or like something unknown. For a default, the
scale with the most probable residuals is therefore used. Any cause is allowed, so that an effect is
not mistaken for drift, except those that a larger sigma describes better: errors of the POS itself,
and unknown ones. The scale is at least one: too large a default hides small errors, but makes no
false claims.
"""

from dataclasses import replace

import numpy as np

from mlscorr.gap.evidence import weigh_labels
from mlscorr.gap.residuals import Rows, background
from mlscorr.gap.signatures import Signature
from mlscorr.pos import SETTINGS as POS
from mlscorr.survey import Pos, Survey

SIGMAS = ("position_sigma", "attitude_sigma")
STEP = float(np.sqrt(max(POS.process_scales) / min(POS.process_scales)))
# between scales: half of the averaging width of the inference, so that these overlap
LEAST_GAIN = 1.0
# log evidence required for a scale: less is not worth a mention (Kass, Raftery 1995)


def open_sigmas(survey: Survey) -> tuple[str, ...]:
    """Names of the SIGMAS that nobody stated.

    Parameters
    ----------
    survey : Survey
    """
    assumed = {assumption.key for assumption in survey.assumed_pos}
    return tuple(name for name in SIGMAS if f"pos.{name}" in assumed)


def with_scale(pos: Pos, scale: float, names: tuple[str, ...]) -> Pos:
    """Return a POS with scaled sigmas, whose windows keep their errors.

    Parameters
    ----------
    pos : Pos
    scale : float
        Scale on the sigmas.
    names : tuple of str
        Scaled ones of SIGMAS.
    """
    scaled = {name: scale * getattr(pos, name) for name in names}
    windows = pos.windows
    if "position_sigma" in names:
        windows = tuple((start, time, f / scale, shape) for start, time, f, shape in windows)
    return replace(pos, windows=windows, **scaled)


def likely_scale(
    rows: Rows, survey: Survey, signatures: tuple[Signature, ...], rng: np.random.Generator
) -> float:
    """Scale on assumed sigmas with the most probable residuals.

    The search goes upward from one, as long as a step is worthwhile.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        With the simulator's assumptions.
    signatures : tuple of Signature
        Of the rows.
    rng : numpy.random.Generator
    """
    names = open_sigmas(survey)
    others = {sign.name for sign in signatures if sign.kind.stage != "pos"}

    def evidence(scale):
        rescaled = replace(survey, pos=with_scale(survey.pos, scale, names))
        given = rows, background(rows, rescaled), rescaled, signatures
        labels = weigh_labels(*given, rng, replicas=0)
        scores = [score[0] for name, score in labels.score.items() if name in others | {"none"}]
        return labels.blocks.total[0] + np.logaddexp.reduce(scores)

    if not names:
        return 1.0
    scale = 1.0
    best = evidence(scale)
    while (tried := evidence(scale * STEP)) > best + LEAST_GAIN:
        scale *= STEP
        best = tried
    return scale

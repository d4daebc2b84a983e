"""Scale of the default sigma of a POS whose sigma nobody stated, estimated from the survey.

The inference averages over scales about a stated sigma, within a prior that a default does not
deserve: a POS of another grade would look like noise, or like something unknown. So where a
default stands in, its scale is the one under which the residuals are most probable. They may have
any cause, so that an effect is not taken for drift, but for those that a larger sigma is the plain
word for: what the POS itself does, and what is unknown. It is one at least: a default that is too
large hides small errors, but makes no claim.
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
# from one scale to the next: half of what the inference averages over, so that these overlap
LEAST_GAIN = 1.0
# log evidence by which a scale must be better: less is not worth a mention (Kass, Raftery 1995)


def open_sigmas(survey: Survey) -> tuple[str, ...]:
    """Names of the SIGMAS that nobody stated.

    Parameters
    ----------
    survey : Survey
    """
    assumed = {assumption.key for assumption in survey.assumed_pos}
    return tuple(name for name in SIGMAS if f"pos.{name}" in assumed)


def with_scale(pos: Pos, scale: float, names: tuple[str, ...]) -> Pos:
    """A POS of other sigmas, whose windows err as much as before.

    Parameters
    ----------
    pos : Pos
    scale : float
        On the sigmas.
    names : tuple of str
        Of SIGMAS: those that it is on.
    """
    scaled = {name: scale * getattr(pos, name) for name in names}
    windows = pos.windows
    if "position_sigma" in names:
        windows = tuple((start, time, f / scale, shape) for start, time, f, shape in windows)
    return replace(pos, windows=windows, **scaled)


def likely_scale(
    rows: Rows, survey: Survey, signatures: tuple[Signature, ...], rng: np.random.Generator
) -> float:
    """The scale on assumed sigmas under which residuals are most probable.

    It is looked for upwards from one, as long as that is worth a step.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        As believed.
    signatures : tuple of Signature
        Of the rows.
    rng : numpy.random.Generator
    """
    names = open_sigmas(survey)
    others = {sign.name for sign in signatures if sign.kind.stage != "pos"}

    def evidence(scale):
        believed = replace(survey, pos=with_scale(survey.pos, scale, names))
        given = rows, background(rows, believed), believed, signatures
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

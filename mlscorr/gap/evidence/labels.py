"""All labels weighed: none, each effect, noise and unknown, in a survey and in replicas of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.evidence._error_models import ErrorModel, error_models, shares
from mlscorr.gap.evidence._events import RefinedEvent, refine_events
from mlscorr.gap.evidence._noise import NoiseEvidence, draw_channels, weigh_noise
from mlscorr.gap.evidence._windows import weigh_windows
from mlscorr.gap.evidence.columns import ColumnTable, column_table
from mlscorr.gap.evidence.evidence import (
    BlockEvidence,
    steady_columns,
    suited_models,
    weigh_blocks,
    without_known,
)
from mlscorr.gap.evidence.observations import Observations, model_likelihood
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.tails import without_tails
from mlscorr.gap.evidence.unknown import unknown_blocks
from mlscorr.gap.residuals import Background, Rows
from mlscorr.gap.signatures import Signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class LabelEvidence:
    """What was compared, and how likely each label made it.

    Parameters
    ----------
    observations : Observations
    table : ColumnTable
    leads : tuple of str
        What each of the unknown blocks says in words.
    blocks : BlockEvidence
        Of the residuals (first column) and of replicas without any effect.
    noise : tuple of NoiseEvidence
    refined : dict of RefinedEvent
        Events that stand out, by label: their own, or that of the pair in which they do.
    score : dict
        Log of prior times evidence over that of none, (k,) for each label; none is there too.
    p_value : float
        Of none.
    tail : (o,) int array
        Rows taken for a tail of the noise.
    """

    observations: Observations
    table: ColumnTable
    leads: tuple[str, ...]
    blocks: BlockEvidence
    noise: tuple[NoiseEvidence, ...]
    refined: dict[str, RefinedEvent]
    score: dict[str, np.ndarray]
    p_value: float
    tail: np.ndarray

    @property
    def noisy(self) -> set[str]:
        """Labels of noise classes."""
        return {each.label for each in self.noise}

    def best(self, label: str) -> int:
        """Number of the block of a label that explains the residuals best."""
        return self.table.best(label, self.blocks.gain[:, 0])

    def event(self, name: str, label: str) -> RefinedEvent | None:
        """The event of a name that is, or is part of, a label; None if it doesn't stand out."""
        known = (self.refined.get(key) for key in (label, name))
        return next((each for each in known if each and each.signature.name == name), None)

    def lead(self) -> tuple[str, np.ndarray]:
        """What the best of the unknown blocks says in words, and its column numbers."""
        block = self.table.blocks[self.best("unknown")]
        return self.leads[block.member], block.columns

    def likely_model(self, label: str) -> ErrorModel:
        """The ErrorModel that is most probable when a label, or the first of two, acts."""
        name = label.split("+", maxsplit=1)[0]
        score = self.blocks.none[:, 0]
        if name in self.table.labels:
            score = self.blocks.by_model[:, self.table.of(name)].max(axis=1)
        return self.blocks.models[int(np.argmax(score))]


# Hundreds of products of small matrices: threads of BLAS wait for each other longer than they work.
@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_labels(
    rows: Rows,
    background: Background,
    survey: Survey,
    signatures: Sequence[Signature],
    rng: np.random.Generator,
    replicas: int = SETTINGS.replicas,
) -> LabelEvidence:
    """Evidence of all labels for the residuals of a survey and for replicas of it.

    Parameters
    ----------
    rows : Rows
    background : Background
    survey : Survey
    signatures : sequence of Signature
    rng : numpy.random.Generator
    replicas : int
        Surveys of the same geometry in which nothing acts.

    Raises
    ------
    ValueError
        When no row has a residual in m, or a sigma is zero.
    """
    observations = Observations.of(rows, background)
    unknown = unknown_blocks(rows, survey)
    table = column_table(rows, signatures, unknown, observations.sigma)
    leads = tuple(block.lead for block in unknown)
    del unknown  # their columns are in the table
    table = without_known(observations, table)
    observations, tail = without_tails(observations, rows, steady_columns(observations, table))
    residual = observations.columns(rows.residual[:, None])
    models = suited_models(observations, table, error_models(), residual)
    residual = np.hstack([residual, _replicas(observations, models, residual, rng, replicas)])
    blocks = weigh_blocks(observations, models, residual, table)
    channels = draw_channels(rows, rng, replicas)
    noise = weigh_noise(observations, rows, signatures, blocks, residual, channels)
    noise += weigh_windows(observations, signatures, blocks, residual, residual[:, :0])
    score = _scores(table, blocks, noise)
    p = p_value(score)  # before events are refined, as those of replicas are not
    refined = refine_events(rows, survey, observations, table, blocks, signatures)
    for label, event in refined.items():
        prior = np.log(dict(SETTINGS.prior)["effect"] / len(table.effects))
        score[label][0] = np.logaddexp(score[label][0], prior + event.gain)
    return LabelEvidence(observations, table, leads, blocks, noise, refined, score, p, tail)


def _replicas(observations, models, residual, rng, number):
    """Residuals (n, number) in which nothing acts, under models as probable as they are, with
    tails as these have.
    """
    score = np.array([model_likelihood(observations, model, residual)[0] for model in models])
    count = rng.multinomial(number, shares(score))
    best = observations.whitener(models[int(np.argmax(score))])
    tails = best.innovations(residual)[0][:, 0]
    replicas = [
        observations.whitener(model).draw(rng, times, tails)
        for model, times in zip(models, count, strict=True)
    ]
    return np.hstack(replicas)


def _scores(table, blocks, noise):
    """Log of prior times evidence, over the evidence of none, for each label: (k,) each."""
    prior = dict(SETTINGS.prior)
    scores = {"none": np.full(blocks.none.shape[1], np.log(prior["none"]))}
    scores |= block_scores(table, blocks, prior["effect"] / max(1, len(table.effects)), prior)
    return scores | noise_scores(noise, prior)


def block_scores(
    table: ColumnTable, blocks: BlockEvidence, effect: float, prior: dict[str, float]
) -> dict[str, np.ndarray]:
    """Log of prior times evidence, over that of none, of each label of a table: (k,) each.

    Parameters
    ----------
    table : ColumnTable
    blocks : BlockEvidence
    effect : float
        Prior probability of each effect.
    prior : dict
        Holds that of unknown.
    """
    weighed = table.weighed(blocks.gain)
    return {
        label: np.log(prior["unknown"] if label == "unknown" else effect)
        + np.logaddexp.reduce(weighed[table.of(label)], axis=0)
        for label in table.labels
    }


def noise_scores(noise: Sequence[NoiseEvidence], prior: dict[str, float]) -> dict[str, np.ndarray]:
    """Scores of noise classes, which share their prior evenly; several of one are averaged.

    Parameters
    ----------
    noise : sequence of NoiseEvidence
    prior : dict
        Holds that of noise.
    """
    labels = list(dict.fromkeys(each.label for each in noise))
    scores = {}
    for label in labels:
        gain = [each.gain for each in noise if each.label == label]
        mean = np.logaddexp.reduce(gain, axis=0) - np.log(len(gain))
        scores[label] = np.log(prior["noise"] / len(labels)) + mean
    return scores


def p_value(score: dict[str, np.ndarray]) -> float:
    """Probability of scores against none as high as the first column's when nothing acts.

    By replicas; beyond the highest ones by the exponential tail that the upper fifth of them has.

    Parameters
    ----------
    score : dict of (1 + k,) arrays
        By label, none among them.
    """
    against = [values for label, values in score.items() if label != "none"]
    against = np.logaddexp.reduce(against, axis=0)
    observed = against[0]
    replicas = np.sort(against[1:])
    if len(replicas) == 0:
        return float("nan")
    upper = replicas[int(0.8 * len(replicas)) :]
    if observed <= upper[0] or len(upper) < 3:
        return float((1 + (replicas >= observed).sum()) / (1 + len(replicas)))
    scale = max(upper.mean() - upper[0], 0.5)
    return float(len(upper) / len(replicas) * np.exp(-(observed - upper[0]) / scale))

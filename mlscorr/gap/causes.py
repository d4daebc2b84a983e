"""Causes with their parameters, and the whole inference in one call."""

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.background import BELIEVED, Setting, settings
from mlscorr.gap.bursts import BurstEvidence
from mlscorr.gap.estimate import DETECTABLE, Parameter, fit
from mlscorr.gap.separability import Separability, separability
from mlscorr.gap.verdict import (
    REPLICAS,
    Found,
    Verdict,
    best_lead,
    compare,
    member,
    pairs,
    verdict,
)
from mlscorr.gap.weighing import likelihood
from mlscorr.gap.where import Where, locate

TOLD = 6  # causes that are reported at least, best first
LEAST = 0.005  # probability from which on others are, too
WINDOW = ("start", "length", "largest sigma over the stated")  # of a POS that is worse in it
EVENT = ("time", "width")  # what an event has besides its size


@dataclass(frozen=True)
class Cause:
    """One label with what it says in numbers.

    Parameters
    ----------
    effect : str
        The label.
    probability : float
    parameters : tuple of Parameter
    parts : tuple of (Signature, (p,) array)
        What to put into the simulator: signature.effect(estimate) is the Effect.
    shift : (m,) array
        What it makes of the residuals.
    extra : (m,) array or None
        Variance that it adds to the rows' own noise.
    setting : Setting
        Of the POS's covariance with it.
    """

    effect: str
    probability: float
    parameters: tuple[Parameter, ...]
    parts: tuple
    shift: np.ndarray
    extra: np.ndarray | None
    setting: Setting

    @property
    def effects(self):
        """Effects for the simulator. Raises ValueError for a size that no survey can have."""
        return tuple(one.effect(estimate) for one, estimate in self.parts)


@dataclass(frozen=True)
class Inference:
    """All that the rows say.

    Parameters
    ----------
    verdict : Verdict
    causes : tuple of Cause
        Best first.
    same : tuple of str
        Effects that this survey can't tell apart from the label at the size that it has.
    where : Where
    separability : Separability
    probability : dict
        Of every label that was weighed, most probable first.
    found : Found
        What was compared.
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    same: tuple[str, ...]
    where: Where
    separability: Separability
    probability: dict[str, float]
    found: Found

    @property
    def cause(self):
        """The Cause of the verdict."""
        return next(one for one in self.causes if one.effect == self.verdict.label)


@threadpool_limits.wrap(limits=1, user_api="blas")
def infer(rows, background, survey, signatures, rng, replicas=REPLICAS):
    """Which effect explains the rows, with what parameters, and where it shows.

    Parameters
    ----------
    rows : Rows
    background : Background
    survey : Survey
    signatures : tuple of Signature
    rng : numpy.random.Generator
        Draws the replicas.
    replicas : int
        More of them make the p-value and the null bands finer.

    Returns an Inference. Raises ValueError when no row has a residual in m, or a sigma is zero.
    """
    found = compare(rows, background, survey, signatures, rng, replicas)
    probability = pairs(rows, signatures, found)
    answer = verdict(found, probability)
    names = [n for n in probability if n not in ("none", "unknown")]
    names = [n for i, n in enumerate(names) if i < TOLD or probability[n] > LEAST]
    if answer.label in ("none", "unknown"):
        names.insert(0, answer.label)
    causes = tuple(cause_of(rows, signatures, found, n, probability[n]) for n in names)
    causes = tuple(sorted(causes, key=lambda cause: -cause.probability))
    best = next(cause for cause in causes if cause.effect == answer.label)
    left = rows.residual - best.shift
    chance = _likely_settings(found, left, rng, max(replicas, 20), best.setting.bursts)
    where = locate(rows, background, best.shift, rng, chance, best.setting, best.extra)
    compared = separability(found.epochs, signatures, found.evidence.settings[0])
    return Inference(answer, causes, _same(best, compared), where, compared, probability, found)


def _likely_settings(found, residual, rng, number, bursts):
    """Settings drawn by their probability given residuals (m,) that nothing but bursts acts on."""
    columns = found.epochs.columns(residual[:, None])
    choice = settings() if bursts else found.evidence.settings  # those were chosen without them
    acting = [replace(setting, bursts=bursts) for setting in choice]
    score = np.array([likelihood(found.epochs, setting, columns) for setting in acting])
    count = rng.multinomial(number, np.exp(score - np.logaddexp.reduce(score)))
    return [s for s, k in zip(choice, count, strict=True) for _ in range(k)]


def _same(cause, compared):
    """Effects with the squared correlation of one class with a cause of one part."""
    if len(cause.parts) != 1 or cause.effect not in compared.effects:
        return (cause.effect,)
    return compared.same(cause.effect, cause.parts[0][1])


def cause_of(rows, signatures, found, label, probability):
    """Cause of a label."""
    nothing = np.zeros(len(rows))
    if label == "none":
        return Cause(label, probability, (), (), nothing, None, BELIEVED)
    if label == "unknown":
        return Cause(label, probability, (), (), _unknown_shift(rows, found), None, BELIEVED)
    noisy = {one.label for one in found.noise}
    parts = [name for name in label.split("+") if name not in noisy]
    told, chosen, extra, setting = (), (), None, BELIEVED
    if parts:
        ones = [member(found, signatures, name) for name in parts]
        told, estimates, nothing = _fitted(rows, found, ones, parts)
        chosen = tuple(zip(ones, estimates, strict=True))
    for name in label.split("+"):
        if name in noisy:
            parameters, part, more, setting = _noise(rows, signatures, found, name, setting)
            told, chosen = (*told, *parameters), (*chosen, *part)
            extra = more if extra is None else extra
    return Cause(label, probability, told, chosen, nothing, extra, setting)


def _fitted(rows, found, ones, labels):
    """Parameters, estimates by part, and the shift (m,), of signatures acting together."""
    jacobian = np.hstack([one.jacobian for one in ones])
    scale = np.abs(jacobian[rows.metric]).max(axis=0)
    scale[scale == 0] = 1.0
    columns = found.epochs.columns(jacobian / scale)
    mine = [i for i, b in enumerate(found.table.blocks) if b.label in labels]
    weight = found.evidence.by_setting[:, mine].max(axis=1)
    residual = found.epochs.columns(rows.residual[:, None])[:, 0]
    done = fit(found.epochs, found.evidence.settings, weight, residual, columns)
    value, sigma = done.estimate / scale, np.sqrt(np.diag(done.covariance)) / scale
    detectable = DETECTABLE / np.sqrt(np.maximum(done.information, 1e-300)) / scale
    told, estimates, start = [], [], 0
    for one in ones:
        part = slice(start, start + len(one.parameters))
        names = [n if len(ones) == 1 else f"{one.name} {n}" for n in one.parameters]
        numbers = zip(names, one.units, value[part], sigma[part], detectable[part], strict=True)
        told += [Parameter(n, u, float(a), float(b), float(c)) for n, u, a, b, c in numbers]
        told += _event(one, found)
        estimates.append(value[part])
        start = part.stop
    return tuple(told), estimates, jacobian @ value


def _event(one, found):
    """Time and width of an event as Parameters."""
    if one.name not in found.refined:
        return [Parameter(k, "s", one.fixed[k], np.nan, np.nan) for k in EVENT if k in one.fixed]
    sigma = found.refined[one.name].sigma
    return [Parameter(k, "s", one.fixed[k], sigma[k], np.nan) for k in sigma]


def _noise(rows, signatures, found, name, setting):
    """Parameters, parts, variance of the rows' own and Setting of a noise class."""
    ones = [one for one in found.noise if one.label == name]
    one = max(ones, key=lambda each: each.gain[0])
    if isinstance(one, BurstEvidence):
        return _windows(one.bursts), (), None, replace(setting, bursts=one.bursts)
    size, sigma = _peak(one.size, one.by_size[:, 0])
    if one.member < 0:
        told = Parameter("factor on sigma", "ratio", size, sigma, float("nan"))
        return (told,), (), None, replace(setting, scale=size)
    kind = signatures[one.member]
    told = Parameter("magnitude", kind.units[0], size, sigma, _detectable(rows, found, kind))
    part = ((kind, np.array([size])),)
    if kind.is_common:
        return (told,), part, None, replace(setting, fixes=size)
    inside = one.channels.any()  # the stated noise comes from the points: it holds this already
    return (told,), part, None if inside else size**2 * kind.variance, setting


def _windows(bursts):
    """Parameters of windows in which the POS is worse."""
    told = []
    for number, burst in enumerate(bursts, start=1):
        after = f" {number}" if len(bursts) > 1 else ""
        for name, unit, value in zip(WINDOW, ("s", "s", "ratio"), burst[:3], strict=True):
            told.append(Parameter(name + after, unit, value, np.nan, np.nan))
    return tuple(told)


def _peak(size, score):
    """Size at the top of a log evidence by log size, and its sigma, by a parabola."""
    best = int(np.clip(np.argmax(score), 1, len(size) - 2))
    x = np.log(size[best - 1 : best + 2])
    curve, slope, _ = np.polyfit(x - x[1], score[best - 1 : best + 2] - score[best], 2)
    if curve >= 0:
        return float(size[np.argmax(score)]), float(size[np.argmax(score)])
    at = np.clip(-slope / (2 * curve), x[0] - x[1], x[2] - x[1])
    value = float(np.exp(x[1] + at))
    return value, value * float(min(1.0, np.sqrt(-0.5 / curve)))


def _detectable(rows, found, kind):
    """Size of a random effect whose square is DETECTABLE sigmas, by the Fisher information."""
    rough, rate = rows.channel == "roughness", rows.channel == "return_rate"
    shift = kind.jacobian[rate, 0]
    if shift.any():
        return float(DETECTABLE / np.sqrt((shift**2 / rows.noise[rate]).sum()))
    information = (kind.growth[rough] ** 2 / rows.noise[rough]).sum()
    if information == 0:
        own = found.epochs.own + found.epochs.sigma[found.epochs.row] ** 2 * kind.is_common
        variance = kind.variance[found.epochs.row] * found.epochs.half
        information = 0.5 * ((variance / own) ** 2).sum()
    return float(np.sqrt(DETECTABLE / np.sqrt(information)))


def _unknown_shift(rows, found):
    """What the leading unknown block makes of the residuals (m,)."""
    columns = found.table.columns[:, best_lead(found)[1]]
    observed = found.epochs.columns(columns)
    residual = found.epochs.columns(rows.residual[:, None])[:, 0]
    weight = found.evidence.none[:, 0]
    done = fit(found.epochs, found.evidence.settings, weight, residual, observed)
    return columns @ done.estimate

"""Complete inference in one call, and causes with their parameters.

Parameters have an estimate, a sigma, and the size that this survey could detect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.effects import Effect, PositionNoise
from mlscorr.gap.evidence._noise import detectable_size
from mlscorr.gap.evidence._windows import Window, WindowEvidence
from mlscorr.gap.evidence.decision import Costs, GapVerdict, decide, learned, with_absence
from mlscorr.gap.evidence.labels import (
    JointScore,
    LabelEvidence,
    best_member,
    joint_score,
    weigh_labels,
)
from mlscorr.gap.evidence.observations import (
    STATED,
    ErrorModel,
    Observations,
    error_models,
    model_likelihood,
    shares,
)
from mlscorr.gap.evidence.separability import Separability, compare_signatures
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.evidence.where import Where, locate
from mlscorr.gap.residuals import Absence, Background, Rows
from mlscorr.gap.signatures import Signature
from mlscorr.survey import Survey, Trajectory

UNITS = ("s", "s", "ratio")  # of a window's start, length and factor


@dataclass(frozen=True)
class CauseParameter:
    """One parameter of a cause; detectable is its minimal detectable bias (80 %, 0.1 %)."""

    name: str
    unit: str
    estimate: float
    sigma: float = float("nan")
    detectable: float = float("nan")


@dataclass(frozen=True)
class Cause:
    """One label with its numbers.

    Parameters
    ----------
    effect : str
        Label of the cause.
    probability : float
    parameters : tuple of CauseParameter
    parts : tuple of (Signature, (p,) array)
        Parts for the simulator: signature.effect(estimate) is the Effect.
    shift : (m,) array
        Its effect on the residuals.
    extra : (m,) array or None
        Variance added to the rows' own noise.
    model : ErrorModel
        Of the POS's covariance with it.
    """

    effect: str
    probability: float
    parameters: tuple[CauseParameter, ...]
    parts: tuple[tuple[Signature, np.ndarray], ...]
    shift: np.ndarray
    extra: np.ndarray | None = None
    model: ErrorModel = STATED

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Return the Effects for the simulator. Raises ValueError if a size is impossible."""
        return tuple(signature.effect(estimate) for signature, estimate in self.parts)

    def intervals(self, trajectory: Trajectory) -> tuple[tuple[str, float, float], ...]:
        """Name, start and end of each event and window, limited to the drive.

        An event lasts while it is at least half of its maximum.

        Parameters
        ----------
        trajectory : Trajectory
            Recorded trajectory.
        """
        intervals = []
        for part, _ in self.parts:
            if part.kind.moment():
                time = trajectory.gps_time[0] + part.fixed["time"]
                half = np.sqrt(2 * np.log(2)) * part.fixed.get("width", 0.0)
                if half:
                    end = time + half
                else:
                    end = trajectory.passes[trajectory.segment(time)][1]
                intervals.append((part.name, float(time - half), float(end)))
        for start, length, *_ in self.model.windows:
            intervals.append((PositionNoise.name, start, start + length))
        first, last = trajectory.gps_time[[0, -1]].tolist()
        return tuple((name, max(start, first), min(end, last)) for name, start, end in intervals)


@dataclass(frozen=True)
class Inference:
    """Complete result for the rows.

    Parameters
    ----------
    verdict : GapVerdict
    causes : tuple of Cause
        Cause of the verdict, then the others, best first.
    same : tuple of str
        Effects that this survey cannot separate from the label at its size.
    where : Where
    separability : Separability
    probability : dict
        Probability of every weighed label, most probable first.
    evidence : LabelEvidence
        Compared evidence.
    joint : JointScore
        Scores of the labels.
    """

    verdict: GapVerdict
    causes: tuple[Cause, ...]
    same: tuple[str, ...]
    where: Where
    separability: Separability
    probability: dict[str, float]
    evidence: LabelEvidence
    joint: JointScore

    @property
    def cause(self) -> Cause:
        """Cause of the verdict."""
        return next(cause for cause in self.causes if cause.effect == self.verdict.label)


@threadpool_limits.wrap(limits=1, user_api="blas")
def infer_causes(
    rows: Rows,
    background: Background,
    survey: Survey,
    signatures: Sequence[Signature],
    rng: np.random.Generator,
    replicas: int = SETTINGS.replicas,
    absence: Absence | None = None,
    costs: Costs | None = None,
) -> Inference:
    """Infer the effect that explains the rows, with parameters and location.

    Parameters
    ----------
    rows : Rows
    background : Background
    survey : Survey
    signatures : sequence of Signature
    rng : numpy.random.Generator
        For the replicas.
    replicas : int
        More of them refine the p-value and the null bands.
    absence : Absence, optional
        Absence of targets without a row.
    costs : Costs, optional
        Costs of wrong answers.

    Raises
    ------
    ValueError
        If no row has a residual in m, or a sigma is zero.
    """
    evidence = weigh_labels(rows, background, survey, signatures, rng, replicas)
    joint, evidence = joint_score(rows, survey, signatures, evidence)
    probability = learned().probabilities(joint)
    verdict = decide(evidence, probability, absence, costs)
    if absence is not None:
        probability = with_absence(probability, absence)
    names = [n for n in probability if n not in ("none", "unknown")]
    names = [
        name
        for i, name in enumerate(names)
        if i < SETTINGS.listed_causes or probability[name] > SETTINGS.listed
    ]
    names = list(dict.fromkeys((verdict.label, *names)))
    causes = [cause_of(rows, signatures, evidence, name, probability[name]) for name in names]
    if verdict.is_hidden:  # the rows do not show it
        causes[0] = Cause("unknown", probability["unknown"], (), (), np.zeros(len(rows)))
    first, *others = causes
    causes = (first, *sorted(others, key=lambda cause: -cause.probability))
    best = first
    left = rows.residual - best.shift
    models = _likely_models(evidence, left, rng, max(replicas, 20), best.model.windows)
    if len(best.parts) < 2:
        acts = best.intervals(survey.trajectory)
    else:
        acts = ()
    acts = acts[0][1:] if len(acts) == 1 else None  # several do not form one interval
    where = locate(rows, background, best.shift, rng, models, best.model, best.extra, acts)
    compared = compare_signatures(evidence.observations, signatures, evidence.blocks.models[0])
    same = _same(best, compared)
    return Inference(verdict, causes, same, where, compared, probability, evidence, joint)


def _likely_models(evidence, residual, rng, number, windows):
    """Models drawn by their probability, given residuals (m,) affected only by windows."""
    columns = evidence.observations.columns(residual[:, None])
    # with windows all are open: the relevant ones were chosen without windows
    models = error_models() if windows else evidence.blocks.models
    score = np.concatenate(
        [
            model_likelihood(evidence.observations, replace(model, windows=windows), columns)
            for model in models
        ]
    )
    count = rng.multinomial(number, shares(score))
    return [model for model, times in zip(models, count, strict=True) for _ in range(times)]


def _same(cause, compared):
    """Effects in one class of squared correlation with a cause of one part."""
    if len(cause.parts) != 1 or cause.effect not in compared.effects:
        return (cause.effect,)
    return compared.same(cause.effect, cause.parts[0][1])


def cause_of(
    rows: Rows,
    signatures: Sequence[Signature],
    evidence: LabelEvidence,
    label: str,
    probability: float,
) -> Cause:
    """Make the Cause of a label.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    evidence : LabelEvidence
        Of these.
    label : str
    probability : float
    """
    shift = np.zeros(len(rows))
    if label == "none":
        return Cause(label, probability, (), (), shift)
    if label == "unknown":
        return Cause(label, probability, (), (), _unknown_shift(rows, evidence))
    names = label.split("+")
    parameters = ()
    parts = ()
    steady = [name for name in names if name not in evidence.noisy]
    if steady:
        members = [best_member(signatures, evidence, n, "+".join(steady)) for n in steady]
        parameters, estimates, shift = _effect_parameters(rows, evidence, members, steady)
        parts = tuple(zip(members, estimates, strict=True))
    cause = Cause(label, probability, parameters, parts, shift)
    for name in names:
        if name in evidence.noisy:
            cause = _with_noise(cause, rows, signatures, evidence, name)
    return cause


def _with_noise(cause, rows, signatures, evidence, name):
    """Cause with an additional noise class."""
    classes = [each for each in evidence.noise if each.label == name]
    best = max(classes, key=lambda each: each.gain[0])
    if isinstance(best, WindowEvidence):
        more = window_parameters(best.windows)
        model = replace(cause.model, windows=best.windows)
        return replace(cause, parameters=cause.parameters + more, model=model)
    size, sigma = most_probable_size(best.size, best.by_size[:, 0])
    if best.member < 0:
        more = CauseParameter(PositionNoise.FACTOR, "ratio", size, sigma)
        attitude = (size, *cause.model.attitude[1:])
        model = replace(cause.model, scale=size, attitude=attitude)
        return replace(cause, parameters=(*cause.parameters, more), model=model)
    kind = signatures[best.member]
    detectable = detectable_size(rows, evidence.observations, kind)
    more = CauseParameter("magnitude", kind.units[0], size, sigma, detectable)
    cause = replace(
        cause, parameters=(*cause.parameters, more), parts=(*cause.parts, (kind, np.array([size])))
    )
    if kind.is_common:
        return replace(cause, model=replace(cause.model, fixes=size))
    if (
        best.channels.any() or cause.extra is not None
    ):  # the stated noise, from the points, includes it
        return cause
    return replace(cause, extra=size**2 * kind.variance)


def _unknown_shift(rows, evidence):
    """Effect of the leading unknown block on the residuals (m,)."""
    observations = evidence.observations
    columns = evidence.table.columns[:, evidence.hint()[1]]
    residual = observations.columns(rows.residual[:, None])[:, 0]
    weight = evidence.blocks.none[:, 0]
    models = evidence.blocks.models
    fit = fit_amplitudes(observations, models, weight, residual, observations.columns(columns))
    return columns @ fit.estimate


@dataclass(frozen=True)
class _AmplitudeFit:
    """Amplitudes (p,) of some columns, their covariance, and 1 / sigma^2 (p,) of each alone."""

    estimate: np.ndarray
    covariance: np.ndarray
    information: np.ndarray


def fit_amplitudes(
    observations: Observations,
    models: Sequence[ErrorModel],
    log_weight: np.ndarray,
    residual: np.ndarray,
    columns: np.ndarray,
) -> _AmplitudeFit:
    """Fit amplitudes of columns in a residual, averaged over error models.

    Parameters
    ----------
    observations : Observations
    models : sequence of s ErrorModel
    log_weight : (s,) array
        Log weight of each.
    residual : (n,) array
        Units: m.
    columns : (n, p) array
    """
    weight = np.exp(log_weight - np.logaddexp.reduce(log_weight))
    used = np.flatnonzero(weight > 0.01 * weight.max())
    weight = weight[used] / weight[used].sum()
    p = columns.shape[1]
    means = []
    covariances = []
    information = np.zeros(p)
    for w, s in zip(weight, used.tolist(), strict=True):
        white = observations.whitener(models[s]).whiten(np.column_stack([columns, residual]))
        normal = white.product(white)
        information += w * np.diag(normal)[:p]
        covariance = np.linalg.inv(normal[:p, :p] + np.eye(p) / SETTINGS.free_sigma**2)
        means.append(covariance @ normal[:p, p])
        covariances.append(covariance)
    mean = weight @ np.array(means)
    deviation = np.array(means) - mean
    spread = np.einsum("s,sp,sq->pq", weight, deviation, deviation)
    covariance = np.tensordot(weight, np.array(covariances), 1) + spread
    return _AmplitudeFit(mean, covariance, information)


def _effect_parameters(
    rows: Rows, evidence: LabelEvidence, members: Sequence[Signature], labels: Sequence[str]
) -> tuple[tuple[CauseParameter, ...], list[np.ndarray], np.ndarray]:
    """Parameters of signatures acting together.

    Parameters
    ----------
    rows : Rows
    evidence : LabelEvidence
    members : sequence of Signature
    labels : sequence of str
        Of these.

    Returns
    -------
    parameters : tuple of CauseParameter
    estimates : list of (p,) arrays
        Of each signature.
    shift : (m,) array
        Their effect on the residuals.
    """
    jacobian = np.hstack([m.jacobian for m in members])
    observations = evidence.observations
    scale = np.abs(jacobian[rows.metric]).max(axis=0)
    scale[scale == 0] = 1.0
    named = [i for i, block in enumerate(evidence.table.blocks) if block.label in labels]
    weight = evidence.blocks.by_model[:, named].max(axis=1)
    residual = observations.columns(rows.residual[:, None])[:, 0]
    columns = observations.columns(jacobian / scale)
    fit = fit_amplitudes(observations, evidence.blocks.models, weight, residual, columns)
    value = fit.estimate / scale
    sigma = np.sqrt(np.diag(fit.covariance)) / scale
    detectable = SETTINGS.detectable / np.sqrt(np.maximum(fit.information, 1e-300)) / scale
    parameters = []
    estimates = []
    start = 0
    for member in members:
        part = slice(start, start + len(member.parameters))
        prefix = "" if len(members) == 1 else f"{member.name} "
        numbers = zip(
            member.parameters, member.units, value[part], sigma[part], detectable[part], strict=True
        )
        parameters += [
            CauseParameter(prefix + name, unit, *map(float, sizes))
            for name, unit, *sizes in numbers
        ]
        event = evidence.event(member.name, "+".join(labels))
        sigmas = {} if event is None else event.sigma
        parameters += [
            CauseParameter(key, "s", member.fixed[key], sigmas.get(key, np.nan))
            for key in member.kind.moment()
        ]
        estimates.append(value[part])
        start = part.stop
    return tuple(parameters), estimates, jacobian @ value


def window_parameters(windows: Sequence[Window]) -> tuple[CauseParameter, ...]:
    """Parameters of windows in which the POS is worse."""
    parameters = []
    for number, window in enumerate(windows, start=1):
        after = f" {number}" if len(windows) > 1 else ""
        for name, unit, value in zip(PositionNoise.WINDOW, UNITS, window[:3], strict=True):
            parameters.append(CauseParameter(name + after, unit, value))
    return tuple(parameters)


def most_probable_size(size: np.ndarray, score: np.ndarray) -> tuple[float, float]:
    """Size with the largest log evidence by log size, and its sigma, from a parabola.

    Parameters
    ----------
    size, score : (x,) array
    """
    best = int(np.clip(np.argmax(score), 1, len(size) - 2))
    x = np.log(size[best - 1 : best + 2])
    curve, slope, _ = np.polyfit(x - x[1], score[best - 1 : best + 2] - score[best], 2)
    if curve >= 0:
        return float(size[np.argmax(score)]), float(size[np.argmax(score)])
    at = np.clip(-slope / (2 * curve), x[0] - x[1], x[2] - x[1])
    value = float(np.exp(x[1] + at))
    return value, value * float(min(1.0, np.sqrt(-0.5 / curve)))

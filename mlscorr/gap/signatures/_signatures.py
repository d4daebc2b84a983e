"""Signatures of effects in the rows: derivatives with respect to their parameters.

The change of the rows by a simulator's effects uses the same functions, beyond first order.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from mlscorr.effects import EFFECTS, Effect, known_effects
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures.changes import Bench, Change
from mlscorr.gap.signatures.settings import SETTINGS
from mlscorr.survey import Statement, Survey


@dataclass(frozen=True)
class Signature:
    """Change of the rows by one effect, at one time or of one target if applicable.

    Parameters
    ----------
    kind : class of an Effect
    fixed : dict
        Parameters without columns: time, width, target.
    parameters, units : tuples of p str
    typical : (p,) array
        Usual size of each parameter.
    jacobian : (m, p) array
        Of the residual by each parameter.
    variance : (m,) array
        For a random effect: derivative of the noise variance by the squared magnitude.
    growth : (m,) array
        For a random effect in roughness rows: at a magnitude x their mean increases by log(1 +
        growth x^2).
    """

    kind: type[Effect]
    fixed: dict
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    typical: np.ndarray
    jacobian: np.ndarray
    variance: np.ndarray = field(repr=False)
    growth: np.ndarray = field(repr=False)

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.kind.name

    @property
    def is_noise(self) -> bool:
        """True if it affects the rows' variance."""
        return bool(self.variance.any() or self.growth.any())

    @property
    def is_common(self) -> bool:
        """True if its noise is the same for rows of one moment, not independent for each row."""
        return self.is_noise and self.kind.is_of_pose()

    def effect(self, estimate: np.ndarray) -> Effect:
        """Return the Effect with some parameters.

        Parameters
        ----------
        estimate : (p,) array
            For random effects only the size counts.

        Raises
        ------
        ValueError
            If a value is impossible.
        """
        estimate = np.asarray(estimate, dtype=float)
        if self.kind.is_wave():
            size = np.hypot(*estimate)
            phase = np.arctan2(estimate[1], estimate[0])
            return self.kind(magnitude=float(size), phase=float(phase), **self.fixed)
        values = np.abs(estimate) if self.kind.random else estimate
        if len(values) == 1:
            magnitude = float(values[0])
        else:
            magnitude = values.tolist()
        return self.kind(magnitude=magnitude, **self.fixed)


def signatures(
    rows: Rows,
    survey: Survey,
    effects: Iterable[type[Effect]] | None = None,
    rng: np.random.Generator | None = None,
) -> tuple[tuple[Signature, ...], dict[str, Statement]]:
    """Compute signatures of effects in the rows of a survey, and reasons for missing ones.

    Deterministic effects are differentiated with steps of a tenth of their usual size to both
    sides. Events (effects with a time) are tried at times spread over the passes, and with several
    widths if they have one; target outliers for each target; a phase as its two quadratures.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        With the assumed trajectory and mounting.
    effects : iterable of Effect classes, optional
        All known ones by default.
    rng : numpy.random.Generator, optional
        For random effects, whose variances are sampled; the same seed each time by default.

    Returns
    -------
    tuple of Signature, dict of Statement
        By name of effects without one; a warning if survey.toml could provide it.
    """
    bench = Bench(rows, survey)
    signs = []
    left_out = {}
    rng = np.random.default_rng(0) if rng is None else rng
    for kind in known_effects() if effects is None else effects:
        if kind.needs_mounting() and survey.mounting is None:
            left_out[kind.name] = Statement("no mounting", "warning", {"stage": kind.stage})
            continue
        if kind.name in survey.scanner.assumed:
            left_out[kind.name] = Statement("unstated size", "warning", {"name": kind.name})
            continue
        bank = _tried(bench, kind, _bank(kind, rows, survey), rng)
        if isinstance(bank, str):
            left_out[kind.name] = Statement("not usable", values={"why": bank})
            continue
        bank = [sign for sign in bank if sign.jacobian.any() or sign.is_noise]
        signs += bank
        if not bank:
            left_out[kind.name] = Statement("no row")
    return tuple(signs), left_out


def _tried(bench, kind, bank, rng):
    """Signatures of an effect; a sentence if a user's own one cannot be tried."""
    if kind in EFFECTS:
        return [signature(bench, kind, fixed, rng) for fixed in bank]
    try:
        signs = [signature(bench, kind, fixed, rng) for fixed in bank]
    except (Exception, SystemExit) as error:  # of a user's code: the effect is omitted
        return str(error) or type(error).__name__
    metric = bench.rows.metric
    for sign in signs:
        moved = np.abs(sign.jacobian * sign.typical).max(axis=1, initial=0.0)
        if not all(np.isfinite(v).all() for v in (moved[metric], sign.variance, sign.growth)):
            return "It gives values that are not numbers."
        size = f"At its usual size, {sign.typical[0]:g} {sign.units[0]}, it"
        if why := _too_far(bench.rows, moved, size):
            return why
    return signs


def _too_far(rows: Rows, moved: np.ndarray, what: str) -> str:
    """Sentence on an effect with an implausible unit: it moves items farther than any survey error.

    Parameters
    ----------
    rows : Rows
    moved : (m,) array
        Shift of each row; the largest one of each item counts. Units: m.
    what : str
        Moving effect, in words.

    Returns
    -------
    str
        A sentence; empty if it is plausible.
    """
    # walls are insensitive to height, and planes of two passes to common motion
    parts = rows.channel == "target", rows.metric & ~rows.two_times
    part = next((part for part in parts if part.any()), rows.metric)
    number = np.unique(rows.item[part], return_inverse=True)[1]
    worst = np.zeros(number.max(initial=0) + 1)
    np.maximum.at(worst, number, np.abs(moved[part]))
    usual = np.median(worst)
    largest = SETTINGS.largest_shift
    if usual <= largest:
        return ""
    return (
        f"{what} moves points by {usual:.3g} m (median); the limit is {largest:g} m. Check its "
        "unit."
    )


def signature(bench: Bench, kind: type[Effect], fixed: dict, rng: np.random.Generator) -> Signature:
    """Compute the signature of an effect class.

    Parameters
    ----------
    bench : Bench
    kind : class of an Effect
    fixed : dict
        For example the time of an event.
    rng : numpy.random.Generator
        For random effects.
    """
    rows = bench.rows
    size = kind.quantities()["magnitude"]
    m = len(rows)
    none = np.zeros(len(rows))
    if size.typical is not None:
        typical = size.typical
    else:
        typical = 1e-3 * size.largest
    if kind.is_scatter() or kind.stage == "return":
        if kind.stage == "return":
            step = SETTINGS.loss * min(1.0, size.largest)
        else:
            step = typical
        change = bench.change(kind(magnitude=step, **fixed), rng)
        return Signature(
            kind,
            fixed,
            ("magnitude",),
            (size.unit,),
            np.array([typical]),
            (change.shift / step)[:, None],
            change.variance / step**2,
            change.growth / step**2,
        )
    tries = _tries(kind, size, fixed)
    jacobian = np.zeros((m, len(tries)))
    step = SETTINGS.derivative_step * typical
    if size.least is None:
        first = -1
    else:  # it has no other sign
        first = 0
    if _is_seen(rows, fixed):
        for column, (_, unit, more) in enumerate(tries):
            ends = [
                bench.change(kind(magnitude=np.multiply(unit, sign * step).tolist(), **more)).shift
                for sign in (first, 1)
            ]
            jacobian[:, column] = (ends[1] - ends[0]) / (step * (1 - first))
    names = tuple(name for name, _, _ in tries)
    return Signature(
        kind,
        fixed,
        names,
        (size.unit,) * len(tries),
        np.full(len(tries), typical),
        jacobian,
        none,
        none,
    )


def _is_seen(rows, fixed):
    """True if a row is within half of the maximum of a transient event; the tail alone does not
    determine the size.
    """
    times = np.concatenate([rows.gps_time[rows.metric], rows.gps_time_2[rows.two_times]])
    lag = np.abs(times - rows.reference.start - fixed.get("time", 0.0))
    half = np.sqrt(2 * np.log(2)) * fixed.get("width", np.inf)
    return bool(lag.min(initial=np.inf) <= half)


def _tries(kind, size, fixed):
    """For each column: its name, unit vector or 1 of the magnitude, and further parameters."""
    if size.count > 1:
        return [
            (name, unit, fixed) for name, unit in zip(kind.parts, np.eye(size.count), strict=True)
        ]
    if kind.is_wave():  # magnitude sin(x - phase) = a sin(x) - b cos(x)
        phases = (0.0, np.pi / 2)
        return [(n, 1.0, {**fixed, "phase": p}) for n, p in zip(kind.parts, phases, strict=True)]
    return [("magnitude", 1.0, fixed)]


def _bank(kind, rows, survey):
    """Sets of fixed parameters at which an effect is tried."""
    if kind.is_on_target():
        used = np.unique(rows.survey_item[rows.survey_item >= 0])
        return [{"target": rows.targets.name[i]} for i in used]
    known = kind.quantities()
    moment = kind.moment()
    rest = {name: known[name].typical for name in kind.circumstances() if name not in moment}
    if not moment:
        return [rest]
    if "width" not in moment:
        return [rest | {"time": t} for t in _times(rows, survey, SETTINGS.step_spacing)]
    return [
        {**rest, "time": time, "width": width}
        for width in SETTINGS.widths
        for time in _times(rows, survey, width)
    ]


def _times(rows, survey, spacing):
    """Times of events from reference.start, spread over the observed time. s."""
    known = rows.gps_time[rows.metric]
    if len(known) == 0:
        return []
    known = np.append(known, rows.gps_time_2[rows.two_times])
    low = known.min()
    high = known.max()
    inside = np.clip(survey.trajectory.gaps, low, high)
    lost = float((inside[:, 1] - inside[:, 0]).sum())
    number = int(np.clip((high - low - lost) / spacing, 1, SETTINGS.events))
    # evenly over the time without gaps
    times = low + (np.arange(number) + 0.5) / number * (high - low - lost)
    for start, end in inside:
        times = np.where(times >= start, times + (end - start), times)
    times = times[survey.trajectory.segment(times) >= 0]
    return [float(round(time - rows.reference.start, 3)) for time in times]


def select(signs: Iterable[Signature], rows: Rows, used: np.ndarray) -> tuple[Signature, ...]:
    """Select signatures in some rows; events only if these rows observe them.

    Parameters
    ----------
    signs : iterable of Signature
    rows : Rows
        Rows of the signatures.
    used : (m,) bool array
    """
    names = ("jacobian", "variance", "growth")
    part = rows.select(used)
    return tuple(
        replace(sign, **{name: getattr(sign, name)[used] for name in names})
        for sign in signs
        if _is_seen(part, sign.fixed)
    )


def expected(rows: Rows, survey: Survey, effects: Iterable[Effect]) -> Change:
    """Change of the rows by the effects already in a simulator, as one Change.

    Subtract ``shift + log(1 + growth)`` from the residuals, and add ``variance`` to their noise.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    effects : iterable of Effect

    Raises
    ------
    ValueError
        If a user's effect moves everything by more than any survey error.
    """
    bench = Bench(rows, survey)
    total = np.zeros((3, len(rows)))
    for effect in effects:
        change = bench.change(effect)
        what = f"The simulator's {effect.name} of {effect.magnitude}"
        if type(effect) not in EFFECTS and (why := _too_far(rows, change.shift, what)):
            raise ValueError(why)
        total += _shift(bench, effect, change), change.variance, change.growth
    return Change(*total)


def _shift(bench, effect, change):
    """Shift (m,) from record to truth: by the negative change, or by the opposite effect.

    The two differ by twice the second order.
    """
    with suppress(ValueError):  # of an effect that has no other sign
        opposite = replace(effect, magnitude=(-np.asarray(effect.magnitude)).tolist())
        return np.where(bench.rows.metric, -bench.change(opposite).shift, change.shift)
    return change.shift


def without_effects(rows: Rows, survey: Survey, effects: Sequence[Effect]) -> Rows:
    """Rows as observed minus the expectation of a simulator with effects.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    effects : sequence of Effect
    """
    change = expected(rows, survey, effects)
    common = [effect for effect in effects if effect.random and effect.stage == "pos"]
    # each row's own noise comes from its points, and thus already includes theirs
    noise = rows.noise + expected(rows, survey, common).variance
    residual = rows.residual - change.shift - np.log1p(change.growth)
    return replace(rows, residual=residual, noise=noise)


def curvature(
    rows: Rows, survey: Survey, parts: Iterable[tuple[Signature, np.ndarray]]
) -> np.ndarray:
    """Change of the rows by effects beyond first order (m,), in the unit of each row.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    parts : iterable of (Signature, (p,) array)
        With their sizes. Random ones are ignored.
    """
    bench = Bench(rows, survey)
    curved = np.zeros(len(rows))
    for part, size in (pair for pair in parts if not pair[0].kind.random):
        with suppress(ValueError):  # of an effect that has no other sign
            # truth is the record minus the effect
            curved -= bench.change(part.effect(-size)).shift + part.jacobian @ size
    return curved

"""Random causes of a synthetic survey: dissimilar effects, or a mechanism unlike all of them.

Their sizes are multiples of the minimal detectable bias in the geometry of that survey.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from mlscorr.collocation import Whitener
from mlscorr.effects import Effect, effect_class
from mlscorr.gap.evidence import (
    SETTINGS,
    Observations,
    detectable_size,
    error_models,
    explained_square,
    model_likelihood,
)
from mlscorr.gap.residuals import Rows, background
from mlscorr.gap.signatures import Bench, Signature, signature
from mlscorr.simulate import Described, RecordedPoints
from mlscorr.survey import Survey

EVENT_WIDTHS = (2.0, 30.0)  # s, log-uniform: a lost fix to a tunnel
LEAST_SIZE = 0.5  # MDB: an effect below it at its largest credible value is not visible
ATTEMPTS = 12  # names or surveys, estimated: if half are not visible, one case in 4000 fails
LIKENESS = 0.8  # squared correlation with an effect, estimated: above it, the same by another name


@dataclass(frozen=True)
class Ruler:
    """Survey without effects, as a measure of the size of effects.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    observations : Observations
    whitener : Whitener
        For the most likely covariance, given its residuals without effects.
    """

    rows: Rows
    survey: Survey
    observations: Observations
    whitener: Whitener

    @classmethod
    def of(cls, rows: Rows, survey: Survey) -> Ruler:
        """Make the Ruler of the rows of a survey without effects."""
        observed = Observations.of(rows, background(rows, survey))
        residual = observed.columns(rows.residual[:, None])
        best = max(error_models(), key=lambda model: model_likelihood(observed, model, residual)[0])
        return cls(rows, survey, observed, observed.whitener(best))

    def normal(self, columns: np.ndarray) -> np.ndarray:
        """Return A^T V^-1 A (p, p) of columns (m, p)."""
        white = self.whitener.whiten(self.observations.columns(columns))
        return white.product(white)

    def size(self, shift: np.ndarray) -> float:
        """Return the size of a shift (m,) of the rows, in minimal detectable biases."""
        return float(np.sqrt(max(self.normal(shift[:, None])[0, 0], 0.0)) / SETTINGS.detectable)


@dataclass(frozen=True)
class SizedEffect:
    """Effect of a known size.

    Parameters
    ----------
    effect : Effect
    parameters : dict
        With the names of a diagnosis.
    mdb : float
        Size in minimal detectable biases.
    shift : (m,) array
        Its shift of the residuals, to first order.
    normal : (p, p) array
        Of its magnitudes: A^T V^-1 A.
    """

    effect: Effect
    parameters: dict[str, float]
    mdb: float
    shift: np.ndarray
    normal: np.ndarray


def draw_effect(
    ruler: Ruler, kind: type[Effect], mdb: float, rng: np.random.Generator
) -> SizedEffect | None:
    """Draw an effect of a class in a random direction with a given size; None if it is not visible.

    It is limited to the largest credible value. Events get a time within the survey and a width,
    outliers a target. The MDB of a random effect is the size whose square is that many sigmas.

    Parameters
    ----------
    ruler : Ruler
    kind : class of an Effect
    mdb : float
        Size in minimal detectable biases.
    rng : numpy.random.Generator
    """
    if kind.needs_mounting() and ruler.survey.mounting is None:
        return None
    fixed = _fixed(kind, ruler, rng)
    if fixed is None:
        return None
    sign = signature(Bench(ruler.rows, ruler.survey), kind, fixed, rng)
    if kind.random:
        vector = _random(ruler, sign, mdb)
    else:
        vector = _systematic(ruler, sign, mdb, rng)
    if vector is None:
        return None
    vector, size = _credible(sign, vector, mdb)
    if size < min(LEAST_SIZE, mdb):
        return None
    parameters = dict(zip(sign.parameters, map(float, vector), strict=True))
    parameters |= {key: sign.fixed[key] for key in kind.moment()}
    shift = sign.jacobian @ vector
    return SizedEffect(sign.effect(vector), parameters, size, shift, ruler.normal(sign.jacobian))


def _systematic(ruler, sign, mdb, rng):
    """Parameters (p,) in a random direction."""
    vector = rng.standard_normal(len(sign.typical)) * sign.typical
    unit = ruler.size(sign.jacobian @ vector)
    if unit == 0.0:
        return None
    return vector * mdb / unit


def _random(ruler, sign, mdb):
    """Magnitude (1,) of an effect that appears as noise or lost returns."""
    size = detectable_size(ruler.rows, ruler.observations, sign, mdb)
    if np.isfinite(size):
        return np.array([size])
    return None


def _credible(sign, vector, mdb):
    """Parameters within the largest credible value, and the resulting size."""
    quantities = sign.kind.quantities()
    largest = quantities["magnitude"].largest * (1 - 1e-3)  # rounding cannot exceed it
    if sign.kind.is_wave():
        size = np.hypot(*vector)
    else:
        size = np.abs(vector).max()
    share = min(1.0, largest / size)
    return vector * share, mdb * share


def _fixed(kind, ruler, rng):
    """Random circumstances of an effect besides its magnitude; None if nothing was observed."""
    rows = ruler.rows
    fixed = {}
    if kind.is_on_target():
        used = np.unique(rows.survey_item[rows.survey_item >= 0])
        if len(used):
            return {"target": rows.targets.name[rng.choice(used)]}
        return None
    if "time" in kind.moment():
        times = np.sort(rows.gps_time[rows.metric])
        if len(times) == 0:
            return None
        time = np.quantile(times, rng.random())  # as dense in time as the observations
        fixed["time"] = float(round(time - rows.reference.start, 3))
    if "width" in kind.moment():
        fixed["width"] = float(np.exp(rng.uniform(*np.log(EVENT_WIDTHS))))
    return fixed


def shift_by(ruler: Ruler, move: Callable[[RecordedPoints], np.ndarray]) -> np.ndarray:
    """Shift (m,) of the residuals if points are displaced.

    Parameters
    ----------
    ruler : Ruler
    move : function
        From points to displacements (k, 3) on the map; see DisplacedSurvey. Units: m.
    """
    rows = ruler.rows
    pulses = ruler.rows.pulses
    survey = ruler.survey
    points = RecordedPoints(
        pulses.gps_time, pulses.xyz, pulses.scanner_xyz, survey.trajectory, survey.mounting
    )
    moved = pulses.weight[:, None] * move(points)
    items, number = np.unique(pulses.item, return_inverse=True)
    total = np.column_stack([np.bincount(number, v, len(items)) for v in moved.T])
    return np.einsum("mi,mi->m", rows.direction, total[np.searchsorted(items, rows.item)])


def likeness(ruler: Ruler, shift: np.ndarray, known: Sequence[Signature]) -> dict[str, float]:
    """Share of a shift's squared signal that each effect of the library explains.

    Parameters
    ----------
    ruler : Ruler
    shift : (m,) array
        Of the residuals.
    known : sequence of Signature
        All signatures of the library in this survey; for an event the best time counts.
    """
    known = [sign for sign in known if sign.jacobian[ruler.rows.metric].any()]
    if not shift[ruler.rows.metric].any():
        return {}
    columns = np.hstack([shift[:, None], *(sign.jacobian for sign in known)])
    white = ruler.whitener.whiten(ruler.observations.columns(columns))
    across = white.product(white[np.array([0])])[:, 0]
    shares = {}
    start = 1
    for sign in known:
        index = np.arange(start, start + len(sign.parameters))
        start += len(index)
        part = white[index]
        share = explained_square(part.product(part), across[index]) / float(across[0])
        shares[sign.name] = max(shares.get(sign.name, 0.0), share)
    return shares


def names_to_try(
    pool: Sequence[str], rng: np.random.Generator, first: Iterable[str] = ()
) -> Iterator[str]:
    """Yield ATTEMPTS names after the first ones, drawn on demand.

    Parameters
    ----------
    pool : sequence of str
        From which the others are drawn.
    rng : numpy.random.Generator
    first : iterable of str
    """
    return chain(first, (str(rng.choice(pool)) for _ in range(ATTEMPTS)))


def draw_effects(
    ruler: Ruler,
    known: Sequence[Signature],
    names: Iterable[str],
    number: int,
    mdb: float,
    rng: np.random.Generator,
) -> list[tuple[SizedEffect, dict[str, float]]] | None:
    """Draw dissimilar effects, each with its likeness to known ones; None if too few are visible.

    Parameters
    ----------
    ruler : Ruler
    known : sequence of Signature
        All signatures of the library in this survey.
    names : iterable of str
        Names to try.
    number : int
        Number of effects.
    mdb : float
        Size in minimal detectable biases.
    rng : numpy.random.Generator
    """
    drawn: list = []
    for name in names:
        if name in (sized.effect.name for sized, _ in drawn):
            continue
        sized = draw_effect(ruler, effect_class(name), mdb, rng)
        if sized is None:
            continue
        like = likeness(ruler, sized.shift, known)
        if all(like.get(other.effect.name, 0.0) < SETTINGS.same for other, _ in drawn):
            drawn.append((sized, like))
        if len(drawn) == number:
            return drawn
    return None


@dataclass(frozen=True)
class SizedMechanism:
    """Mechanism outside the library, of a known size, which displaces points when called.

    Parameters
    ----------
    name : str
    function : function
        From points, a size and a generator to displacements (k, 3). Units: m.
    chance : int
        Seed of its random numbers.
    size : float
        In its unit.
    """

    name: str
    function: Callable
    chance: int
    size: float = 1.0

    def __call__(self, points: RecordedPoints) -> np.ndarray:
        """Return displacements (k, 3) of points on the map. Units: m."""
        return self.function(points, self.size, np.random.default_rng(self.chance))


def draw_mechanism(
    ruler: Ruler,
    known: Sequence[Signature],
    names: Iterable[str],
    mechanisms: Described,
    mdb: float,
    rng: np.random.Generator,
) -> tuple[SizedMechanism, np.ndarray, dict[str, float]] | None:
    """Draw a mechanism unlike all effects, with its shift (m,) and likeness; None if there is none.

    Parameters
    ----------
    ruler, known, names, mdb, rng
        See draw_effects.
    mechanisms : dict
        Function, unit with largest size, and hint, by name.
    """
    for name in names:
        function, (_, largest), _ = mechanisms[name]
        moved = SizedMechanism(name, function, int(rng.integers(2**32)), float(rng.choice([-1, 1])))
        shift = shift_by(ruler, moved)
        unit = ruler.size(shift)
        if unit == 0.0 or mdb / unit > largest:
            continue
        like = likeness(ruler, shift, known)
        if max(like.values(), default=0.0) < LIKENESS:
            return replace(moved, size=mdb / unit * moved.size), mdb / unit * shift, like
    return None

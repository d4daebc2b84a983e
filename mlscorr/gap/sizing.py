"""Effects of a chosen size: so many minimal detectable biases in the geometry of one survey."""

from dataclasses import MISSING, dataclass, fields

import numpy as np

from mlscorr.effects import Effect
from mlscorr.gap.background import Epochs, epochs, settings
from mlscorr.gap.changes import NEEDS_MOUNTING, Bench
from mlscorr.gap.estimate import DETECTABLE
from mlscorr.gap.rows import Rows, background
from mlscorr.gap.signatures import signature, signatures
from mlscorr.gap.weighing import likelihood
from mlscorr.gap.whitening import Whitener, whitener
from mlscorr.simulate.moved import Seen
from mlscorr.survey import Survey

WIDTHS = (2.0, 30.0)  # s, between which the width of an event is drawn, evenly by its log
LEAST = 0.5  # MDB: an effect that stays below at its largest credible value doesn't show
NEARLY = 0.999  # of the largest credible value, where rounding can't take it beyond


@dataclass(frozen=True)
class Scale:
    """A survey without effects, and what of its background's size an effect can be.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    epochs : Epochs
    factor : Whitener
        Of the covariance that its residuals without effects make most likely.
    """

    rows: Rows
    survey: Survey
    epochs: Epochs
    factor: Whitener

    @classmethod
    def of(cls, rows, survey):
        """Scale of the rows of a survey in which nothing acts."""
        observed = epochs(rows, background(rows, survey))
        residual = observed.columns(rows.residual[:, None])
        best = max(settings(), key=lambda setting: likelihood(observed, setting, residual))
        return cls(rows, survey, observed, whitener(observed, best))

    def normal(self, columns):
        """A^T V^-1 A (p, p) of columns (m, p)."""
        white = self.factor.whiten(self.epochs.columns(columns))
        return white.product(white)

    def size(self, shift):
        """Size of a shift (m,) of the rows, in minimal detectable biases."""
        return float(np.sqrt(max(self.normal(shift[:, None])[0, 0], 0.0)) / DETECTABLE)


@dataclass(frozen=True)
class Sized:
    """An effect of a known size.

    Parameters
    ----------
    effect : Effect
    parameters : dict
        As a diagnosis would name and estimate them.
    mdb : float
        Size in minimal detectable biases.
    shift : (m,) array
        What it makes of the residuals, to the first order.
    normal : (p, p) array
        Of its magnitudes: A^T V^-1 A.
    """

    effect: Effect
    parameters: dict
    mdb: float
    shift: np.ndarray
    normal: np.ndarray


def sized(scale, kind, mdb, rng):
    """Sized effect of a class, in a random direction, of so many MDB; None where it doesn't show.

    It is capped at the largest credible value. Events get a time within the survey and a width,
    outliers a target. A random effect's MDB is the size whose square is DETECTABLE sigmas.
    """
    if kind.stage in NEEDS_MOUNTING and scale.survey.mounting is None:
        return None
    fixed = _fixed(kind, scale, rng)
    if fixed is None:
        return None
    one = signature(Bench(scale.rows, scale.survey), kind, fixed, rng)
    draw = _random if kind.random else _systematic
    found = draw(scale, one, mdb, rng)
    if found is None or found[1] < min(LEAST, mdb):
        return None
    way, told = found
    numbers = dict(zip(one.parameters, map(float, way), strict=True))
    events = {k: v for k, v in one.fixed.items() if k in ("time", "width")}
    jacobian = one.jacobian
    return Sized(one.effect(way), numbers | events, told, jacobian @ way, scale.normal(jacobian))


def _systematic(scale, one, mdb, rng):
    """Parameters (p,) in a random direction, and their size."""
    way = rng.standard_normal(len(one.typical)) * one.typical
    unit = scale.size(one.jacobian @ way)
    if unit == 0.0:
        return None
    return _credible(one, way * mdb / unit, mdb)


def _random(scale, one, mdb, rng):
    """Magnitude (1,) of an effect that shows as noise or lost returns, and its size."""
    rows = scale.rows
    rate, rough = rows.channel == "return_rate", rows.channel == "roughness"
    if one.kind.stage == "return":
        information = (one.jacobian[rate, 0] ** 2 / rows.noise[rate]).sum()
        power = 1.0
    else:
        information = (one.growth[rough] ** 2 / rows.noise[rough]).sum()
        power = 0.5
        if information == 0:
            row, common = scale.epochs.row, one.is_common
            own = scale.epochs.own + scale.epochs.sigma[row] ** 2 * common
            information = 0.5 * ((one.variance[row] * scale.epochs.half / own) ** 2).sum()
    if information == 0:
        return None
    return _credible(one, np.array([(mdb * DETECTABLE / np.sqrt(information)) ** power]), mdb)


def _credible(one, way, mdb):
    """Parameters within the largest credible value, and the size that is left."""
    largest = one.kind.quantities()["magnitude"].largest * NEARLY
    turned = np.hypot(*way) if "cos" in one.parameters[0] else np.abs(way).max()
    share = min(1.0, largest / turned)
    return way * share, mdb * share


def _fixed(kind, scale, rng):
    """What an effect has besides its magnitude, at random; None where nothing was seen."""
    needed = [f.name for f in fields(kind) if f.default is MISSING and f.name != "magnitude"]
    rows, fixed = scale.rows, {}
    if "target" in needed:
        used = np.unique(rows.survey_item[rows.survey_item >= 0])
        return {"target": rows.targets.name[rng.choice(used)]} if len(used) else None
    if "time" in needed:
        seen = np.sort(rows.gps_time[rows.metric])
        if len(seen) == 0:
            return None
        time = np.quantile(seen, rng.random())  # as dense in time as what was seen
        fixed["time"] = float(round(time - rows.reference.start, 3))
    if "width" in needed:
        fixed["width"] = float(np.exp(rng.uniform(*np.log(WIDTHS))))
    return fixed


def shift_by(scale, move):
    """Shift (m,) of the residuals when points are recorded elsewhere: move as MovedSurvey has."""
    rows, pulses = scale.rows, scale.rows.pulses
    seen = Seen(
        pulses.gps_time,
        pulses.xyz,
        pulses.scanner_xyz,
        scale.survey.trajectory,
        scale.survey.mounting,
    )
    moved = pulses.weight[:, None] * move(seen)
    items, number = np.unique(pulses.item, return_inverse=True)
    total = np.column_stack([np.bincount(number, v, len(items)) for v in moved.T])
    return np.einsum("mi,mi->m", rows.direction, total[np.searchsorted(items, rows.item)])


def likeness(scale, shift, known=None):
    """Share of a shift's squared signal that each effect of the library explains: a dict.

    Parameters
    ----------
    scale : Scale
    shift : (m,) array
        Of the residuals.
    known : tuple of Signature, optional
        All that the library has in this survey; of an event the best of its times counts.
    """
    known = signatures(scale.rows, scale.survey)[0] if known is None else known
    known = [one for one in known if one.jacobian[scale.rows.metric].any()]
    if not shift[scale.rows.metric].any():
        return {}
    columns = np.hstack([shift[:, None], *(one.jacobian for one in known)])
    white = scale.factor.whiten(scale.epochs.columns(columns))
    across = white.product(white[np.array([0])])[:, 0]
    told, start = {}, 1
    for one in known:
        mine = np.arange(start, start + len(one.parameters))
        start += len(mine)
        part = white[mine]
        share = _explained(part.product(part), across[mine]) / across[0]
        told[one.name] = max(told.get(one.name, 0.0), float(share))
    return told


def _explained(normal, across):
    """Squared signal that the best amplitudes of some columns explain."""
    length = np.sqrt(np.diag(normal))
    seen = length > 0
    scaled = normal[np.ix_(seen, seen)] / np.outer(length[seen], length[seen])
    part = across[seen] / length[seen]
    return float(part @ np.linalg.pinv(scaled, rcond=1e-9) @ part) if seen.any() else 0.0

"""How each effect shows in the rows: derivatives by its parameters, through its own function."""

from dataclasses import MISSING, dataclass, field, fields, replace

import numpy as np

from mlscorr.effects import EFFECTS
from mlscorr.gap.changes import NEEDS_MOUNTING, Bench

STEP = 0.1  # of the usual size: small enough to be linear, far above rounding
TEST_LOSS = 0.5  # share: the chance of loss at which a count of few pulses is most exact
WIDTHS = (2.0, 5.0, 15.0, 45.0)  # s: of events, from a lost fix to a street of high houses
EVENTS = 80  # of one width at most
STEP_SPACING = 2.0  # s between the times of events without a width
AXES = {  # what the parts of a vector are
    "mounting": ("right", "forward", "up"),
    "pos": ("easting", "northing", "height"),
    "control": ("easting", "northing", "height"),
}


@dataclass(frozen=True)
class Signature:
    """How one effect, at one time or of one target where it has such, shows in the rows.

    Parameters
    ----------
    kind : class of an Effect
    fixed : dict
        Parameters that the columns don't stand for: time, width, target.
    parameters, units : tuples of p str
    typical : (p,) array
        Usual size of each parameter.
    jacobian : (m, p) array
        Of the residual by each parameter.
    variance : (m,) array
        A random effect's: of the residual's noise by the magnitude squared.
    growth : (m,) array
        A random effect's, of roughness rows: at a magnitude x their mean grows by
        log(1 + growth x^2).
    """

    kind: type
    fixed: dict
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    typical: np.ndarray
    jacobian: np.ndarray
    variance: np.ndarray = field(repr=False)
    growth: np.ndarray = field(repr=False)

    @property
    def name(self):
        """The effect's name."""
        return self.kind.name

    @property
    def label(self):
        """Name, and what is fixed: "position_bump, time 20, width 5"."""
        told = [f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in self.fixed.items()]
        return ", ".join([self.name, *told])

    @property
    def is_noise(self):
        """Whether it shows in the rows' variance."""
        return bool(self.variance.any() or self.growth.any())

    @property
    def is_common(self):
        """Whether its noise is the same for rows of one moment, not each row's own."""
        return self.is_noise and self.kind.stage == "pos"

    def effect(self, estimate):
        """The Effect with these parameters (p,); of random ones, with the size alone.

        Raises ValueError for what no survey can have.
        """
        estimate = np.asarray(estimate, dtype=float)
        if "phase" in self.kind.quantities():
            size, phase = np.hypot(*estimate), np.arctan2(estimate[1], estimate[0])
            return self.kind(magnitude=float(size), phase=float(phase), **self.fixed)
        values = np.abs(estimate) if self.kind.random else estimate
        magnitude = float(values[0]) if len(values) == 1 else values.tolist()
        return self.kind(magnitude=magnitude, **self.fixed)


def signatures(rows, survey, effects=EFFECTS, rng=None):
    """Signatures of effects in the rows of a survey, and why others have none.

    Deterministic effects are differentiated by steps of a tenth of their usual size to both
    sides. Events (effects with a time) are tried at times spread over the passes, and with WIDTHS
    where they have one; target outliers with each target; a phase as its two quadratures.

    Parameters
    ----------
    rows : Rows
    survey : Survey
        With what is believed of trajectory and mounting.
    effects : iterable of Effect classes
    rng : numpy.random.Generator, optional
        For random effects, whose variances are sampled; the same seed each time by default.

    Returns a tuple of Signature, and a dict of sentences by the names of effects without one.
    """
    bench, found, left_out = Bench(rows, survey), [], {}
    rng = np.random.default_rng(0) if rng is None else rng
    for kind in effects:
        if kind.stage in NEEDS_MOUNTING and survey.mounting is None:
            left_out[kind.name] = (
                f"{kind.name} acts on the {kind.stage}, and the survey has no [mounting]."
            )
            continue
        several = [signature(bench, kind, fixed, rng) for fixed in _bank(kind, rows, survey)]
        several = [one for one in several if one.jacobian.any() or one.is_noise]
        found += several
        if not several:
            left_out[kind.name] = f"No row of this survey depends on {kind.name}."
    return tuple(found), left_out


def signature(bench, kind, fixed, rng):
    """Signature of one effect class with what is fixed, such as the time of an event."""
    rows, size = bench.rows, kind.quantities()["magnitude"]
    m, none = len(rows), np.zeros(len(rows))
    typical = size.typical if size.typical is not None else 1e-3 * size.largest
    if kind.random or kind.stage in ("return", "beam"):
        step = TEST_LOSS * min(1.0, size.largest) if kind.stage == "return" else typical
        change = bench.change(kind(magnitude=step, **fixed), rng)
        jacobian, variance, growth = (
            (change.shift / step)[:, None],
            change.variance / step**2,
            change.growth / step**2,
        )
        return Signature(
            kind, fixed, ("magnitude",), (size.unit,), np.array([typical]),
            jacobian, variance, growth,
        )  # fmt: skip
    tries = _tries(kind, size, fixed)
    jacobian, step = np.zeros((m, len(tries))), STEP * typical
    for column, (_, unit, more) in enumerate(tries):
        ends = [
            bench.change(kind(magnitude=_scaled(unit, sign * step), **more)).shift
            for sign in ((-1, 1) if size.least is None else (0, 1))
        ]
        jacobian[:, column] = (ends[1] - ends[0]) / (step * (2 if size.least is None else 1))
    names = tuple(name for name, _, _ in tries)
    return Signature(
        kind, fixed, names, (size.unit,) * len(tries), np.full(len(tries), typical),
        jacobian, none, none,
    )  # fmt: skip


def _tries(kind, size, fixed):
    """For each column: its name, unit vector or 1 of the magnitude, and further parameters."""
    if size.count > 1:
        names = AXES.get(kind.stage, tuple(f"magnitude {i + 1}" for i in range(size.count)))
        return [(names[i], np.eye(size.count)[i], fixed) for i in range(size.count)]
    if "phase" in kind.quantities():  # magnitude sin(x - phase) = a sin(x) - b cos(x)
        return [
            ("magnitude cos(phase)", 1.0, {**fixed, "phase": 0.0}),
            ("magnitude sin(phase)", 1.0, {**fixed, "phase": np.pi / 2}),
        ]
    return [("magnitude", 1.0, fixed)]


def _scaled(unit, step):
    return float(unit * step) if np.ndim(unit) == 0 else (unit * step).tolist()


def _bank(kind, rows, survey):
    """Sets of fixed parameters at which an effect is tried."""
    needed = {f.name: f for f in fields(kind) if f.default is MISSING and f.name != "magnitude"}
    if "target" in needed:
        used = np.unique(rows.survey_item[rows.survey_item >= 0])
        return [{"target": rows.targets.name[i]} for i in used]
    known = kind.quantities()
    rest = {name: known[name].typical for name in needed if name not in ("time", "width")}
    if "time" not in needed:
        return [rest]
    widths = WIDTHS if "width" in known else (None,)
    return [
        {**rest, "time": time, **({} if width is None else {"width": width})}
        for width in widths
        for time in _times(rows, survey, STEP_SPACING if width is None else width)
    ]


def _times(rows, survey, spacing):
    """Times of events from reference.start, spread over the time in which things were seen. s."""
    seen = rows.gps_time[rows.metric]
    if len(seen) == 0:
        return []
    seen = np.append(seen, rows.gps_time_2[rows.two_times])
    low, high = seen.min(), seen.max()
    gaps = survey.trajectory.gaps
    inside = np.clip(gaps, low, high)
    lost = float((inside[:, 1] - inside[:, 0]).sum())
    number = int(np.clip((high - low - lost) / spacing, 1, EVENTS))
    # evenly over the time without gaps
    elapsed = (np.arange(number) + 0.5) / number * (high - low - lost)
    times = low + elapsed
    for start, end in inside:
        times = np.where(times >= start, times + (end - start), times)
    times = times[survey.trajectory.segment(times) >= 0]
    return [float(round(time - rows.reference.start, 3)) for time in times]


def select(signatures, rows):
    """Signatures in some rows, (m,) bool, alone: a tuple."""
    return tuple(
        replace(
            one, jacobian=one.jacobian[rows], variance=one.variance[rows], growth=one.growth[rows]
        )
        for one in signatures
    )

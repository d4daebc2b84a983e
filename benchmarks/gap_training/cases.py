"""Cases on which a decision is trained: nothing, noise, effects, or a mechanism of no library."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from gap_training.errors import process
from gap_training.worlds import World
from mlscorr.effects import effect_class
from mlscorr.effects.catalogue import RANDOM, SYSTEMATIC
from mlscorr.gap.plan import Ruler, draw_effects, draw_mechanism, names_to_try
from mlscorr.gap.plan.draws import draw_effect
from mlscorr.gap.residuals import Background, Rows, with_loss_variance
from mlscorr.gap.signatures import Bench, Signature
from mlscorr.simulate import Described, described, load_mechanisms
from mlscorr.simulate._mechanisms import training_mechanisms
from mlscorr.simulate.pos import interpolate
from mlscorr.survey import Survey

SHARES = {  # of cases: as the blind check's, with more noise, of which there are fewer names
    **{"clean": 0.22, "noise": 0.12, "single": 0.34, "pair": 0.10, "withheld": 0.10},
    "outside": 0.12,
}
SIZES = {  # MDB, between which sizes are drawn evenly by their logs
    **{"single": (1.0, 8.0), "pair": (2.0, 6.0), "withheld": (2.0, 8.0), "outside": (2.0, 8.0)},
    "noise": (1.0, 8.0),
}
DRIFTS = 0.3  # share of cases of position noise in which drift is larger than stated


@dataclass(frozen=True)
class TrainingCase:
    """A survey to diagnose, and the effects in it.

    Parameters
    ----------
    kind : str
        One of SHARES.
    names : tuple of str
        Effects, noise, or the mechanism.
    mdb : float
    rows : Rows
    background : Background
    survey : Survey
    signatures : tuple of Signature
        Those of the library.
    likeness : dict
        Squared correlation of one effect or mechanism with each effect of the whole library.
    """

    kind: str
    names: tuple[str, ...]
    mdb: float
    rows: Rows
    background: Background
    survey: Survey
    signatures: tuple[Signature, ...]
    likeness: dict[str, float]

    @property
    def truth(self) -> str:
        """The correct label."""
        if self.kind in ("withheld", "outside"):
            return "unknown"
        return "+".join(self.names) or "none"


def known_mechanisms(path: Path | None = None) -> Described:
    """Mechanisms on which a decision may be trained: half of the grammar, and those of a file.

    Parameters
    ----------
    path : Path, optional
        File with MECHANISMS, LEADS and UNITS.
    """
    known = described(training_mechanisms())
    if path is None:
        return known
    return known | load_mechanisms(path)


def draw_case(
    world: World,
    rng: Generator,
    mechanisms: Described,
    kind: str | None = None,
    mdb: float | None = None,
) -> TrainingCase:
    """Draw a TrainingCase in a world; a clean one if the drawn effect is not observable.

    Parameters
    ----------
    world : World
    rng : Generator
    mechanisms : dict
        Function, unit with largest size, and hint, by name.
    kind : str, optional
        One of SHARES; drawn by default.
    mdb : float, optional
        Size in minimal detectable biases; drawn by default.
    """
    if kind is None:
        drawn = str(rng.choice(list(SHARES), p=list(SHARES.values())))
    else:
        drawn = kind
    rows, background, survey = world.errors(rng)
    case = TrainingCase(drawn, (), 0.0, rows, background, survey, world.signatures, {})
    if drawn == "clean":
        return case
    low, high = np.log(SIZES[drawn])
    if mdb is None:
        size = float(np.exp(rng.uniform(low, high)))
    else:
        size = mdb
    ruler = Ruler.of(rows, survey)
    acted = {"noise": _noisy, "outside": _moved}.get(drawn, _changed)(
        case, ruler, rng, size, mechanisms
    )
    if acted is None:
        return replace(case, kind="clean")
    return acted


def _changed(case, ruler, rng, size, _):
    """The case with one or two effects at finite size; withheld ones are not in the library."""
    number = 2 if case.kind == "pair" else 1
    names = names_to_try(SYSTEMATIC, rng)
    drawn = draw_effects(ruler, case.signatures, names, number, size, rng)
    if drawn is None:
        return None
    bench = Bench(case.rows, case.survey)
    names = tuple(sized.effect.name for sized, _ in drawn)
    shift = sum(bench.change(sized.effect).shift for sized, _ in drawn)
    without = names[0] if case.kind == "withheld" else None
    return replace(
        case,
        names=names,
        mdb=min(sized.mdb for sized, _ in drawn),
        likeness=drawn[-1][1],
        rows=replace(case.rows, residual=case.rows.residual + shift),
        signatures=tuple(sign for sign in case.signatures if sign.name != without),
    )


def _moved(case, ruler, rng, size, mechanisms):
    """The case with a mechanism outside the library, unlike all effects."""
    names = names_to_try(list(mechanisms), rng)
    drawn = draw_mechanism(ruler, case.signatures, names, mechanisms, size, rng)
    if drawn is None:
        return None
    moved, shift, like = drawn
    rows = replace(case.rows, residual=case.rows.residual + shift)
    return replace(case, names=(moved.name,), mdb=size, rows=rows, likeness=like)


def _noisy(case, ruler, rng, size, _):
    """The case with noise, which the scatter of points shows too."""
    if (case.rows.channel == "roughness").any():
        shown = RANDOM
    else:
        shown = ("position_noise",)
    # without roughness, the stated noise comprises all of a row's own
    for name in names_to_try(shown, rng):
        if name == "position_noise" and rng.random() < DRIFTS:
            return _drifting(case, rng, size)
        drawn = draw_effect(ruler, effect_class(name), size, rng)
        if drawn is None:
            continue
        rows = case.rows
        if effect_class(name).is_of_pose():
            shift = _of_pose(case, drawn.effect, rng)
            extra = 0.0
        else:
            change = Bench(rows, case.survey).change(drawn.effect, rng)
            own = np.sqrt(change.variance) * rng.standard_normal(len(rows))
            lost = rng.binomial(rows.points, -np.clip(change.shift, -1.0, 0.0)) / rows.points
            shift = own + np.log1p(change.growth) - lost
            extra = change.variance
        rows = replace(rows, residual=rows.residual + shift, noise=rows.noise + extra)
        rows = with_loss_variance(rows)
        return replace(case, names=(name,), mdb=drawn.mdb, rows=rows)
    return None


def _of_pose(case, effect, rng):
    """Residuals (m,) caused by a noisy position."""
    rows = case.rows
    path = case.survey.trajectory
    moved = effect.apply(path, rows.reference, rng).position - path.position
    return _by_position(rows, lambda at: interpolate(at, path.gps_time, moved))


def _drifting(case, rng, size):
    """The case with more drift than is stated: everywhere, or in an interval."""
    rows = case.rows
    trajectory = case.survey.trajectory
    time = rows.gps_time[rows.metric]
    start = float(rng.choice(time))
    length = float(rng.uniform(15.0, 50.0))
    everywhere = rng.random() < 0.5
    sigma = trajectory.position_sigma.mean() * (2.0 + size) * (1.0 if everywhere else 2.0)
    grid = np.arange(trajectory.gps_time[0], trajectory.gps_time[-1] + 1.0, 1.0)
    drift = np.column_stack(
        [process(rng, grid, str(rng.choice(["sines", "walk"]))) for _ in range(3)]
    )
    if not everywhere:  # grows until GNSS is back
        part = (grid - start) / length
        drift *= np.where((part >= 0) & (part < 1), 2.0 * part, 0.0)[:, None]
    shift = sigma * _by_position(rows, lambda at: interpolate(at, grid, drift))
    rows = replace(rows, residual=rows.residual + shift)
    return replace(case, names=("position_noise",), mdb=size, rows=rows)


def _by_position(rows, moved):
    """Shift (m,) of the residuals by a position error over time."""
    shift = np.einsum("mi,mi->m", rows.partials[:, :3], moved(rows.gps_time))
    second = np.where(rows.two_times, rows.gps_time_2, rows.gps_time)
    return shift + np.einsum("mi,mi->m", rows.partials_2[:, :3], moved(second))

"""What a simulator's effects make of the rows, and the rows without it."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from mlscorr.effects import EFFECTS, Effect
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures._signatures import Signature, too_far
from mlscorr.gap.signatures.changes import Bench, Change
from mlscorr.survey import Survey


def expected(rows: Rows, survey: Survey, effects: Iterable[Effect]) -> Change:
    """What effects that a simulator has already make of the rows: one Change of all.

    Take ``shift + log(1 + growth)`` from the residuals, add ``variance`` to their noise.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    effects : iterable of Effect

    Raises
    ------
    ValueError
        For a user's own that moves everything by more than any survey is off.
    """
    bench = Bench(rows, survey)
    total = np.zeros((3, len(rows)))
    for effect in effects:
        change = bench.change(effect)
        what = f"The simulator's {effect.name} of {effect.magnitude}"
        if type(effect) not in EFFECTS and (why := too_far(rows, change.shift, what)):
            raise ValueError(why)
        total += _shift(bench, effect, change), change.variance, change.growth
    return Change(*total)


def _shift(bench, effect, change):
    """Shift (m,) that takes what was recorded to what is true: a change, or an opposite effect's.

    They differ by twice the second order.
    """
    with suppress(ValueError):  # of an effect that has no other sign
        opposite = replace(effect, magnitude=(-np.asarray(effect.magnitude)).tolist())
        return np.where(bench.rows.metric, -bench.change(opposite).shift, change.shift)
    return change.shift


def without_effects(rows: Rows, survey: Survey, effects: Sequence[Effect]) -> Rows:
    """Rows as observed minus what a simulator with effects expects.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    effects : sequence of Effect
    """
    change = expected(rows, survey, effects)
    common = [effect for effect in effects if effect.random and effect.stage == "pos"]
    # the noise of each row's own comes from its points, in which theirs is already
    noise = rows.noise + expected(rows, survey, common).variance
    residual = rows.residual - change.shift - np.log1p(change.growth)
    return replace(rows, residual=residual, noise=noise)


def curvature(
    rows: Rows, survey: Survey, parts: Iterable[tuple[Signature, np.ndarray]]
) -> np.ndarray:
    """What effects make of the rows beyond the first order (m,), in the unit of each.

    Parameters
    ----------
    rows : Rows
    survey : Survey
    parts : iterable of (Signature, (p,) array)
        With their sizes. Random ones are left out.
    """
    bench = Bench(rows, survey)
    curved = np.zeros(len(rows))
    for part, size in (pair for pair in parts if not pair[0].kind.random):
        with suppress(ValueError):  # of an effect that has no other sign
            # truth is what was recorded, less the effect
            curved -= bench.change(part.effect(-size)).shift + part.jacobian @ size
    return curved

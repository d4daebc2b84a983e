"""Each effect alone: what gap it leaves, put into the simulator at the size that fits best."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from mlscorr.gap.closure._systematic import unit_square
from mlscorr.gap.evidence import SETTINGS, Explanations, Inference, cause_of, signed_root
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import Signature


@dataclass(frozen=True)
class LoneEffect:
    """The systematic gap with one effect in the simulator, in the rows in which it was found.

    Parameters
    ----------
    effect : str
    probability : float
        That it is the cause.
    before, after : float
        Signed. Units: mm.
    """

    effect: str
    probability: float
    before: float
    after: float


@threadpool_limits.wrap(limits=1, user_api="blas")
def lone_effects(
    rows: Rows, signatures: Sequence[Signature], inference: Inference, rng: np.random.Generator
) -> tuple[LoneEffect, ...]:
    """The gap with each effect that shifts rows, the one that leaves least first.

    Parameters
    ----------
    rows : Rows
    signatures : sequence of Signature
    inference : Inference
        Of these.
    rng : numpy.random.Generator
        Draws replicas.
    """
    evidence = inference.evidence
    o = evidence.observations
    table = evidence.table
    names = [name for name in table.effects if name not in evidence.noisy]
    chance = inference.probability
    causes = [cause_of(rows, signatures, evidence, name, chance.get(name, 0.0)) for name in names]
    model = evidence.likely_model(inference.verdict.label)
    shifts = np.array([np.zeros(len(rows)), *(cause.shift for cause in causes)]).T
    both = np.hstack([rows.residual[:, None] - shifts, table.columns])
    white = o.whitener(model).innovations(o.columns(both))[0]
    rest = white[:, : len(names) + 1]
    columns = white[:, len(names) + 1 :]
    explanations = Explanations.of(table, columns)
    usual = explanations.largest(rng.standard_normal((len(o), SETTINGS.replicas)))[0].mean()
    square = unit_square(o, model) * (explanations.largest(rest)[0] - usual)
    before, *after = signed_root(square).tolist()
    effects = [
        LoneEffect(name, float(cause.probability), before, left)
        for name, cause, left in zip(names, causes, after, strict=True)
    ]
    return tuple(sorted(effects, key=lambda each: each.after))

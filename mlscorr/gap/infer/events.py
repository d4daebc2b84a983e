"""Events between the times and widths of the bank: the best one, refined."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlscorr.gap.infer.columns import ColumnTable, column_table, is_of_one_target
from mlscorr.gap.infer.error_models import ErrorModel
from mlscorr.gap.infer.evidence import BlockEvidence, weigh_blocks
from mlscorr.gap.infer.observations import Observations
from mlscorr.gap.infer.settings import SETTINGS
from mlscorr.gap.observe.rows import Rows
from mlscorr.gap.signatures.changes import Bench
from mlscorr.gap.signatures.settings import SETTINGS as SIGNATURES
from mlscorr.gap.signatures.signatures import Signature, signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class RefinedEvent:
    """The most probable time and width of an event.

    Parameters
    ----------
    signature : Signature
    table : ColumnTable
        Of it alone.
    gain : float
        Log evidence over that of none, counted as the bank's are.
    sigma : dict
        Of time and width, by the curvature of the evidence. Units: s.
    """

    signature: Signature
    table: ColumnTable
    gain: float
    sigma: dict[str, float]


def refine_events(
    rows: Rows,
    survey: Survey,
    observations: Observations,
    bank: ColumnTable,
    evidence: BlockEvidence,
    signatures: Sequence[Signature],
) -> dict[str, RefinedEvent]:
    """Refined events by their labels, where the bank has one that stands out.

    Parameters
    ----------
    rows, survey, observations, signatures
        Of one survey.
    bank : ColumnTable
    evidence : BlockEvidence
        Of the residual, first column, by the bank.
    """
    refined = {}
    for label in bank.effects:
        best = bank.best(label, evidence.gain[:, 0])
        member = bank.blocks[best].member
        if not signatures[member].kind.moment() or evidence.gain[best, 0] < SETTINGS.refinement:
            continue
        numbers = [
            i for i, block in enumerate(bank.blocks)
            if block.label == label and block.member == member
        ]  # fmt: skip
        score = evidence.by_model[:, numbers].max(axis=1)
        models = tuple(evidence.models[s] for s in np.argsort(-score)[:3])  # others add little
        share, none = sum(bank.blocks[i].weight for i in numbers), float(evidence.total[0])
        search = _Search(rows, survey, observations, models, none)
        refined[label] = search.best(signatures[member], share)
    return refined


@dataclass(frozen=True)
class _Search:
    rows: Rows
    survey: Survey
    observations: Observations
    models: tuple[ErrorModel, ...]
    none: float  # log evidence of none by all models: by these, which suit the event, it is less

    def score(self, event):
        """Log evidence over none of a signature, and its table."""
        table = column_table(self.rows, (event,), (), self.observations.sigma)
        residual = self.observations.columns(self.rows.residual[:, None])
        evidence = weigh_blocks(self.observations, self.models, residual, table)
        gain = evidence.gain + evidence.total - self.none
        return float(np.logaddexp.reduce(table.weighed(gain)[:, 0])), table

    def changed(self, event, key, step):
        """The signature at another time or width, or None where there is none."""
        fixed = dict(event.fixed)
        if key == "time":
            fixed["time"] = round(
                fixed["time"] + step * fixed.get("width", SIGNATURES.step_spacing), 3
            )
        else:
            fixed["width"] = float(fixed["width"] * np.exp(2 * step))
        bench = Bench(self.rows, self.survey)
        try:
            moved = signature(bench, event.kind, fixed, np.random.default_rng(0))
        except ValueError:  # a time in no pass, or a width beyond its limits
            return None
        if is_of_one_target(self.rows, moved.jacobian):
            return None
        return moved if moved.jacobian[self.rows.metric].any() else None

    def best(self, event, share):
        """The RefinedEvent near an event of the bank with a prior share."""
        gain, table = self.score(event)
        keys = event.kind.moment()
        for step in SETTINGS.event_steps:
            for key in keys:
                for change in (-step, step):
                    moved = self.changed(event, key, change)
                    if moved is None:
                        continue
                    value, other = self.score(moved)
                    if value > gain:
                        event, gain, table = moved, value, other
        sigma = {key: self._sigma(event, key, gain) for key in keys}
        return RefinedEvent(event, table, gain + np.log(share / SETTINGS.cell), sigma)

    def _sigma(self, event, key, gain):
        """By the fall of the evidence one step to both sides; the step itself where there is
        none.
        """
        step, fixed = SETTINGS.event_steps[-1], event.fixed
        scale = fixed.get("width", SIGNATURES.step_spacing) if key == "time" else 2 * fixed["width"]
        sides = [self.changed(event, key, change) for change in (-step, step)]
        falls = [gain - self.score(moved)[0] for moved in sides if moved is not None]
        fall = np.mean(falls) if falls else 0.0
        return float(step * scale * (1 / np.sqrt(2 * fall) if fall > 0.01 else 1 / step))

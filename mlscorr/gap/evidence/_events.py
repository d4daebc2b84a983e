"""Refinement of the best event between the times and widths of the bank."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from mlscorr.gap.evidence.evidence import (
    BlockEvidence,
    ColumnTable,
    column_table,
    is_of_one_target,
    weigh_blocks,
)
from mlscorr.gap.evidence.observations import ErrorModel, Observations, shares
from mlscorr.gap.evidence.settings import SETTINGS
from mlscorr.gap.residuals import Rows
from mlscorr.gap.signatures import SETTINGS as SIGNATURES
from mlscorr.gap.signatures import Bench, Signature, signature
from mlscorr.survey import Survey


@dataclass(frozen=True)
class RefinedEvent:
    """Most probable time and width of an event.

    Parameters
    ----------
    signature : Signature
    table : ColumnTable
        Table of this event only.
    gain : float
        Log evidence over that of none, with the same prior as in the bank.
    sigma : dict
        Sigmas of time and width, from the curvature of the evidence. Units: s.
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
    """Refine significant events of the bank, by label.

    Parameters
    ----------
    rows, survey, observations, signatures
        All of one survey.
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
            i
            for i, block in enumerate(bank.blocks)
            if block.label == label and block.member == member
        ]
        score = evidence.by_model[:, numbers].max(axis=1)
        models = tuple(evidence.models[s] for s in np.argsort(-score)[:3])  # others add little
        share = sum(bank.blocks[i].weight for i in numbers)
        none = float(evidence.total[0])
        search = _Search(rows, survey, observations, models, none)
        event = signatures[member]
        times = [s.fixed["time"] for s in signatures if s.name == label]
        refined[label] = search.best(event, share, _spacing_of(times))
    return refined


def _spacing_of(times: Sequence[float]) -> float:
    """Time step between trial events of one kind. Units: s.

    Parameters
    ----------
    times : sequence of float
        In any order, once for each width.

    >>> _spacing_of([3.0, 1.0, 5.0])
    2.0
    """
    intervals = np.diff(np.unique(times))
    if len(intervals):
        return float(np.median(intervals))
    return SIGNATURES.step_spacing


@dataclass(frozen=True)
class _Search:
    rows: Rows
    survey: Survey
    observations: Observations
    models: tuple[ErrorModel, ...]
    none: float  # log evidence of none by all models: less by these, which suit the event

    def score(self, event):
        """Log evidence over none of a signature, and its table."""
        table = column_table(self.rows, (event,), (), self.observations.sigma)
        residual = self.observations.columns(self.rows.residual[:, None])
        evidence = weigh_blocks(self.observations, self.models, residual, table)
        gain = evidence.gain + evidence.total - self.none
        return float(np.logaddexp.reduce(table.weighed(gain)[:, 0])), table

    def moved(self, event, **fixed):
        """Signature at another time or width, or None if there is none."""
        bench = Bench(self.rows, self.survey)
        try:
            moved = signature(bench, event.kind, event.fixed | fixed, np.random.default_rng(0))
        except ValueError:  # a time in no pass, or a width beyond its limits
            return None
        if is_of_one_target(self.rows, moved.jacobian):
            return None
        if moved.jacobian[self.rows.metric].any():
            return moved
        return None

    def best(self, event, share, spacing):
        """RefinedEvent near an event of the bank with a prior share."""
        if "width" in event.fixed:
            event, gain, table, sigma = self._by_steps(event)
        else:
            event, gain, table, sigma = self._between_rows(event, spacing)
        return RefinedEvent(event, table, gain + np.log(share / SETTINGS.event_cell), sigma)

    def _between_rows(self, event, spacing):
        """Event without a width: between two rows its evidence is constant, and there are
        secondary peaks. The most probable interval, first among those a fraction of the spacing
        apart, then by bisection.
        """
        time = event.fixed["time"]
        parts = int(4 / SETTINGS.event_steps[-1])
        edges = self._edges(time, 2 * spacing)
        middle = (edges[1:] + edges[:-1]) / 2
        length = np.diff(edges)
        times = np.append(np.linspace(edges[0], edges[-1], parts)[1:-1], time)
        number = np.unique(np.searchsorted(edges, times) - 1)
        tried = {i: self._at(event, middle[i]) for i in number.tolist()}
        while True:
            order = sorted(tried)
            score = np.array([tried[i][0] for i in order]) + np.log(length[order])
            at = int(np.argmax(score))
            best = order[at]
            neighbors = {(best + other) // 2 for other in (*order[:at][-1:], *order[at + 1 :][:1])}
            if neighbors <= tried.keys():
                break
            tried |= {i: self._at(event, middle[i]) for i in neighbors - tried.keys()}
        gain, table, event = tried[best]
        off = (middle[order] - middle[best]) ** 2 + length[order] ** 2 / 12
        return event, gain, table, {"time": float(np.sqrt(shares(score) @ off))}

    def _edges(self, time, span):
        """Times close to one at which an event changes other rows: those of rows and passes.
        Units: s.
        """
        rows = self.rows
        passes = self.survey.trajectory.passes.ravel()
        times = rows.gps_time[rows.metric], rows.gps_time_2[rows.two_times]
        known = np.unique(np.round(np.concatenate([passes, *times]) - rows.reference.start, 2))
        known = known[np.abs(known - time) < span]
        return np.concatenate([[time - span], known, [time + span]])

    def _at(self, event, time):
        """Score, table and signature at another time; minus infinity if there is none."""
        moved = self.moved(event, time=round(float(time), 3))
        if moved is None:
            return (-np.inf, None, None)
        return (*self.score(moved), moved)

    def _by_steps(self, event):
        """Event with a width: by halved steps, until the evidence decreases by less than a
        factor e on all sides. A drift of meters determines its time to milliseconds.
        """
        gain, table = self.score(event)
        keys = event.kind.moment()
        step = 2 * SETTINGS.event_steps[0]
        fall = np.inf
        while step > SETTINGS.event_steps[-1] or fall > 1:
            step = step / 2
            gained = True
            while gained:
                gained = False
                fall = 0.0
                for key, sign in product(keys, (-1, 1)):
                    moved = self._changed(event, key, sign * step)
                    value, other = (-np.inf, None) if moved is None else self.score(moved)
                    if value > gain:
                        event = moved
                        gain = value
                        table = other
                        gained = True
                    elif moved is not None:
                        fall = max(fall, gain - value)
        return event, gain, table, {key: self._sigma(event, key, gain, step) for key in keys}

    def _changed(self, event, key, step):
        """Signature with another time or width, or None if there is none."""
        time = event.fixed["time"]
        width = event.fixed["width"]
        if key == "time":
            return self.moved(event, time=round(time + step * width, 3))
        return self.moved(event, width=float(width * np.exp(2 * step)))

    def _sigma(self, event, key, gain, step):
        """Sigma from the decrease of the evidence one step to both sides; otherwise the step
        itself.
        """
        width = event.fixed["width"]
        if key == "width":
            width = 2 * width
        sides = [self._changed(event, key, change) for change in (-step, step)]
        falls = [gain - self.score(moved)[0] for moved in sides if moved is not None]
        fall = np.mean(falls) if falls else 0.0
        if fall > 0.01:
            return float(step * width * (1 / np.sqrt(2 * fall)))
        return float(step * width * (1 / step))

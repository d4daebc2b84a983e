"""``diagnose``: differences of a survey from its simulation, causes, and closure of the gap.

``--until-none`` adds one effect after another to the simulator, until no gap remains.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mlscorr.effects import Effect, known_effects, lowered, title
from mlscorr.gap import (
    assumed_document,
    cause_document,
    contrast,
    gap_document,
    likely_scale,
    no_cause,
    open_sigmas,
    windows_document,
    with_scale,
)
from mlscorr.gap.closure import (
    Closure,
    FoundCause,
    LoneEffect,
    cause_for_simulator,
    close_gap,
    lone_effects,
)
from mlscorr.gap.evidence import Costs, Inference, infer_causes
from mlscorr.gap.plan import NextData, next_data
from mlscorr.gap.residuals import Absence, Rows, background
from mlscorr.gap.signatures import Signature, as_assumed, curvature, select, signatures, with_cause
from mlscorr.pipeline._result import KnownResult, ResultFiles
from mlscorr.pipeline.compared_rows import compare_with_belief, compare_with_clouds
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.found_effects import cloud_rows
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.simulate import Simulator, beliefs_of, write_simulator
from mlscorr.survey import Statement, Survey, check_rng, check_survey, rows_frame

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

STEPS = 6  # of the progress besides reading: inference, closure, plan


def diagnose(
    survey: Survey,
    simulator: Simulator | None = None,
    library: Iterable[type[Effect]] | None = None,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    simulated: Sequence[Path] = (),
    costs: Costs | None = None,
) -> DiagnosedSurvey:
    """Find differences of a survey from its simulation, their cause, and the closure of the gap.

    Parameters
    ----------
    survey : Survey
        With surveyed targets, a reference surface, or planes in overlaps.
    simulator : Simulator, optional
        Assumptions, from read_simulator; by default those of survey.toml.
    library : iterable of Effect classes, optional
        Effects to consider; all known ones by default.
    rng : numpy.random.Generator, optional
        For replicas and the simulator's noise; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number just done.
    simulated : sequence of Path
        Clouds of this survey from your own simulator: a survey folder, a folder of LAS or LAZ
        files, or a file. The survey is compared with them instead of with the assumptions; they
        already include effects of the simulator. Those of its next run, with the effect, show the
        reduction of the gap.
    costs : Costs, optional
        Costs of a false alarm, a miss and of unknown, relative to a wrong name, for the choice of
        the label.

    Raises
    ------
    ValueError
        If there are too few data, or a reference surface, the simulator or the costs are unusable.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(
    ...     drive={"duration": 25.0},
    ...     targets={"control": 8, "check": 2},
    ...     scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    ...     effects=[{"name": "time_offset", "magnitude": 0.02}],
    ... )
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> found = mlscorr.diagnose(mlscorr.read_survey(folder))
    >>> found.document["verdict"]["label"]
    'time_offset'
    """
    check_survey(survey)
    if rng is None:
        rng = np.random.default_rng(SETTINGS.seed)
    check_rng(rng)
    costs = Costs() if costs is None else costs
    if not all(0 <= cost < np.inf for cost in vars(costs).values()):
        raise ValueError(f"{costs} is invalid: each cost must be a finite number of 0 or more.")
    survey.check_one_scanner("a diagnosis")
    library = known_effects() if library is None else library
    progress = progress or silent
    if simulator is None:
        simulator = beliefs_of(survey)
    if simulated:  # the clouds show the noise of the simulator's scanner
        simulator = replace(simulator, scanner=replace(simulator.scanner, assumed=()))
    assumed, effects = as_assumed(survey, simulator)
    if simulated:
        if isinstance(simulated, str | Path):
            simulated = [simulated]
        compared = compare_with_clouds(survey, assumed, simulated, library, rng, progress)
    else:
        compared = compare_with_belief(survey, assumed, effects, library, rng, progress)
    observed = compared.rows
    used = compared.used
    absence = compared.absence
    step = progress("Comparing the hypotheses", STEPS)
    signs, left_out = signatures(observed, assumed, library, rng)
    part = observed.select(used)
    signs_of_part = select(signs, observed, used)
    # so that the search for the scale does not change the random draws of the verdict
    scale = likely_scale(part, assumed, signs_of_part, rng.spawn(1)[0])
    assumed = replace(assumed, pos=with_scale(assumed.pos, scale, open_sigmas(assumed)))
    step(1)
    errors = background(part, assumed)
    infer = partial(infer_causes, survey=assumed, signatures=signs_of_part, absence=absence)
    inference = infer(part, errors, rng=rng, costs=costs)
    curved = curvature(part, assumed, inference.cause.parts)
    if np.sum(curved**2 / part.noise) > 1:  # less is not a sigma, for all rows together
        part = replace(part, residual=part.residual - curved)
        inference = infer(part, errors, rng=rng, costs=costs)
    step(2)
    cause = cause_for_simulator(part, signs_of_part, inference)
    change = compared.simulated
    case = FoundCause(observed, used, assumed, signs, inference.evidence, cause)
    closure = close_gap(case, change, rng, step)
    labels = [n for n in (*inference.verdict.set, *inference.same) if n != "unknown"]
    plan = next_data(part, assumed, library, tuple(dict.fromkeys(labels)), inference.separability)
    plan = (*_repeat_advice(absence), *plan)
    step(2)
    return DiagnosedSurvey(
        survey,
        simulator,
        effects,
        part,
        inference,
        closure,
        plan,
        left_out,
        compared.notes,
        absence,
        signs_of_part,
        costs,
        compared.contrasts,
        (*compared.distances, *_of_innovations(part, errors, inference, rng)),
        compared.next_run,
        scale,
    )


def _of_innovations(rows, errors, inference, rng):
    """DistributionDistances of innovations from those of replicas, by channel."""
    where = inference.where
    replicas = contrast.replica_innovations(rows, errors, inference, rng)
    return contrast.innovation_distances(rows.channel[where.row], where.innovation, replicas, rng)


def _repeat_advice(absence):
    """Advice on surveyed targets without a residual."""
    return [
        NextData(
            f"the interval from {run.gps_time[0]:.1f} to {run.gps_time[-1]:.1f} s again, with "
            f"its targets {', '.join(run.distinct)}",
            f"{len(run.distinct)} neighboring targets in range have no residual, so errors there "
            "are unknown.",
        )
        for run in absence.runs
    ]


@dataclass(frozen=True, repr=False)
class DiagnosedSurvey(KnownResult):
    """Survey with its diagnosis: the document of gap.json, and ``write``.

    ``scale`` is the factor on unstated sigmas of the POS.
    """

    _name = "gap"
    survey: Survey
    simulator: Simulator
    effects: tuple[Effect, ...]
    rows: Rows
    inference: Inference
    closure: Closure
    next_data: tuple[NextData, ...]
    left_out: dict[str, Statement]
    warnings: tuple[str, ...]
    absence: Absence = field(default_factory=Absence)
    signatures: tuple[Signature, ...] = ()
    costs: Costs = field(default_factory=Costs)
    contrasts: tuple[contrast.Contrast, ...] = ()
    distances: tuple[contrast.DistributionDistance, ...] = ()
    next_run: Statement | None = None
    scale: float = 1.0

    @property
    def _assumed(self):
        """Survey as diagnosed."""
        assumed, _ = as_assumed(self.survey, self.simulator)
        pos = with_scale(assumed.pos, self.scale, open_sigmas(assumed))
        return replace(assumed, pos=pos)

    def _content(self):
        from mlscorr.report.gap import gap_screen

        assumed = self._assumed
        content = gap_document(
            survey=assumed,
            rows=self.rows,
            inference=self.inference,
            closure=self.closure,
            next_data=self.next_data,
            effects=self.effects,
            left_out=self.left_out,
            warnings=self.warnings,
            absence=self.absence,
            further_advice=self._further_advice,
        )
        content["assumed"] = assumed_document(assumed, self.inference, self.scale)
        content["costs"] = vars(self.costs)
        content["contrasts"] = [contrast.document() for contrast in self.contrasts]
        content["distances"] = [distance.document() for distance in self.distances]
        return gap_screen(content) | content

    @property
    def _has_named_cause(self):
        """True if the named cause is an effect that a simulator can apply."""
        return self.inference.verdict.label not in ("none", "unknown")

    @property
    def _further_advice(self):
        """Statements on the next run, and on non-geometric channels."""
        advice = []
        if self._has_named_cause:
            why = self._improvement[1]
            if why:
                advice.append(Statement("simulator as it was", "warning", {"why": why}))
            elif self.next_run is not None:
                advice.append(self.next_run)
        if any(contrast.sentences for contrast in self.contrasts):
            advice.append(Statement("channels"))
        return advice

    @property
    def improved(self) -> Simulator:
        """Simulator with the cause, or unchanged if it cannot apply it."""
        return self._improvement[0]

    @cached_property
    def _improvement(self):
        """Simulator with the cause, or unchanged with the reason."""
        if not self._has_named_cause:
            return self.simulator, ""
        assumed = self._assumed
        names = open_sigmas(assumed)
        try:
            improved = with_cause(
                replace(self.simulator, pos=assumed.pos), self.survey, self.inference.cause
            )
            if set(names) <= set(improved.pos.assumed):  # the next run estimates their scale again
                pos = with_scale(improved.pos, 1.0 / self.scale, names)
                improved = replace(improved, pos=pos)
            return improved, ""
        except ValueError as error:  # larger than possible
            return self.simulator, str(error)

    def to_frame(self) -> pandas.DataFrame:
        """Return a data frame with a row per parameter of the causes, best first; requires
        pandas.
        """
        return rows_frame(
            {"effect": cause["effect"], "probability": cause["probability"], **parameter}
            for cause in self.document["causes"]
            for parameter in cause["parameters"]
        )

    def plot(self, name: str = "where") -> Figure:
        """Draw a figure of the page.

        Parameters
        ----------
        name : str
            ``where``, ``innovations`` (over time), ``evidence``, ``separability``, ``closure``,
            ``channels`` or ``map``.

        Raises
        ------
        ValueError
            If there is no such figure, or it would be empty.
        """
        from mlscorr.report import draw
        from mlscorr.report.gap import diagnosis_figures

        return draw(diagnosis_figures(self.document), name)

    def _overview(self):
        """Return the rows that a notebook shows."""
        content = self.document
        sentences = [content["verdict"]["sentence"], content["headline"], *content["advice"]]
        return [(sentence,) for sentence in (self.survey.name, *sentences)]

    def _files(self):
        return gap_files(self.document, self.survey, self.improved)


def gap_files(content: dict, survey: Survey, simulator: Simulator) -> ResultFiles:
    """Make the files gap.json, gap.html and simulator.toml.

    Parameters
    ----------
    content : dict
        Document of gap.json.
    survey : Survey
    simulator : Simulator
        With the cause.
    """
    from mlscorr.report.gap import diagnosis_page

    return ResultFiles.of(
        "gap",
        survey.inputs,
        content | {"clouds": cloud_rows(survey)},
        tables={"simulator.toml": lambda path: write_simulator(simulator, path)},
        pages={"gap.html": lambda path, gap: diagnosis_page(gap, survey.name).write(path)},
    )


@dataclass(frozen=True, repr=False)
class DiagnosedRounds(KnownResult):
    """Diagnoses of one survey, each with the earlier causes in the simulator.

    Parameters
    ----------
    rounds : tuple of DiagnosedSurvey
        At least one.
    lone : tuple of LoneEffect
        Each single effect, in the first round.
    """

    _name = "gap"
    rounds: tuple[DiagnosedSurvey, ...]
    lone: tuple[LoneEffect, ...]

    @property
    def ended(self) -> str:
        """Reason for the end, in a sentence."""
        label = self.rounds[-1].inference.verdict.label
        number = len(self.rounds)
        named = [lowered(title(each.inference.verdict.label)) for each in self.rounds[:-1]]
        if label == "none":
            if named:
                whole = f"with {', '.join(named)} in the simulator "
            else:
                whole = ""
            excess = self.rounds[-1].document["verdict"]["excess"]
            if excess:
                left = lowered(no_cause((), excess))
            else:
                left = "nothing more was found"
            return f"Round {number}: {whole}{left}."
        if label == "unknown":
            return f"Round {number}: no tested effect explains the remaining gap."
        words = lowered(title(label))
        if number < SETTINGS.diagnosis_rounds:
            return f"Round {number}: {words} can't be added to the simulator again."
        return f"After {number} rounds {words} is still found, although it is in the simulator."

    def _content(self):
        rounds = [_round_document(*numbered) for numbered in enumerate(self.rounds, start=1)]
        lone = [vars(effect) | {"unit": "mm"} for effect in self.lone]
        ablation = {"rounds": rounds, "alone": lone, "ended": self.ended}
        return self._first.document | {"ablation": ablation}

    @cached_property
    def _first(self):
        """First round, without the advice to run again, which was done."""
        return replace(self.rounds[0], next_run=None)

    def _files(self):
        """Files gap.json and gap.html of the first round, and the last simulator.toml."""
        return gap_files(self.document, self._first.survey, self.rounds[-1].improved)


def _round_document(number, diagnosed):
    """Result of a round, and the gap with it; none if no simulator can apply it."""
    cause = diagnosed.inference.cause
    closure = diagnosed.closure
    content = cause_document(diagnosed.rows, cause)
    label = content.pop("effect")
    kept = ("before", "after", "unit", "shrink", "kind")
    gap = {name: getattr(closure, name) for name in kept}
    if closure.is_within_noise:
        gap["shrink"] = None
    if closure.effect != label:  # that of the nearest known effect, which was not added
        gap |= {"after": None, "shrink": None}
    windows = windows_document(cause, diagnosed.survey)
    return {"round": number, "label": label} | content | gap | {"windows": windows}


def diagnose_until_none(
    survey: Survey, simulator: Simulator | None, progress: Callable | None, costs: Costs | None
) -> DiagnosedRounds:
    """Diagnose, add the named cause to the simulator, and repeat until no gap remains.

    Parameters
    ----------
    survey, simulator, progress, costs
        See ``diagnose``.

    Raises
    ------
    ValueError
        See ``diagnose``.
    """
    rounds = [diagnose(survey, simulator, progress=progress, costs=costs)]
    while len(rounds) < SETTINGS.diagnosis_rounds:
        last = rounds[-1]
        improved = rounds[-1].improved
        if improved is last.simulator:  # nothing remains, or nothing that a simulator can apply
            break
        rounds.append(diagnose(survey, improved, progress=progress, costs=costs))
    first = rounds[0]
    rng = np.random.default_rng(SETTINGS.seed)
    lone = lone_effects(first.rows, first.signatures, first.inference, rng)
    rounds[1:] = [replace(each, signatures=()) for each in rounds[1:]]
    return DiagnosedRounds(tuple(rounds), lone)

"""``diagnose --until-none``: effect after effect into the simulator, until nothing is left."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.effects import lowered, title
from mlscorr.gap import cause_document, no_cause, windows_document
from mlscorr.gap.closure import LoneEffect, lone_effects
from mlscorr.gap.evidence import Costs
from mlscorr.pipeline._result import KnownResult
from mlscorr.pipeline.diagnosis import DiagnosedSurvey, diagnose, gap_files
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.simulate import Simulator
from mlscorr.survey import Survey


@dataclass(frozen=True, repr=False)
class DiagnosedRounds(KnownResult):
    """Diagnoses of one survey, each with what those before it found in the simulator.

    Parameters
    ----------
    rounds : tuple of DiagnosedSurvey
        At least one.
    lone : tuple of LoneEffect
        Each effect by itself, in the first round.
    """

    _name = "gap"
    rounds: tuple[DiagnosedSurvey, ...]
    lone: tuple[LoneEffect, ...]

    @property
    def ended(self) -> str:
        """Why it ended, in a sentence."""
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
                left = "nothing is left to find"
            return f"Round {number}: {whole}{left}."
        if label == "unknown":
            return f"Round {number}: no effect that was judged explains what is left."
        words = lowered(title(label))
        if number < SETTINGS.diagnosis_rounds:
            return f"Round {number}: {words} can't be put into the simulator once more."
        return f"After {number} rounds {words} is still found: the simulator has what was named."

    def _content(self):
        rounds = [_round_document(*numbered) for numbered in enumerate(self.rounds, start=1)]
        lone = [vars(effect) | {"unit": "mm"} for effect in self.lone]
        ablation = {"rounds": rounds, "alone": lone, "ended": self.ended}
        return self._first.document | {"ablation": ablation}

    @cached_property
    def _first(self):
        """The first round, which needs no advice to run once more: that was done."""
        return replace(self.rounds[0], next_run=None)

    def _files(self):
        """gap.json and gap.html of the first round, and the last simulator.toml."""
        return gap_files(self.document, self._first.survey, self.rounds[-1].improved)


def _round_document(number, diagnosed):
    """What a round found, and the gap with it; none after what no simulator can take."""
    cause = diagnosed.inference.cause
    closure = diagnosed.closure
    content = cause_document(diagnosed.rows, cause)
    label = content.pop("effect")
    kept = ("before", "after", "unit", "shrink", "kind")
    gap = {name: getattr(closure, name) for name in kept}
    if closure.is_within_noise:
        gap["shrink"] = None
    if closure.effect != label:  # that of the nearest known effect, which was not put in
        gap |= {"after": None, "shrink": None}
    windows = windows_document(cause, diagnosed.survey)
    return {"round": number, "label": label} | content | gap | {"windows": windows}


def diagnose_until_none(
    survey: Survey, simulator: Simulator | None, progress: Callable | None, costs: Costs | None
) -> DiagnosedRounds:
    """Diagnose, put what was named into the simulator, and again, until nothing is left.

    Parameters
    ----------
    survey, simulator, progress, costs
        As of ``diagnose``.

    Raises
    ------
    ValueError
        As ``diagnose`` does.
    """
    rounds = [diagnose(survey, simulator, progress=progress, costs=costs)]
    while len(rounds) < SETTINGS.diagnosis_rounds:
        last = rounds[-1]
        improved = rounds[-1].improved
        if improved is last.simulator:  # nothing is left, or nothing that a simulator can take
            break
        rounds.append(diagnose(survey, improved, progress=progress, costs=costs))
    first = rounds[0]
    rng = np.random.default_rng(SETTINGS.seed)
    lone = lone_effects(first.rows, first.signatures, first.inference, rng)
    rounds[1:] = [replace(each, signatures=()) for each in rounds[1:]]
    return DiagnosedRounds(tuple(rounds), lone)

"""``diagnose``: where a survey and its simulation differ, why, and how far that can be mended."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mlscorr.effects import EFFECTS
from mlscorr.gap.advice import advise
from mlscorr.gap.believed import as_believed, compared, with_cause
from mlscorr.gap.causes import Inference, cause_of, infer
from mlscorr.gap.changes import expected
from mlscorr.gap.closure import Closure, close
from mlscorr.gap.document import gap_document
from mlscorr.gap.folds import best_known
from mlscorr.gap.pairing import build_rows
from mlscorr.gap.plan import NextData, next_data
from mlscorr.gap.rerun import Beams, collect_beams, rerun
from mlscorr.gap.rows import Rows, background
from mlscorr.gap.signatures import select, signatures
from mlscorr.io.output import check_output, document, output_folder, write_json
from mlscorr.io.survey_file import input_files
from mlscorr.pipeline.finding import SEED, found_or_nothing, silent
from mlscorr.pipeline.planning import too_little
from mlscorr.simulate.beliefs import Simulator, beliefs_of, write_simulator
from mlscorr.survey import Survey

STEPS = 6  # of the progress beside reading: the inference, folds, plan
FEWEST = 6  # things seen with a residual in m: fewer than the pose has parameters say nothing


def diagnose(survey, simulator=None, library=EFFECTS, rng=None, progress=None):
    """Find where a survey differs from its simulation, why, and how far the gap can be closed.

    Parameters
    ----------
    survey : Survey
        With surveyed targets, a reference surface, or planes that two passes share.
    simulator : Simulator, optional
        What is believed already, as read_simulator reads it; what survey.toml says by default.
    library : iterable of Effect classes
        Effects to consider.
    rng : numpy.random.Generator, optional
        For replicas and the simulator's noise; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number just done.

    Returns a DiagnosedSurvey. Raises ValueError when there is too little to say anything, or when
    a reference surface or the simulator can't be used.

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
    rng = np.random.default_rng(SEED) if rng is None else rng
    progress = progress or silent
    simulator = beliefs_of(survey) if simulator is None else simulator
    believed, effects = as_believed(survey, simulator)
    pairing, rows, beams = _observed(survey, believed, library, progress)
    again = _Again(rows, believed, beams, effects, rng.integers(2**63))
    step = progress("Weighing the causes", STEPS)
    observed = compared(rows, believed, effects)
    used = np.arange(len(rows)) < len(pairing.rows)
    signs, left_out = signatures(observed, believed, library, rng)
    part, mine = observed.select(used), select(signs, used)
    inference = infer(part, background(part, believed), believed, mine, rng)
    step(2)
    cause = _tested(part, mine, inference)
    unknown = inference.verdict.label == "unknown"
    closure = close(
        observed, used, believed, signs, inference.found, cause, again.added, rng, unknown, step
    )
    open_ = [n for n in (*inference.verdict.set, *inference.same) if n != "unknown"]
    plan = next_data(part, believed, library, tuple(dict.fromkeys(open_)), inference.separability)
    step(2)
    return DiagnosedSurvey(
        survey, simulator, effects, part, inference, closure, plan, left_out, pairing.notes
    )


def _observed(survey, believed, library, progress):
    """The Pairing, all its rows, check points last, and the Beams on which they stand."""
    finding, notes = found_or_nothing(believed, progress)
    points = sum(file.points for file in survey.clouds)
    done = progress("Looking for surfaces", points)
    pairing = build_rows(believed, finding.matches.matched, finding.candidates, progress=done)
    looks = len(np.unique(pairing.rows.item[pairing.rows.metric]))
    if looks < FEWEST:
        raise ValueError(too_little(survey, pairing.rows, looks, library, notes))
    pairing = replace(pairing, notes=(*notes, *pairing.notes))
    rows = Rows.concatenate([pairing.rows, pairing.check])
    done = progress("Simulating the survey's own beams", points)
    return pairing, rows, collect_beams(believed, rows, finding, done)


@dataclass(frozen=True)
class _Again:
    """The simulator, run again on a survey's own beams with the same noise each time."""

    rows: Rows
    survey: Survey
    beams: Beams
    effects: tuple
    seed: int

    def added(self, more):
        """What further effects add to each row (m,); to the first order where no run tells it."""
        added = self._run((*self.effects, *more)) - self._plain
        linear = expected(self.rows, self.survey, more).shift
        return np.where(np.isfinite(added) & self.rows.metric, added, linear)

    @cached_property
    def _plain(self):
        return self._run(self.effects)

    def _run(self, effects):
        rng = np.random.default_rng(self.seed)
        return rerun(self.rows, self.survey, self.beams, effects, rng)


def _tested(rows, signs, inference):
    """The cause that is put into the simulator: the verdict's; the best known one for unknown."""
    if inference.verdict.label != "unknown":
        return inference.cause
    best = best_known(inference.probability)
    return cause_of(rows, signs, inference.found, best, inference.probability.get(best, 0.0))


@dataclass(frozen=True)
class DiagnosedSurvey:
    """A survey with its diagnosis: the document of gap.json, and ``write``."""

    survey: Survey
    simulator: Simulator
    effects: tuple
    rows: Rows
    inference: Inference
    closure: Closure
    next_data: tuple[NextData, ...]
    left_out: dict[str, str]
    warnings: tuple[str, ...]

    @property
    def document(self):
        """The document of gap.json."""
        verdict = self.inference.verdict
        unknown = self.closure if verdict.label == "unknown" else None
        return document(
            "gap",
            gap_document(
                survey=self.survey,
                rows=self.rows,
                inference=self.inference,
                closure=self.closure,
                next_data=self.next_data,
                advice=advise(verdict, self.inference.same, self.next_data, unknown),
                effects=self.effects,
                left_out=self.left_out,
                warnings=self.warnings,
            ),
        )

    @property
    def improved(self):
        """The Simulator with the cause in it; the same where there is none that it could take."""
        if self.inference.verdict.label in ("none", "unknown"):
            return self.simulator
        return with_cause(self.simulator, self.survey, self.inference.cause)

    def write(self, out, overwrite=False):
        """Write gap.json, gap.html and simulator.toml into a folder, whole or not at all.

        Returns the document of gap.json. Raises as ``CorrectedSurvey.write`` does.
        """
        from mlscorr.report.gap_page import gap_page

        check_output(out, input_files(self.survey.path), overwrite)
        content = self.document
        page = gap_page(content, self.survey.name)
        with output_folder(out) as folder:
            write_json(folder / "gap.json", content)
            (folder / "gap.html").write_text(page, encoding="utf-8")
            write_simulator(self.improved, folder / "simulator.toml")
        return content

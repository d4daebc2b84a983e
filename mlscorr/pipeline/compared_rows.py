"""Observations of a survey compared with assumptions or with simulated clouds, as rows."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.correction import Correction
from mlscorr.effects import Effect
from mlscorr.estimate import estimate_correction
from mlscorr.gap import contrast, residuals
from mlscorr.gap.closure import Beams, BeamSimulator, Surroundings, collect_beams
from mlscorr.gap.signatures import expected, without_effects
from mlscorr.io.surveys import simulated_survey
from mlscorr.pipeline.finding import MatchedTargets, find_or_compare_surfaces, read_into
from mlscorr.pipeline.planning import check_enough
from mlscorr.survey import Matched, Statement, Survey, TargetObservations

NEXT_RUN = Statement("next run")
NEXT_CLOUDS = Statement("next clouds")
SECOND_CLOUDS = Statement("second clouds")
LINEAR = "The decrease of the gap is a first-order estimate: your simulator ran only once."


@dataclass(frozen=True)
class ComparedRows:
    """Rows of a survey, including check points.

    Parameters
    ----------
    rows : Rows
        Minus the effects of the simulator.
    used : (m,) bool array
        False for those of check points.
    simulated : function of a tuple of Effect, or (m,) array
        Change of the rows by these effects in the simulator, or by its next run.
    absence : Absence
    notes : tuple of str
    contrasts : tuple of Contrast
        Contrasts of non-geometric channels.
    distances : tuple of DistributionDistance
        Distances between the clouds, if there are simulated ones.
    next_run : Statement
        Command to run with the cause in the simulator.
    """

    rows: residuals.Rows
    used: np.ndarray
    simulated: Callable | np.ndarray
    absence: residuals.Absence
    notes: tuple[str, ...]
    contrasts: tuple[contrast.Contrast, ...] = ()
    distances: tuple[contrast.DistributionDistance, ...] = ()
    next_run: Statement = NEXT_CLOUDS


def compare_with_belief(
    survey: Survey,
    assumed: Survey,
    effects: tuple[Effect, ...],
    library: Iterable[type[Effect]],
    rng: np.random.Generator,
    progress: Callable,
) -> ComparedRows:
    """Compare with assumptions; the simulator replays the survey's own pulses.

    Parameters
    ----------
    survey : Survey
    assumed : Survey
        With the simulator's assumptions.
    effects : tuple of Effect
        Effects of the simulator.
    library : iterable of Effect classes
    rng : numpy.random.Generator
        For the simulator's noise, and replicas of the contrasts.
    progress : function
        See ``diagnose``.

    Raises
    ------
    ValueError
        If there are too few data.
    """
    pairing, rows, beams, absence, patches = _observed(survey, assumed, library, progress)
    progress("Simulating the survey's own pulses")
    rows, noisy = residuals.limited_noise(rows)
    simulator = BeamSimulator(rows, assumed, beams, effects, int(rng.integers(2**63)))
    used = np.arange(len(rows)) < len(pairing.rows)
    observed = without_effects(rows, assumed, effects)
    # so that contrasts do not change the random draws of the verdict
    contrasts = contrast.contrast_returns(assumed, patches, _loss(effects), rng.spawn(1)[0])
    notes = (*pairing.notes, *noisy)
    return ComparedRows(observed, used, simulator.added, absence, notes, contrasts, (), NEXT_RUN)


def _loss(effects):
    """Share of returns lost by a simulator with these effects; None without dropout."""
    lost = [effect.magnitude for effect in effects if effect.name == "dropout"]
    if lost:
        return 1.0 - float(np.prod(1.0 - np.array(lost)))
    return None


def compare_with_clouds(
    survey: Survey,
    assumed: Survey,
    folders: Sequence[Path],
    library: Iterable[type[Effect]],
    rng: np.random.Generator,
    progress: Callable,
) -> ComparedRows:
    """Compare with the simulated clouds of the first folder.

    Differences of a second folder are changes of the simulator's next run.

    Parameters
    ----------
    survey, believed, library, rng, progress
        See compare_with_belief.
    folders : sequence of one or two Path
        Survey folders, folders of LAS or LAZ files, or such files.

    Raises
    ------
    ValueError
        If clouds cannot be read or paired, or there are too few data.
    """
    opened = [simulated_survey(folder, assumed) for folder in folders]
    sampler = contrast.SampleCollector(assumed)
    finding, patches, _, notes = _read(assumed, progress, sampler)
    samples = [sampler.sample(patches)]
    absence = residuals.find_absence(assumed, finding.matches)
    correction = _by_control(assumed, finding.matches.matched)
    matched = _with_moved(finding, assumed).matches.matched
    if patches is None:
        patches = None
    else:
        patches = residuals.spread_patches(patches)
    compared = []
    for folder, simulated in zip(folders, opened, strict=True):
        clouds, sample = _simulated_clouds(simulated, patches, correction, progress)
        samples.append(sample)
        observed = matched, finding.candidates, patches
        rows, sentence = residuals.rows_against(assumed, *observed, clouds, correction)
        _check_simulated(rows, folder)
        compared.append(rows)
        notes = (*notes, sentence)
    first, *following = residuals.without_unpaired(compared)
    check_enough(survey, first, library, notes)
    is_check = np.isin(first.targets.name, survey.check.name)
    used = (first.survey_item < 0) | ~is_check[first.survey_item]
    real, simulated_first = samples[:2]
    child_rng = rng.spawn(1)[0]
    channels = (
        contrast.contrast_clouds(assumed, real, simulated_first, child_rng),
        contrast.cloud_distances(
            real, simulated_first, samples[2] if following else None, child_rng
        ),
    )
    quiet, noisy = residuals.limited_noise(first)
    notes = (*notes, *noisy)
    if following:
        change = first.residual - following[0].residual
        return ComparedRows(quiet, used, change, absence, notes, *channels, SECOND_CLOUDS)

    def to_first_order(effects):
        return expected(first, assumed, effects).shift

    return ComparedRows(quiet, used, to_first_order, absence, (*notes, LINEAR), *channels)


def _check_simulated(rows, folder):
    """Refuse clouds that are not simulated."""
    if not np.nan_to_num(rows.residual).any():
        raise ValueError(
            f"The clouds of {folder} are those of the survey: all {len(rows)} differences are "
            "zero. Give the clouds from your simulator."
        )


def _simulated_clouds(simulated, patches, correction, progress):
    """SimulatedClouds and ChannelSample of a simulated survey, read once."""
    collector = residuals.PatchCollector(simulated)
    sampler = contrast.SampleCollector(simulated)
    if patches is None:
        beams = None
    else:
        beams = residuals.SimulatedBeams(patches, correction)
    others = [sampler] if beams is None else [sampler, beams]
    read = read_into(collector.add, *map(_chunks_alone, others))
    with warnings.catch_warnings(action="ignore"):  # of beams, which refuse the clouds
        finding, _ = find_or_compare_surfaces(simulated, read, None, progress)
    if finding.warnings:
        raise ValueError(
            f"{simulated.path} was simulated with other beams than those of the survey. "
            f"{finding.warnings[0]}"
        )
    flat = collector.patches()
    matched = finding.matches.matched
    given = matched, flat, beams, _by_control(simulated, matched)
    return residuals.SimulatedClouds(simulated.name, *given), sampler.sample(flat)


def _chunks_alone(collector):
    return lambda _, chunk: collector.add(chunk)


def _with_moved(finding: MatchedTargets, survey: Survey) -> MatchedTargets:
    """Add observations of displaced control points to the targets.

    Their misclosures identify target_outlier. Matches of check points do not change.
    """
    moved = finding.matches.moved
    if moved is None:
        return finding
    moved = moved[np.isin(np.array(moved.name, dtype=str), survey.control.name)]
    matched = TargetObservations.concatenate([finding.matches.matched, moved])
    return replace(finding, matches=replace(finding.matches, matched=matched))


def _read(
    assumed, progress, sampler=None
) -> tuple[MatchedTargets, residuals.Patches | None, Surroundings, tuple[str, ...]]:
    """Read MatchedTargets, Patches, Surroundings and notes.

    The clouds are read once: targets, patches, surroundings of targets and, with a SampleCollector,
    its sample are collected from each chunk.
    """
    collector = residuals.PatchCollector(assumed)
    surroundings = Surroundings(assumed)
    if sampler is None:
        others = [surroundings]
    else:
        others = [surroundings, sampler]
    read = read_into(collector.add, *map(_chunks_alone, others))
    finding, notes = find_or_compare_surfaces(assumed, read, surroundings.settle, progress)
    return finding, collector.patches(), surroundings, notes


def _observed(
    survey, assumed, library, progress
) -> tuple[residuals.Pairing, residuals.Rows, Beams, residuals.Absence, residuals.Patches | None]:
    """Pairing, all its rows with check points last, their Beams, the Absence, and the Patches."""
    finding, patches, surroundings, notes = _read(assumed, progress)
    progress("Pairing targets and surfaces")
    absence = residuals.find_absence(assumed, finding.matches)
    correction = _by_control(assumed, finding.matches.matched)
    finding = _with_moved(finding, assumed)
    observed = finding.matches.matched, finding.candidates, patches
    pairing = residuals.build_rows(assumed, *observed, correction=correction)
    check_enough(survey, pairing.rows, library, notes)
    pairing = replace(pairing, notes=(*notes, *pairing.notes))
    rows = residuals.Rows.concatenate([pairing.rows, pairing.check])
    beams = collect_beams(assumed, rows, finding, patches, surroundings)
    return pairing, rows, beams, absence, patches


def _by_control(survey: Survey, matched: TargetObservations) -> Correction | None:
    """Correction from control points only; None without matches."""
    control = matched[np.isin(np.array(matched.name, dtype=str), survey.control.name)]
    if len(control) == 0:
        return None
    pairs = Matched.by_name(control, survey.control)
    return estimate_correction(survey.trajectory, pairs, survey.pos).correction

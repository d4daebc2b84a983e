"""From cloud files to matched targets: read, fit, match."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np

from mlscorr.io.clouds import read_chunks
from mlscorr.matching import Matches, match
from mlscorr.pipeline.near_points import NearPoints, check_control, no_control, nothing_found
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import Matched, PointCloud, Statement, Survey, check_rng
from mlscorr.targets import (
    NO_POINTS,
    Candidates,
    FittedTarget,
    PassTarget,
    as_observations,
    collect,
    distinct,
    fit_near_control,
)


@dataclass(frozen=True)
class Finding:
    """Targets of a survey.

    Parameters
    ----------
    matches : Matches
    candidates : Candidates
        The points on all targets, with their passes, and those without a pose.
    fitted : dict
        Each FittedTarget by (pass number, gps_time), for its figure.
    scanned : frozenset of str
        Names of the surveyed points that have points of the cloud about them.
    warnings : tuple of str
        On cloud files whose beams can't have been measured so.
    uncovered : tuple of str
        On cloud files with points outside the trajectory.
    """

    matches: Matches
    candidates: Candidates
    fitted: dict[tuple[int, float], FittedTarget]
    scanned: frozenset[str] = frozenset()
    warnings: tuple[str, ...] = ()
    uncovered: tuple[str, ...] = ()

    def scanners(self, survey: Survey) -> dict[int, int]:
        """Number of the scanner of each pass.

        Parameters
        ----------
        survey : Survey
        """
        numbers = survey.scanner_numbers
        return {number: int(numbers[key[0]]) for key, number in self.candidates.passes.items()}


def find_targets(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    read: Callable = read_chunks,
) -> Finding:
    """Find the surveyed targets in the cloud and match them.

    Parameters
    ----------
    survey : Survey
    rng : numpy.random.Generator, optional
        For the random samples of flat patches; the same seed each time by default.
    progress : function, optional
        ``progress(title, total)`` returns a function of the number of points just done.
    read : function of a CloudFile
        Gives an iterator of PointCloud.

    Raises
    ------
    ValueError
        When no target is found, or none of those found matches.
    """
    return _checked(survey, *fit_while_reading(survey, read, rng, _bar(survey, progress)))


def _bar(survey, progress):
    return (progress or silent)("Reading the cloud", survey.points)


def _checked(survey, targets, candidates, near):
    """The Finding of what fit_while_reading gives; raises as find_targets does."""
    uncovered = tuple(near.beams.outside())
    sentences = tuple(near.warnings())
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=4)
    finding = matched_finding(survey, targets, candidates, near)
    names = frozenset(survey.surveyed.name[i] for i in np.flatnonzero(near.is_scanned))
    return replace(finding, scanned=names, warnings=sentences, uncovered=uncovered)


def matched_finding(
    survey: Survey, targets: list[PassTarget], candidates: Candidates, near: NearPoints
) -> Finding:
    """Match what fit_while_reading gives; this decides for ``check`` and ``correct`` alike.

    Parameters
    ----------
    survey : Survey
        With all of its surveyed points, also where only some were looked at.
    targets, candidates, near
        As fit_while_reading gives them.

    Raises
    ------
    ValueError
        When no target is found, or none of those found matches.
    """
    if len(targets) == 0:
        raise ValueError(nothing_found(survey, candidates, near))
    finding = match_targets(targets, candidates, survey)
    if len(finding.matches.matched) == 0:
        reasons = " ".join(refusal.reason for refusal in finding.matches.refusals[:3])
        places = len(np.unique(survey.surveyed.position, axis=0))
        is_twice = 2 * places <= len(survey.surveyed)  # and then the CRS isn't what is wrong
        questions = "Are control and cloud in the same CRS?", "Is each point named twice?"
        raise ValueError(
            f"None of the {len(survey.surveyed)} surveyed targets is among the {len(targets)} that "
            f"were found ({near.intensity_range} there). {reasons} {questions[is_twice]}"
        )
    return finding


def fit_while_reading(
    survey: Survey,
    read: Callable,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    settle: Callable | None = None,
) -> tuple[list[PassTarget], Candidates, NearPoints]:
    """Fit targets near surveyed points while the clouds are read.

    Parameters
    ----------
    survey : Survey
    read : function of a CloudFile
        Gives an iterator of PointCloud.
    rng, progress
        As of ``find_targets``, progress already with its title.
    settle : function, optional
        ``settle(fitted, since)`` is given the FittedTargets since its last call, and the time (s)
        before which none to come will have points.

    Returns
    -------
    targets : list of (pass number, FittedTarget)
        In order of pass and time. Of fits that overlap, the best: the order of the surveyed points
        decides nothing.
    candidates : Candidates
        None, with the passes and the points without a pose.
    near : NearPoints

    Warns where the intensity tells nothing.
    """
    if rng is None:
        rng = np.random.default_rng(SETTINGS.seed)
    check_rng(rng)
    seed = rng.integers(2**63)
    fits = []
    latest = []
    near = NearPoints(survey)

    def fit(file, index, cloud):
        near.add_ball(index, cloud)
        generator = np.random.default_rng(seed)  # whatever was looked at before
        targets = fit_near_control(index, cloud, near.survey_of(survey.clouds[file]), generator)
        latest.extend(target for _, target in targets)
        fits.extend((index, (file, number), target) for number, target in targets)

    def settled(since):
        if settle is not None:
            settle(distinct(latest), since)
        latest.clear()

    progress = progress or silent("", 0)
    candidates = collect(survey, near.beams.watched(read), fit, near.add, settled, progress)
    near.warn_of_intensity(survey)
    of_pass = {number: [] for number in sorted(candidates.passes.values())}
    for _, key, target in sorted(fits, key=itemgetter(0)):  # not in the order of their points
        of_pass[candidates.passes[key]].append(target)
    targets = [(number, t) for number, some in of_pass.items() for t in distinct(some)]
    return targets, candidates, near


def match_targets(targets: list[PassTarget], candidates: Candidates, survey: Survey) -> Finding:
    """Match fitted targets with the surveyed points.

    Parameters
    ----------
    targets : list of (pass number, FittedTarget)
    candidates : Candidates
        Their passes and the points without a pose are kept.
    survey : Survey
    """
    observations = as_observations(targets)
    matches = match(
        observations, survey.surveyed, survey.trajectory, survey.pos, survey.search_radius
    )
    numbers = np.repeat([n for n, _ in targets], [len(t.cloud) for _, t in targets]).astype(int)
    cloud = PointCloud.concatenate([NO_POINTS, *(t.cloud for _, t in targets)])
    on_targets = replace(candidates, cloud=cloud, pass_number=numbers)
    return Finding(matches, on_targets, _by_pass_and_time(targets))


def unmatched(targets: list[PassTarget], candidates: Candidates, reason: str = "") -> Finding:
    """The Finding of targets where there is nothing to match.

    Parameters
    ----------
    targets : list of (pass number, FittedTarget)
    candidates : Candidates
    reason : str
        Why none has a name.
    """
    observations = as_observations(targets)
    nothing = observations[np.zeros(len(targets), bool)]
    why = (Statement("not matched", values={"why": reason}),) * len(targets)
    matches = Matches(nothing, observations, (), np.empty(0), why)
    return Finding(matches, candidates, _by_pass_and_time(targets))


def _by_pass_and_time(targets):
    """Fitted targets by (pass number, gps_time)."""
    return {(number, target.gps_time): target for number, target in targets}


def find_control(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    read: Callable = read_chunks,
) -> tuple[Matched, Matched, Finding]:
    """Find the targets and part them by role.

    Parameters
    ----------
    survey, rng, progress, read
        As of ``find_targets``.

    Returns
    -------
    control, check : Matched
    finding : Finding

    Raises
    ------
    ValueError
        As find_targets does, and when no control point was surveyed or found.
    """
    check_control(survey)
    finding = find_targets(survey, rng, progress, read)
    return *matched_by_role(survey, finding), finding


def matched_by_role(survey: Survey, finding: Finding) -> tuple[Matched, Matched]:
    """The matched control points, without which nothing is corrected, and the check points.

    Parameters
    ----------
    survey : Survey
    finding : Finding

    Raises
    ------
    ValueError
        Where no control point is matched.
    """
    control, check = finding.matches.by_role(survey)
    if len(control) == 0:
        raise ValueError(no_control(survey, len(check)))
    return control, check


def find_or_compare_surfaces(
    survey: Survey,
    read: Callable = read_chunks,
    settle: Callable | None = None,
    progress: Callable | None = None,
    rng: np.random.Generator | None = None,
) -> tuple[Finding, tuple[str, ...]]:
    """Find the targets where there are any: a diagnosis can do without.

    Parameters
    ----------
    survey, read, settle
        As of ``fit_while_reading``; the clouds are read to their ends in any case.
    progress, rng
        As of ``find_targets``.

    Returns
    -------
    finding : Finding
        Empty where nothing was surveyed or found.
    notes : tuple of str
        The sentence that says so.
    """
    fitted = fit_while_reading(survey, read, rng, _bar(survey, progress), settle)
    note = "No target was surveyed: only surfaces are compared."
    if len(survey.surveyed):
        try:
            return _checked(survey, *fitted), ()
        except ValueError as error:
            note = f"{error} Only surfaces are compared."
    return unmatched([], Candidates()), (note,)


def read_into(*adds: Callable) -> Callable:
    """A ``read_chunks`` that also adds each chunk to collectors, so that a cloud is decoded once.

    Parameters
    ----------
    *adds : function of CloudFile and PointCloud
    """

    def read(file):
        for chunk in read_chunks(file):
            for add in adds:
                add(file, chunk)
            yield chunk

    return read


def silent(_title: str, _total: int) -> Callable:
    """Progress that is shown nowhere."""
    return lambda _points: None

"""From cloud files to matched targets: read, fit, match."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from scipy.spatial import cKDTree

from mlscorr.evaluate import BeamCheck
from mlscorr.io.clouds import read_chunks
from mlscorr.matching import Matches, match
from mlscorr.pipeline.beams import with_beam_origin
from mlscorr.pipeline.control_checks import check_control
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import CloudFile, PointCloud, Statement, Survey, check_rng
from mlscorr.targets import (
    BY_EDGES,
    NO_POINTS,
    Candidates,
    FittedTarget,
    PassTarget,
    as_observations,
    collect,
    distinct,
    fit_near_control,
    search_radius,
    why_useless,
)
from mlscorr.wording import counted


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


class NearPoints:
    """Points near surveyed points that were looked at: their number and intensities.

    Attributes
    ----------
    beams : BeamCheck
    is_scanned : (b,) bool array
        Which surveyed points have points about them.
    is_present : (65536,) bool array
        Which intensities they have.
    points : int
    of_file : dict
        The survey of each CloudFile about which something was asked, with the place of its scanner.

    Parameters
    ----------
    survey : Survey
    """

    def __init__(self, survey: Survey):
        self.beams = BeamCheck(survey)
        self.points = 0
        self.survey = survey
        self.of_file = {}
        self.is_scanned = np.zeros(len(survey.surveyed), bool)
        self.is_present = np.zeros(1 << 16, bool)

    @property
    def intensity_range(self) -> str:
        """The darkest and the brightest, in words."""
        present = np.flatnonzero(self.is_present)
        return f"intensity {present[0]} to {present[-1]}"

    @property
    def scanned(self) -> frozenset[str]:
        """Names of the surveyed points that have points about them."""
        names = self.survey.surveyed.name
        return frozenset(names[i] for i in np.flatnonzero(self.is_scanned))

    def survey_of(self, file: CloudFile) -> Survey:
        """The survey of the scanner that wrote a file, with the scanner's place.

        Parameters
        ----------
        file : CloudFile
        """
        if file not in self.of_file:
            self.of_file[file] = with_beam_origin(self.survey.of(file), file)
        return self.of_file[file]

    def warnings(self) -> Iterator[str]:
        """Sentences on files whose beams can't have been measured so, or come from nowhere."""
        yield from self.beams.warnings()
        for file, survey in self.of_file.items():
            if survey.mounting is None and survey.beam_origin is None:
                yield (
                    f"{survey.path} gives no [mounting], and the beams of {file.name} don't show "
                    "where the scanner was: it is taken to be at the navigation centre. Plates "
                    "that stand free may be missed or found centimetres off; give lever_arm and "
                    "boresight under [mounting]."
                )

    def add(self, cloud: PointCloud) -> None:
        """Count more of them.

        Parameters
        ----------
        cloud : PointCloud
        """
        self.points += len(cloud)
        self.is_present[cloud.intensity.astype(np.uint16)] = True

    def add_ball(self, index: int, cloud: PointCloud) -> None:
        """Look whether any of the points of a surveyed point, from there (m), lies about it."""
        some = cloud.xyz[:: SETTINGS.scanned_stride]
        self.is_scanned[index] |= (np.linalg.norm(some, axis=1) < SETTINGS.scanned_radius).any()

    def warn_of_intensity(self) -> None:
        """Warn where bright targets are surveyed and the intensity can't tell them."""
        if self.points:
            reason = why_useless(np.flatnonzero(self.is_present))
        else:
            reason = None
        if reason is not None and not set(self.survey.surveyed.kind) <= set(BY_EDGES):
            warnings.warn(
                f"{reason} Bright targets can't be told by it: only plates that stand free are "
                "found, by their edges, and painted ones are not. Export the cloud with its "
                "intensity.",
                stacklevel=3,
            )


def find_control(
    survey: Survey,
    rng: np.random.Generator | None = None,
    progress: Callable | None = None,
    read: Callable = read_chunks,
) -> Finding:
    """Find the targets of a survey that has control points, and some of these among them.

    Parameters
    ----------
    survey, rng, progress, read
        As of ``find_targets``.

    Raises
    ------
    ValueError
        As find_targets does, and when no control point was surveyed or found.
    """
    check_control(survey)
    finding = find_targets(survey, rng, progress, read)
    check_found_control(survey, finding)
    return finding


def check_found_control(survey: Survey, finding: Finding) -> None:
    """Refuse a finding without a control point, by which nothing is corrected.

    Parameters
    ----------
    survey : Survey
    finding : Finding

    Raises
    ------
    ValueError
        Where check points alone are matched.
    """
    control, check = finding.matches.by_role(survey)
    if len(control) == 0:
        raise ValueError(
            f"None of the {counted(len(survey.control), 'control point')} was found in the cloud, "
            f"only {counted(len(check), 'check point')}, which must not take part in the estimate."
        )


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
    reading = (progress or silent)("Reading the cloud", survey.points)
    targets, candidates, near = fit_while_reading(survey, read, rng, reading)
    return _checked(survey, targets, candidates, near)


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
    reading = (progress or silent)("Reading the cloud", survey.points)
    targets, candidates, near = fit_while_reading(survey, read, rng, reading, settle)
    note = "No target was surveyed: only surfaces are compared."
    if len(survey.surveyed):
        try:
            return _checked(survey, targets, candidates, near), ()
        except ValueError as error:
            note = f"{error} Only surfaces are compared."
    return unmatched([], Candidates()), (note,)


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
    near.warn_of_intensity()
    of_pass = {number: [] for number in sorted(candidates.passes.values())}
    for _, key, target in sorted(fits, key=itemgetter(0)):  # not in the order of their points
        of_pass[candidates.passes[key]].append(target)
    targets = [(number, t) for number, some in of_pass.items() for t in distinct(some)]
    return targets, candidates, near


def _checked(
    survey: Survey, targets: list[PassTarget], candidates: Candidates, near: NearPoints
) -> Finding:
    """The Finding of what fit_while_reading gives; raises as find_targets does."""
    uncovered = tuple(near.beams.outside())
    sentences = tuple(near.warnings())
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=4)
    finding = matched_finding(survey, targets, candidates, near)
    return replace(finding, scanned=near.scanned, warnings=sentences, uncovered=uncovered)


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


def nothing_found(survey: Survey, candidates: Candidates, near: NearPoints) -> str:
    """The sentence for a cloud in which no surveyed target was found.

    Parameters
    ----------
    survey : Survey
    candidates : Candidates
    near : NearPoints
    """
    surveyed = survey.surveyed
    radius = search_radius(survey, surveyed).max()
    if len(candidates.unplaced) > near.points:
        return (
            f"No target was found: {len(candidates.unplaced)} of the points near surveyed points "
            "were measured in gaps of the trajectory or outside it. Export the whole trajectory."
        )
    if near.points == 0:
        return (
            f"No point of the cloud lies within {radius:.1f} m of any of the {len(surveyed)} "
            "surveyed points. Are control and cloud in the same CRS and of the same street?"
            f"{_other_heights(survey, radius)}"
        )
    return (
        f"None of the {len(surveyed)} surveyed targets was found among {near.points} points "
        f"within {radius:.1f} m of them ({near.intensity_range}). Targets are circles or squares "
        "of the surveyed size, brighter than what surrounds them: check kind and size in the "
        "control file, and the intensity."
    )


def _other_heights(survey, radius):
    """A sentence where surveyed points lie farther above or below the drive than is searched."""
    place = survey.surveyed.position
    path = survey.trajectory.position
    nearest = cKDTree(path[:, :2]).query(place[:, :2])[1]
    above = float(np.median(place[:, 2] - path[nearest, 2]))
    if abs(above) < radius:
        return ""
    side = "above" if above > 0 else "below"
    return (
        f" In the median the surveyed points lie {abs(above):.1f} m {side} the trajectory: their "
        "heights may be of another geoid or over an ellipsoid, or in feet."
    )


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

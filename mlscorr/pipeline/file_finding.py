"""Targets and ties in one cloud file, and merging of several files."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlscorr.io.clouds import read_chunks
from mlscorr.pipeline.finding import (
    MatchedTargets,
    fit_while_reading,
    match_fitted,
    read_into,
    unmatched,
)
from mlscorr.surfaces import FeatureCollector
from mlscorr.survey import PointCloud, Survey, TieFeatures
from mlscorr.targets import NO_POINTS, Candidates, PassTarget, number_passes


@dataclass(frozen=True)
class FileFinding:
    """Findings in a cloud file.

    Parameters
    ----------
    starts : dict
        Start of its points in each segment of the trajectory. Units: s.
    targets : list of (segment, FittedTarget)
    unplaced : PointCloud
        Points near surveyed points without a pose.
    scanned : frozenset of str
        Names of the surveyed points with surrounding points of it.
    warnings, uncovered : tuple of str
        On impossible beams, and on points outside the trajectory.
    features : TieFeatures
        Planes and poles; the pass number is that of the segment.
    seconds : (k,) int array
        Whole seconds of gps_time with points of it.
    """

    starts: dict[int, float]
    targets: list[PassTarget]
    unplaced: PointCloud
    scanned: frozenset[str]
    warnings: tuple[str, ...]
    uncovered: tuple[str, ...]
    features: TieFeatures
    seconds: np.ndarray


def find_in_file(survey: Survey, origin: np.ndarray, with_ties: bool = True) -> FileFinding:
    """Find targets and ties in the single cloud file of a survey.

    Parameters
    ----------
    survey : Survey
        With at least the surveyed points near the file.
    origin : (3,) array
        Origin of the cells of planes and poles, the same for all files. Units: m.
    with_ties : bool
        True to search for planes and poles.
    """
    collector = FeatureCollector(survey, origin=origin)
    if with_ties:
        read = read_into(collector.add)
    else:
        read = read_chunks
    near_control = fit_while_reading(survey, read)
    candidates = near_control.candidates
    near = near_control.near
    segments = {number: segment for (_, segment), number in candidates.passes.items()}
    features = collector.features()
    numbers = [segments[number] for number in features.pass_number.tolist()]
    return FileFinding(
        starts={segment: start for (_, segment), start in candidates.starts.items()},
        targets=[(segments[number], target) for number, target in near_control.targets],
        unplaced=candidates.unplaced,
        scanned=near.scanned,
        warnings=tuple(near.warnings()),
        uncovered=tuple(near.beams.outside()),
        features=replace(features, pass_number=np.array(numbers, int)),
        seconds=candidates.seconds,
    )


def join_findings(
    survey: Survey, files: Sequence[FileFinding]
) -> tuple[MatchedTargets, TieFeatures]:
    """Merge the findings of a survey's files, and all planes and poles with its passes.

    Parameters
    ----------
    survey : Survey
    files : sequence of FileFinding
        Findings of its clouds, in order.
    """
    starts = {
        (number, segment): start
        for number, file in enumerate(files)
        for segment, start in file.starts.items()
    }
    passes = number_passes(starts)
    targets = [
        (passes[number, segment], target)
        for number, file in enumerate(files)
        for segment, target in file.targets
    ]
    targets.sort(key=lambda pair: (pair[0], pair[1].gps_time))
    unplaced = PointCloud.concatenate([NO_POINTS, *(file.unplaced for file in files)])
    seconds = np.concatenate([file.seconds for file in files])
    candidates = Candidates(unplaced=unplaced, passes=passes, starts=starts, seconds=seconds)
    if len(survey.surveyed):
        finding = match_fitted(survey, targets, candidates)
    else:
        finding = unmatched(survey, targets, candidates)
    parts = []
    for number, file in enumerate(files):
        own = [passes[number, segment] for segment in file.features.pass_number.tolist()]
        scanner = np.full(len(own), survey.scanner_numbers[number])
        parts.append(replace(file.features, pass_number=np.array(own, int), scanner=scanner))
    finding = replace(
        finding,
        scanned=frozenset().union(*(file.scanned for file in files)),
        warnings=tuple(sentence for file in files for sentence in file.warnings),
        uncovered=tuple(sentence for file in files for sentence in file.uncovered),
    )
    return finding, TieFeatures.concatenate(parts)

"""Inputs and outputs of a correction, and its time and memory."""

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

from mlscorr.evaluate import BeamCheck
from mlscorr.io import SETTINGS as IO
from mlscorr.io.clouds import read_chunks, recorded_points
from mlscorr.pipeline.quick_look import QuickLook
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.survey import CloudFile, PointCloud, Survey
from mlscorr.wording import counted


@dataclass(frozen=True)
class Amount:
    """Amount of something, and its source.

    Parameters
    ----------
    what : str
    number : float
    unit : str
        Unit of the number, empty for a count.
    source : str
        Source of the number.
    """

    what: str
    number: float
    unit: str
    source: str


@dataclass(frozen=True)
class DecodedSample:
    """Run of points from the middle of each cloud file.

    Parameters
    ----------
    points : int
    seconds : float
        Decoding time. Units: s.
    warnings : tuple of str
        On files with impossible beams.
    """

    points: int
    seconds: float
    warnings: tuple[str, ...]


def sample_clouds(survey: Survey) -> DecodedSample:
    """Decode a run of each file, as many points in total as are read at a time.

    Parameters
    ----------
    survey : Survey
    """
    run = max(IO.sampled_points, IO.chunk_points // len(survey.clouds))
    points = 0
    start = perf_counter()
    chunks = {file: list(_middle(file, run)) for file in survey.clouds}
    seconds = perf_counter() - start
    beams = BeamCheck(survey)
    read = beams.watched(lambda file: iter(chunks[file]))
    points = sum(len(chunk) for file in survey.clouds for chunk in read(file))
    return DecodedSample(points, seconds, tuple(beams.warnings()))


def _middle(file: CloudFile, run: int) -> Iterator[PointCloud]:
    first = max(0, file.points - run) // 2
    return read_chunks(file, first=first, end=min(file.points, first + run))


def amounts_read(survey: Survey, sampled: int) -> tuple[Amount, ...]:
    """Numbers of points, epochs and surveyed points of a survey.

    Parameters
    ----------
    survey : Survey
    sampled : int
        Number of passes that contain samples of the clouds.

    Returns
    -------
    tuple of Amount
    """
    trajectory = survey.trajectory
    driven = f"{len(trajectory)} epochs, {trajectory.length / 1e3:.2f} km, without gaps"
    points = sum(map(recorded_points, survey.clouds))
    return (
        Amount("points", points, "", f"headers of {_files(survey)}"),
        Amount("scanners", len(survey.by_scanner), "", "survey.toml"),
        Amount("passes", sampled, "", f"{IO.sampled_points} times of each file"),
        Amount("trajectory", trajectory.duration, "s", driven),
        Amount("control points", len(survey.control), "", "role control"),
        Amount("check points", len(survey.check), "", "role check; not used in the estimate"),
    )


def amounts_written(survey: Survey) -> tuple[Amount, ...]:
    """Files that a correction writes, and their sizes.

    Parameters
    ----------
    survey : Survey

    Returns
    -------
    tuple of Amount
        Units: MB.
    """
    clouds = sum(path.stat().st_size for path in survey.cloud_paths) / 1e6
    epochs = len(survey.trajectory)
    table = epochs * SETTINGS.epoch_bytes / 1e6
    return (
        Amount("clouds", clouds, "MB", f"sizes of {_files(survey)}"),
        Amount("trajectory.csv", table, "MB", f"{epochs} epochs of {SETTINGS.epoch_bytes} bytes"),
        Amount(
            "report.html, report.json, targets.csv, pictures",
            SETTINGS.report_megabytes,
            "MB",
            "surveys of 24 points; docs/results.md",
        ),
    )


def amounts_needed(
    survey: Survey, sample: DecodedSample, probe: QuickLook | None
) -> tuple[Amount, ...]:
    """Time and memory of a correction, from measured rates.

    Parameters
    ----------
    survey : Survey
    sample : DecodedSample
    probe : QuickLook or None

    Returns
    -------
    tuple of Amount
    """
    decoding = sum(map(recorded_points, survey.clouds)) * sample.seconds / max(sample.points, 1)
    if probe is None:
        fitting = 0.0
    else:
        fitting = probe.seconds * len(survey.surveyed)
    rate = sample.points / max(sample.seconds, 1e-9) / 1e6
    points = SETTINGS.decodings * decoding
    seconds = points + fitting + SETTINGS.report_seconds
    return (
        Amount("time", seconds, "s", "sum of the next three, on this machine in its present state"),
        Amount(
            "reading and writing points",
            points,
            "s",
            f"{SETTINGS.decodings:g} times decoding (docs/results.md) at {rate:.1f} million "
            f"points/s, measured here on {sample.points}",
        ),
        Amount(
            "fitting targets",
            fitting,
            "s",
            "no target was fitted"
            if probe is None
            else f"{probe.seconds:.2f} s per surveyed point, measured here on {len(probe.points)}",
        ),
        Amount(
            "report and pictures",
            SETTINGS.report_seconds,
            "s",
            "docs/results.md; none with --no-report",
        ),
        Amount(
            "memory",
            SETTINGS.base_memory,
            "GB",
            "largest of 0.5 to 22 million points; docs/results.md",
        ),
    )


def _files(survey):
    """Phrase on the number of clouds."""
    return counted(len(survey.cloud_paths), "cloud file")

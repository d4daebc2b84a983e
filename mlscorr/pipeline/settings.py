"""Settings of the commands."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    seed: int = 0  # of random samples: the same survey gives the same result
    diagnosis_rounds: int = 5  # until none: a survey with more causes needs manual analysis
    orders: tuple[int, ...] = (2, 3, 4, 5)  # compared orders of polynomials: the paper's Table 1
    sufficient_check_points: int = 5  # points; with fewer, all points are also cross-validated
    single_points: int = 10  # points; up to this number leave-one-out, otherwise in groups
    groups: int = 5  # groups; of control points spread in time, for cross-validation
    scanned_radius: float = 2.0  # m around a target; more than a board, less than a street
    scanned_stride: int = 10  # points; balls of meters around targets contain hundreds
    tile_overlap: float = 0.1  # share of the shorter file's time; more: two scanners, not tiles
    looked_points: int = 8  # surveyed points searched before a run: seconds, and sufficient
    # s for a search of fewer points, where targets are dense
    looked_seconds: float = 8.0
    looked_length: float = 15.0  # m of the path on either side: beams may point 45 deg ahead
    listed_files: int = 5  # files; more are written as a pattern
    # Lines per second
    rated_points: int = 200_000  # points, half a second of a fast scanner; guard
    turning_time: float = 0.5  # s of points: tens of lines of any scanner
    turning_points: int = 4000  # points of these: enough for the mean of a direction
    turning_rates: tuple[float, float] = (4.0, 600.0)  # 1/s, slower and faster than any scanner
    uneven_turn: float = 0.25  # of the scatter for any other rate; that of rotations is a tenth
    # Origin of beams, without a mounting
    looked_shares: tuple[float, ...] = (0.5, 0.25, 0.75, 0.0, 1.0)  # of a file, until one shows it
    beam_rounds: int = 20  # of least squares; five suffice for an initial error of one meter
    # m, distance of beams from their origin: usually millimeters; decimeters with a wrong rate
    beam_scatter: float = 0.05
    epoch_bytes: int = 137  # bytes, of a line of trajectory.csv with sigmas in a UTM zone
    # Resources of a correction besides fits of its targets, docs/results.md
    decodings: float = 5.0  # times decoding the points once: reading, ties, copying, drawing
    report_seconds: float = 20.0  # s; report.html and pictures
    report_megabytes: float = 6.0  # MB; of these
    base_memory: float = 0.8  # GB; chunks and libraries, for any file size


SETTINGS = Settings()

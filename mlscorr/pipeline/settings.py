"""Numbers that the commands rest on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    seed: int = 0  # of random samples: the same survey gives the same result
    diagnosis_rounds: int = 5  # until none: a survey with more causes wants a look by hand
    orders: tuple[int, ...] = (2, 3, 4, 5)  # of polynomials that are compared: the paper's Table 1
    sufficient_check_points: int = 5  # points; with fewer, all points are cross-validated as well
    single_points: int = 10  # points; up to here each is left out by itself, else in groups
    groups: int = 5  # groups; of control points spread in time, left out in turn
    scanned_radius: float = 2.0  # m about a target; more than the board, less than a street is wide
    scanned_stride: int = 10  # points; balls of metres about targets hold hundreds
    tile_overlap: float = 0.1  # share of the shorter file's time; more: two scanners, not tiles
    looked_points: int = 8  # surveyed points looked at before a run: seconds, and enough to tell
    # s, of which a look at fewer of them is made where targets are dense
    looked_seconds: float = 8.0
    looked_length: float = 15.0  # m, of the way to either side of one: beams may look 45 deg ahead
    listed_files: int = 5  # files; more are written as a pattern
    # Lines a second
    rated_points: int = 200_000  # points, half a second of a fast scanner; guard
    turning_time: float = 0.5  # s of points: tens of lines of any scanner
    turning_points: int = 4000  # points of these: enough for the mean of a direction
    turning_rates: tuple[float, float] = (4.0, 600.0)  # 1/s, slower and faster than any scanner
    uneven_turn: float = 0.25  # of the scatter that any other rate leaves; that of turns is a tenth
    # Where beams come from, without a mounting
    looked_shares: tuple[float, ...] = (0.5, 0.25, 0.75, 0.0, 1.0)  # of a file, until one shows it
    beam_rounds: int = 20  # of least squares; a metre off at first, five suffice
    # m, by which beams pass by where they come from: millimetres do, and a wrong rate decimetres
    beam_scatter: float = 0.05
    epoch_bytes: int = 137  # bytes, of a line of trajectory.csv with sigmas in a UTM zone
    # What a correction took beside the fits of its targets, docs/results.md
    decodings: float = 5.0  # times decoding the points once: reading, ties, copying, drawing
    report_seconds: float = 20.0  # s; report.html and pictures
    report_megabytes: float = 6.0  # MB; of these
    base_memory: float = 0.8  # GB; chunks and libraries, whatever the size of the files


SETTINGS = Settings()

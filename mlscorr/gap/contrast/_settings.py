"""Numbers of the comparison of channels, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What is kept of a cloud, and from when on a difference is said to be there.

    ``tests/pipeline/test_contrasts.py`` shows what they find, and that twins differ in nothing.
    """

    # what is kept
    kept: int = 40_000  # cells, and edges: 10 MB, and a ratio of a bin to a percent; guard
    distance_points: int = 20_000  # of whole cells, for distances between clouds; guard
    # depth edges along a scan line
    jump: float = 0.3  # m between the surfaces before and after: more than a curb
    plateau: int = 3  # pulses on each of them
    widest: int = 12  # pulses of an edge: 12 mrad at the usual step of 1 mrad
    same_pulse: float = 5e-3  # m across the beam between returns of one pulse: rounding of the file
    # bins and blocks
    # m, finest ones: those in which too few blocks lie are joined
    ranges: tuple[float, ...] = (
        0,
        2,
        4,
        6,
        8,
        10,
        12,
        15,
        20,
        25,
        30,
        40,
        50,
        60,
        80,
        100,
        150,
        500,
    )
    incidences: tuple[float, ...] = (0, 15, 30, 45, 60, 75, 90)  # deg
    bootstrap_block: float = 16.0  # m of ground: a house or a lane has one reflectance
    least_blocks: int = 6  # in a bin, for a sigma known to a third; bins with fewer are joined
    bootstrap_replicas: int = 400  # of the bootstrap: a sigma to 4 %
    difference_confidence: float = 0.99  # that two clouds differ by more than chance
    # distances between distributions
    drawn: int = 300  # of each sample at a time, as all pairs of them are looked at: 0.7 MB
    halves: int = 30  # times that this is done: their mean to a fifth of the scatter of each


SETTINGS = Settings()

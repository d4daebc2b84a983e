"""Settings of the comparison of channels, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Size of the sample of a cloud, and significance of a difference.

    ``tests/pipeline/test_contrasts.py`` shows their sensitivity, and that twins do not differ.
    """

    # sample
    kept: int = 40_000  # cells, and edges: 10 MB, and a ratio of a bin to 1 %; guard
    distance_points: int = 20_000  # of whole cells, for distances between clouds; guard
    # depth edges along a scan line
    jump: float = 0.3  # m between the surfaces before and after: more than a curb
    plateau: int = 3  # pulses on each of them
    widest: int = 12  # pulses of an edge: 12 mrad at the usual step of 1 mrad
    same_pulse: float = 5e-3  # m across the beam between returns of one pulse: rounding in files
    # bins and blocks m, the finest ones: those with too few blocks are merged
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
    least_blocks: int = 6  # in a bin, for a sigma to a third; smaller bins are merged
    bootstrap_replicas: int = 400  # of the bootstrap: a sigma to 4 %
    difference_confidence: float = 0.99  # that two clouds differ by more than chance
    # distances between distributions
    drawn: int = 300  # of each sample at a time, for all pairs of them: 0.7 MB
    halves: int = 30  # repetitions: their mean to a fifth of the scatter of each


SETTINGS = Settings()

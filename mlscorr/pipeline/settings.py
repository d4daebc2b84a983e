"""Numbers that the commands rest on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    seed: int = 0  # of random samples: the same survey gives the same result
    orders: tuple[int, ...] = (2, 3, 4, 5)  # of polynomials that are compared: the paper's Table 1
    check_points: int = 5  # points; with fewer, all points are cross-validated as well
    single_points: int = 10  # points; up to here each is left out by itself, else in groups
    groups: int = 5  # groups; of control points spread in time, left out in turn
    scanned_radius: float = 2.0  # m about a target; more than the board, less than a street is wide
    scanned_stride: int = 10  # points; balls of metres about targets hold hundreds
    tile_overlap: float = 0.1  # share of the shorter file's time; more: two scanners, not tiles


SETTINGS = Settings()

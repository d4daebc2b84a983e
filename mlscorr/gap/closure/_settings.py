"""Settings of the simulator's second run, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Selection of pulses to replay, and identification of simulated targets.

    ``tests/gap/closure`` shows that runs without effects leave only noise.
    """

    around: float = 1.25  # sizes around a target's center: a board's corner is 1.06 away
    search_margin: float = 0.3  # m more: possible motion of a target in a simulation
    edge: float = 1.05  # times a target's size: within it, a recorded point may be its edge
    target_pulses: int = 40_000  # around a target, nearest in time: vehicles stop; guard
    delivered: float = 0.7  # of all pauses are of one pulse: fewer indicate a thinned cloud
    line_pulses: int = 100  # that show the sequence of pulses
    plane_elevation: float = 0.01  # rad: elevations of one scan plane
    worst: float = 3.0  # times the sigma of a row, above which a simulated target is ignored
    least_worst: float = 0.003  # m: best accuracy of a simulated target
    extent: float = 0.6  # of a target's extent, from expected center to farthest point
    background: float = 0.75  # of its size from its center: off disc and plate
    largest_offset: float = 0.5  # of its size, from expected to found position
    block_length: float = 5.0  # s of a time block: the drift of seconds is held out with it
    event_share: float = 0.25  # of an event's width in a block: the rest is for training
    # of a cause's squared shift: one such block leaves nothing for the test
    block_share: float = 0.8
    folds: int = 5  # of blocks: each size is estimated from four fifths of them


SETTINGS = Settings()

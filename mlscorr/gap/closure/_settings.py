"""Numbers of the simulator's second run, with their reasons."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Which pulses are fired again, and when a target that they show is the one that was observed.

    ``tests/gap/closure`` shows that runs without effects leave nothing but noise.
    """

    around: float = 1.25  # sizes about a target's centre: a board's corner is 1.06 away
    search_margin: float = 0.3  # m more: by so much a target may move in a simulation
    edge: float = 1.05  # times a target's size: within that, what was recorded may be its edge
    target_pulses: int = 40_000  # about a target, the nearest in time: vehicles stand; guard
    delivered: float = 0.7  # of all pauses, that are of one pulse: fewer tell of a thinned cloud
    line_pulses: int = 100  # that show how others follow them
    level: float = 0.01  # rad: elevations of one scan plane
    worst: float = 3.0  # times the sigma of a row, from which a simulated target isn't compared
    least_worst: float = 0.003  # m: as well as any simulated target is known
    extent: float = 0.6  # of a target's longest extent, from its expected centre to its last point
    background: float = 0.75  # of its size from its centre: off disc and plate
    largest_offset: float = 0.5  # of its size, from where it is expected to where it is found
    block_length: float = 5.0  # s of a block of time: the drift of seconds is held out with it
    event_share: float = 0.25  # of an event's width that a block lasts: some is left to learn from
    # of a cause's squared shift: one such block leaves nothing to judge by
    block_share: float = 0.8
    folds: int = 5  # of blocks: each size is found in four fifths of them


SETTINGS = Settings()

"""Numbers that projects rest on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    losses: int = 2  # times that a task may lose its worker alone, before it is to blame itself
    waiting: int = 2  # tasks for each worker that are handed out: the next is there when it ends
    area_seconds: int = 6_500  # that drives spend in an area with its margin: 2 GB, some minutes
    interval: float = 10.0  # s between two lines on how far it has come, and looks at a cluster
    cached: int = 2  # drives that a worker holds: that of this task, and of the one before


SETTINGS = Settings()

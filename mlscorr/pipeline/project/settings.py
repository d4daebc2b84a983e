"""Numbers that projects rest on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Limits and choices, each with its unit and reason."""

    losses: int = 2  # times that a task may lose its worker before it is to blame; guard
    waiting: int = 2  # tasks handed out for each worker: the next is there when one ends; guard
    area_seconds: int = 6_500  # that drives spend in an area and its margin: 2 GB, minutes; guard
    interval: float = 10.0  # s between two lines on progress, and looks at a cluster; guard
    cached: int = 2  # drives that a worker holds: that of this task, and of the one before; guard


SETTINGS = Settings()

"""Progress sentences of a project's run, for the terminal and its log."""

from mlscorr.survey import Statement, Wording
from mlscorr.wording import counted, percent

TITLES = {
    "tiles": "Reading headers",
    "findings": "Reading the clouds",
    "areas": "Estimating areas",
    "clouds": "Writing the clouds",
    "reports": "Reporting",
}


def duration(seconds: float) -> str:
    """Format a duration in words.

    >>> duration(59.6), duration(3725)
    ('1 min', '1 h 2 min')
    """
    if seconds < 59.5:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{minutes} min"


def _stage_progress(
    stage: str,
    done: int,
    tasks: int,
    drives: int,
    share: float,
    rate: float,
    left: float | None,
    failures: int,
) -> str:
    whole = str(tasks)
    if drives:
        whole = f"{counted(tasks, 'file')} of {counted(drives, 'drive')}"
    time = ""
    if left is not None:
        time = f"{duration(left)} left in this stage, "
    return (
        f"{TITLES[stage]}: {done} of {whole}, {percent(share)}, {rate / 1e6:.3g} M points/s, {time}"
        f"{counted(failures, 'failure')} so far"
    )


PROGRESS: dict[str, Wording] = {
    "task warning": "Warning: {task}: {text}",
    "task failed": "Failed: {task}: {text}",
    "task lost with scheduler": "{task} was lost with the scheduler and is repeated.",
    "task lost with worker": "{task} lost its worker and is repeated.",
    "no worker yet": "The cluster has no worker yet: waiting at {scheduler}, at most {patience}.",
    "scheduler lost": "The scheduler is lost and may restart: waiting at {scheduler}, at most "
    "{patience}.",
    "scheduler back": "A scheduler responds again; the tasks of the lost one were submitted to it.",
    "drives estimated": "Estimating {drives} drives together.",
    "stage progress": _stage_progress,
}


def progress_sentence(statement: Statement) -> str:
    """Return the sentence of a progress statement.

    Parameters
    ----------
    statement : Statement
        With a key of PROGRESS.
    """
    return statement.sentence(PROGRESS)

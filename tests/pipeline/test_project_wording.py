"""The catalogue of the sentences of a run of a project, with values as a run has them."""

import pytest

from mlscorr.pipeline.project.wording import PROGRESS, progress_sentence
from mlscorr.survey import Statement

STAGE = {
    "stage": "tiles",
    "done": 95,
    "tasks": 100,
    "drives": 3,
    "share": 0.95,
    "rate": 1.25e6,
    "left": 312.0,
    "failures": 1,
}
CATALOGUE = [
    (
        "task warning",
        {"task": "north/tile-1.laz", "text": "100 points have no time."},
        "Warning: north/tile-1.laz: 100 points have no time.",
    ),
    (
        "task failed",
        {"task": "north/tile-1.laz", "text": "it is truncated."},
        "Failed: north/tile-1.laz: it is truncated.",
    ),
    (
        "task lost with scheduler",
        {"task": "north/tile-1.laz"},
        "north/tile-1.laz was lost with the scheduler and is repeated.",
    ),
    (
        "task lost with worker",
        {"task": "north/tile-1.laz"},
        "north/tile-1.laz lost its worker and is repeated.",
    ),
    (
        "no worker yet",
        {"scheduler": "tcp://10.0.0.1:8786", "patience": "60 s"},
        "The cluster has no worker yet: waiting at tcp://10.0.0.1:8786, at most 60 s.",
    ),
    (
        "scheduler lost",
        {"scheduler": "tcp://10.0.0.1:8786", "patience": "60 s"},
        "The scheduler is lost and may restart: waiting at tcp://10.0.0.1:8786, at most 60 s.",
    ),
    (
        "scheduler back",
        {},
        "A scheduler responds again; the tasks of the lost one were submitted to it.",
    ),
    ("drives estimated", {"drives": 4}, "Estimating 4 drives together."),
    (
        "stage progress",
        STAGE,
        "Reading headers: 95 of 100 files of 3 drives, 95 %, 1.25 M points/s, 5 min left in "
        "this stage, 1 failure so far",
    ),
    (
        "stage progress",
        STAGE | {"stage": "areas", "drives": 0, "left": None},
        "Estimating areas: 95 of 100, 95 %, 1.25 M points/s, 1 failure so far",
    ),
]


@pytest.mark.parametrize(("key", "values", "sentence"), CATALOGUE)
def test_each_statement_has_its_sentence(key, values, sentence):
    "As the terminal and the log show it"
    assert progress_sentence(Statement(key, values=values)) == sentence


def test_no_sentence_is_missing_from_the_catalogue():
    "Every key of the progress is read"
    assert {key for key, _, _ in CATALOGUE} == PROGRESS.keys()

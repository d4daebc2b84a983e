from dataclasses import FrozenInstanceError, dataclass, is_dataclass
from pathlib import Path

import ablation
import pytest

import mlscorr


@dataclass(frozen=True)
class Settings:
    width: float = 3.0  # m, of the lane (a survey)
    count: int = 5  # lanes at most
    limits: tuple = (0.5, 2.0)  # m: from here to there
    idle: float = 7.0  # s; nothing reads it
    name: str = "street"  # no number
    on: bool = True  # nor this


SETTINGS = Settings()


def figures():
    "A benchmark that feels width, count and limits, and refuses a count of ten"
    if SETTINGS.count == 10:
        raise ValueError("10 lanes, at most 9")
    return {"area": SETTINGS.width * SETTINGS.count, "span": SETTINGS.limits[1], "nothing": 0.0}


def by_field():
    return {row.field: row for row in ablation.ablate(SETTINGS, figures)}


def test_each_number_is_halved_and_doubled():
    "Numbers and tuples of numbers, whole ones whole, and neither words nor flags"
    rows = by_field()
    assert list(rows) == ["width", "count", "limits", "idle"]
    assert rows["width"].half["area"] == 7.5
    assert rows["width"].double["area"] == 30.0
    assert rows["count"].half["area"] == 6.0
    assert rows["limits"].double["span"] == 4.0


def test_what_moved_and_what_no_figure_feels():
    "Relative changes of figures beyond the tolerance, and an error's sentence"
    rows = by_field()
    assert rows["width"].changes(figures()) == [["area -50.0%"], ["area +100.0%"]]
    assert rows["width"].changes(figures(), tolerance=0.6)[0] == []
    assert rows["idle"].changes(figures()) == [[], []]
    assert rows["count"].changes(figures())[1] == ["ValueError: 10 lanes, at most 9"]


def test_the_settings_are_left_as_they_were():
    "The same frozen instance with its own values again, also after an error"
    by_field()
    assert Settings() == SETTINGS
    with pytest.raises(FrozenInstanceError):
        SETTINGS.width = 1.0


def test_units_are_read_from_the_comments():
    "The first word of each comment"
    units = ablation.units_of(Settings)
    assert (units["width"], units["limits"], units["idle"]) == ("m", "m", "s")


def test_the_table_says_where_nothing_moved(capsys):
    "One line for the field that nothing reads, and the figures of the room above"
    ablation.report("toy", SETTINGS, figures)
    out = capsys.readouterr().out
    assert "area 15" in out.splitlines()[0]
    (idle,) = [line for line in out.splitlines() if line.startswith("idle")]
    assert idle.endswith("not felt")


def test_rooms_that_are_registered_have_numbers_and_a_function():
    "Each class Settings is one of a room with figures of its own; that of what grades is sealed"
    package = Path(mlscorr.__file__).parent
    homes = {path.parent.relative_to(package).as_posix() for path in package.rglob("*settings.py")}
    assert set(ablation.ROOMS) == homes - {"blind"}
    for room, (_, figures) in ablation.ROOMS.items():
        assert is_dataclass(ablation.settings_of(room))
        assert callable(figures)

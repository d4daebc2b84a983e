"""Scores of hand-made answers are right."""

import numpy as np
import pytest

from mlscorr.blind import score
from tests.beds.places import BENCHMARKS


def label(kind, *names, mdb=3.0, likeness=None, without="range_bias", mechanism=None, sky="open"):
    "A label of effects whose magnitude is 0.01"
    return {
        "sky": sky,
        "kind": kind,
        "names": list(names),
        "mdb": [mdb] * max(len(names), kind == "outside"),
        "without": without,
        "effects": [{"name": name, "magnitude": 0.01} for name in names],
        "parameters": {name: {"magnitude": 0.01} for name in names},
        "normal": {name: [[4.0]] for name in names},
        "likeness": likeness or {name: {name: 1.0} for name in names},
        "mechanism": mechanism,
    }


def answer(
    said,
    probability=1.0,
    several=None,
    lead="",
    shrink=0.0,
    estimate=0.01,
    sigma=1e-3,
    p_value=0.5,
):
    "An answer as gap.json has it"
    parameter = {"name": "magnitude", "unit": "m", "estimate": estimate, "sigma": sigma}
    return {
        "document": {
            "verdict": {
                "label": said,
                "probability": probability,
                "set": several or [said],
                "p_value": p_value,
                "lead": lead,
            },
            "closure": {"shrink": shrink},
            "causes": [{"effect": said, "parameters": [parameter]}],
        }
    }


def scored(*cases):
    told = score({f"{i:04d}": case for i, case in enumerate(cases)})
    return {row["name"]: row for row in told["rows"]}, told


def test_recovers_the_rates_of_hand_made_answers():
    "Of 100 clean surveys with one alarm the rate is 1 %, of 50 effects with two missed 96 %"
    clean = [(label("clean"), answer("none"))] * 98
    clean += [(label("clean"), answer("lever_arm")), (label("clean"), answer("range_noise"))]
    found = (label("single", "range_bias"), answer("range_bias", shrink=0.98))
    missed = (label("single", "range_bias"), answer("none"))
    rows, told = scored(*clean, *[found] * 48, *[missed] * 2)
    alarm = rows["clean: a cause claimed"]
    right = rows["right at 3 MDB and more"]
    assert (alarm["cases"], alarm["value"], alarm["reached"]) == (100, 0.01, True)
    assert (right["cases"], right["value"], right["reached"]) == (50, 0.96, True)
    by_class = rows["right at 3 MDB and more, by class"]
    assert (by_class["value"], by_class["reached"]) == (0.96, False)
    assert right["interval"] == pytest.approx([0.865, 0.989], abs=1e-3)
    assert rows["clean: noise claimed"]["value"] == 0.01
    assert rows["gap closed at 3 MDB and more, median"]["value"] == 0.98
    assert rows["gap closed at 3 MDB and more, p10"]["value"] == 0.98
    small = (label("single", "range_bias"), answer("range_bias", shrink=None))  # within chance
    closed = scored(*[found] * 3, small)[0]["gap closed at 3 MDB and more, p10"]
    assert (closed["cases"], closed["value"]) == (3, 0.98)
    assert [one["said"] for one in told["wrong"]] == ["lever_arm", "range_noise", "none", "none"]


def test_skies_are_told_apart():
    "One alarm in four surveys under a bad sky, none in five under an open one"
    said = ("lever_arm", *["none"] * 3)
    rows, _ = scored(
        *((label("clean", sky="bad"), answer(name)) for name in said),
        *[(label("clean"), answer("none"))] * 5,
    )
    assert rows["clean, bad sky: a cause claimed"]["value"] == 0.25
    assert rows["clean, open sky: a cause claimed"]["value"] == 0.0
    assert rows["clean: a cause claimed"]["value"] == pytest.approx(1 / 9)


@pytest.mark.parametrize(("power", "is_even"), [(1.0, True), (0.3, False)])
def test_p_values_of_clean_surveys_are_even_or_not(power, is_even):
    "Even ones are called so; their power of 0.3, mostly near one, is not"
    even = (np.arange(60) + 0.5) / 60
    rows, _ = scored(*((label("clean"), answer("none", p_value=p)) for p in even**power))
    row = rows["clean: p-values even (KS)"]
    assert row["cases"] == 60
    assert row["reached"] is is_even


def test_what_a_geometry_cannot_tell_apart_is_right_by_class():
    "A datum named for a lever arm that it equals by 0.95 is wrong strictly and right by class"
    alike = {"lever_arm": {"lever_arm": 1.0, "vertical_datum": 0.95, "boresight": 0.6}}
    one = label("single", "lever_arm", mdb=2.0, likeness=alike)
    rows, told = scored((one, answer("vertical_datum")), (one, answer("boresight")))
    assert rows["right at 2 MDB"]["value"] == 0.0
    assert rows["right at 2 MDB, by class"]["value"] == 0.5
    assert [each["said"] for each in told["wrong"]] == ["boresight"]


def test_a_withheld_effect_is_wrongly_named_where_the_name_is_unlike_it():
    "Of four answers one is unknown, one noise, one alike, and one unlike: 25 % wrongly named"
    like = {"lever_arm": {"lever_arm": 1.0, "vertical_datum": 0.95, "boresight": 0.2}}
    one = label("withheld", "lever_arm", likeness=like, without="lever_arm")
    said = ("unknown", "position_noise", "vertical_datum", "boresight")
    rows, _ = scored(*((one, answer(name)) for name in said))
    assert rows["withheld: unknown or noise"]["value"] == 0.5
    assert rows["withheld: unknown, noise or of its class"]["value"] == 0.75
    assert rows["withheld: wrongly named"]["value"] == 0.25


def test_a_lead_counts_only_where_all_it_must_say_is_said():
    "Of three flagged mechanisms two have a lead of the right error by the right cause"
    mechanism = {"name": "lift", "size": 0.02, "unit": "m", "lead": ["height error", "speed|pace"]}
    one = label("outside", mechanism=mechanism, likeness={"lift": {"lever_arm": 0.3}})
    leads = ("height error that grows with speed", "height error by pace", "height error by range")
    rows, _ = scored(*((one, answer("unknown", lead=lead)) for lead in leads))
    assert rows["outside: unknown"]["value"] == 1.0
    assert rows["outside: lead right where unknown"]["value"] == pytest.approx(2 / 3)


def test_pairs_need_both_in_any_order():
    "One of two is not enough, and a third is too many"
    one = label("pair", "time_offset", "range_bias", mdb=4.0)
    said = ("range_bias+time_offset", "time_offset", "time_offset+range_bias+boresight")
    rows, _ = scored(*((one, answer(name)) for name in said))
    assert rows["both of a pair"]["value"] == pytest.approx(1 / 3)


def test_errors_and_intervals_of_parameters_are_those_of_the_estimates():
    "10 % off with a sigma of 10 % lies inside the 95 % interval, 30 % off outside"
    one = label("single", "range_bias")
    cases = [
        (one, answer("range_bias", estimate=0.011)),
        (one, answer("range_bias", estimate=0.013)),
    ]
    rows, _ = scored(*cases)
    assert rows["error of the parameters at 3 MDB, median"]["value"] == pytest.approx(0.2)
    assert rows["95 % intervals hold the parameter"]["value"] == 0.5


def test_a_diagnosis_that_gave_up_is_never_right():
    "A failed diagnosis counts as missed, and its sentence is kept"
    rows, told = scored((label("single", "range_bias"), {"error": "Nothing to compare."}))
    assert rows["right at 3 MDB and more"]["value"] == 0.0
    assert told["failed"] == {"0000": "Nothing to compare."}


def test_the_goals_are_those_of_the_manual():
    "Scores are compared with the goals in the table of the manual"
    cases = [(label("clean"), answer("none")), (label("noise", "range_noise"), answer("none"))]
    cases += [(label("single", "range_bias"), answer("range_bias"))] * 2
    rows, _ = scored(*cases)
    lines = (BENCHMARKS.parent / "docs" / "results-blind.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")] for line in lines if line.count("|") == 5]
    told = {row[1]: row[4] for row in cells}
    for name in ("clean: a cause claimed", "noise: named", "right at 3 MDB and more"):
        (number,) = [value for value in rows[name]["goal"] if value is not None]
        assert told[name].endswith(f"= {100 * number:.0f} %")

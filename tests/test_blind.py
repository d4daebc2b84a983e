"""The blind check: labels stay sealed, diagnoses see surveys alone, scores are right."""

import json
import shutil
import stat

import numpy as np
import pytest

from mlscorr.gap.mix import RANDOM, SHARES, SYSTEMATIC, mix
from mlscorr.gap.scoring import calibration_error, score, wilson
from mlscorr.io.survey_file import read_survey
from mlscorr.pipeline.blind import make_blind, run_blind, score_blind
from mlscorr.simulate import Scenario, simulate

CASES, SEED = 2, 5


def label(kind, *names, mdb=3.0, likeness=None, without="range_bias", mechanism=None):
    "A label of effects whose magnitude is 0.01"
    return {
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


def answer(said, probability=1.0, several=None, lead="", shrink=None, estimate=0.01, sigma=1e-3):
    "An answer as gap.json has it"
    parameter = {"name": "magnitude", "unit": "m", "estimate": estimate, "sigma": sigma}
    return {
        "document": {
            "verdict": {
                "label": said,
                "probability": probability,
                "set": several or [said],
                "p_value": 0.5,
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
    alarm, right = rows["clean: a cause claimed"], rows["right at 3 MDB and more"]
    assert (alarm["cases"], alarm["value"], alarm["reached"]) == (100, 0.01, True)
    assert (right["cases"], right["value"], right["reached"]) == (50, 0.96, False)
    assert right["interval"] == pytest.approx([0.865, 0.989], abs=1e-3)
    assert rows["clean: noise claimed"]["value"] == 0.01
    assert rows["gap closed at 3 MDB and more, median"]["value"] == 0.98
    assert rows["gap closed at 3 MDB and more, p10"]["value"] == 0.98
    assert [one["said"] for one in told["wrong"]] == ["lever_arm", "range_noise", "none", "none"]


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


def test_calibration_compares_what_was_stated_with_what_was_right():
    "Stated 0.9 and right in 9 of 10 is calibrated; right in 5 of 10 is off by 0.4"
    assert calibration_error([(0.9, i < 9) for i in range(10)]) == pytest.approx(0.0, abs=1e-12)
    assert calibration_error([(0.9, i < 5) for i in range(10)]) == pytest.approx(0.4)


def test_wilson_intervals_hold_the_true_rate():
    "Over 2000 draws of 40 at a rate of 3 % the 95 % interval holds it in 93 % at least"
    hits = np.random.default_rng(1).binomial(40, 0.03, 2000)
    limits = {int(k): wilson(k, 40) for k in np.unique(hits)}
    held = [limits[k][0] <= 0.03 <= limits[k][1] for k in hits]
    assert np.mean(held) > 0.93


@pytest.mark.parametrize("seed", [1, 2])
def test_the_mix_holds_each_kind_and_each_effect_in_turn(seed):
    "Of 300 cases 20 % are clean, each effect is withheld twice or more, none lacks a name"
    cases = mix(300, np.random.default_rng(seed), ("a", "b"))
    kinds = [case.kind for case in cases]
    assert {kind: kinds.count(kind) for kind in SHARES} == {
        kind: round(300 * share) for kind, share in SHARES.items()
    }
    withheld = [case.names[0] for case in cases if case.kind == "withheld"]
    assert min(withheld.count(name) for name in SYSTEMATIC) >= 2
    for case in cases:
        assert case.without in SYSTEMATIC
        assert (case.without in case.names) == (case.kind == "withheld")
        assert case.kind != "noise" or case.names[0] in RANDOM
    assert "outside" not in {case.kind for case in mix(50, np.random.default_rng(seed))}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    "A blind check of two cases"
    out = tmp_path_factory.mktemp("check") / "blind"
    assert make_blind(out, CASES, SEED, workers=1) == CASES
    return out


def copied(made, tmp_path):
    return shutil.copytree(made, tmp_path / "blind")


def test_makes_surveys_that_hold_no_truth(made):
    "Two surveys that can be read, sealed labels, a key for its owner alone, no truth anywhere"
    folders = sorted((made / "cases").iterdir())
    assert [folder.name for folder in folders] == ["0001", "0002"]
    assert not list(made.rglob("truth*"))
    assert stat.S_IMODE((made / "key.json").stat().st_mode) == 0o600
    for folder in folders:
        survey = read_survey(folder)
        assert len(survey.control) >= 12
        assert 100_000 < sum(file.points for file in survey.clouds) < 3_000_000
        assert (survey.reference is not None) == (folder / "reference.ply").exists()
        assert json.loads((folder / "library.json").read_text())["without"][0] in SYSTEMATIC
    seals = json.loads((made / "seals.json").read_text())["seals"]
    assert all(len(seal) == 64 for seal in seals.values())


def test_goes_on_where_it_stopped_and_refuses_another_check(made, tmp_path):
    "A second make leaves all as it is; one with another seed is refused"
    out = copied(made, tmp_path)
    before = (out / "key.json").read_text()
    assert make_blind(out, CASES, SEED) == CASES
    assert (out / "key.json").read_text() == before
    with pytest.raises(ValueError, match=r"2 cases with seed 5 and 0 mechanisms, not this one"):
        make_blind(out, CASES, SEED + 1)


@pytest.mark.parametrize("part", ["label", "salt"])
def test_a_changed_label_or_salt_is_refused(made, tmp_path, part):
    "A broken seal is told and nothing is scored"
    out = copied(made, tmp_path)
    key = json.loads((out / "key.json").read_text())
    sealed = key["labels"]["0002"]
    sealed[part] = {**sealed["label"], "kind": "clean"} if part == "label" else "0" * 32
    sealed["label"]["mdb"] = [9.0] if part == "label" else sealed["label"]["mdb"]
    (out / "key.json").write_text(json.dumps(key))
    with pytest.raises(ValueError, match=r"1 of 2 seals of .* are broken \(first: 0002\)"):
        score_blind(out)
    assert not (out / "score.json").exists()


def test_an_unanswered_check_is_not_scored(made):
    "Before any diagnosis there is nothing to score"
    with pytest.raises(ValueError, match="no answers yet"):
        score_blind(made)


def test_a_readable_truth_is_refused(made, tmp_path):
    "A truth in a survey's folder stops the run before anything is diagnosed"
    out = copied(made, tmp_path)
    (out / "cases" / "0002" / "truth.json").write_text("{}")
    with pytest.raises(ValueError, match=r"0002/truth.json can be read by the diagnosis"):
        run_blind(out)
    assert not (out / "answers").exists()


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    "Folder of a survey of 12 s with 6 control points, without its truth"
    folder = tmp_path_factory.mktemp("short")
    scenario = Scenario(
        drive={"duration": 12.0},
        targets={"control": 6, "check": 2},
        scanner=[{"lines_per_second": 75, "points_per_line": 400}],
    )
    simulate(scenario, np.random.default_rng(1)).write(folder)
    for name in ("truth.json", "truth.npz"):
        (folder / name).unlink()
    (folder / "library.json").write_text('{"without": ["range_bias"]}')
    return folder


def test_answers_depend_on_the_survey_alone(made, short, tmp_path):
    "Folders in the place of truth files leave an answer as it was; answered cases are left alone"
    out = copied(made, tmp_path)
    for name in ("0001", "0002"):
        shutil.rmtree(out / "cases" / name)
        shutil.copytree(short, out / "cases" / name)
    for hidden in ("truth.json", "truth.npz", "key.json"):
        (out / "cases" / "0002" / hidden).mkdir()
        (out / "cases" / "0002" / hidden / "garbage").write_bytes(b"\0" * 9)
    assert run_blind(out, workers=1) == (2, 0)
    one, two = (
        json.loads((out / "answers" / f"{name}.json").read_text()) for name in ("0001", "0002")
    )
    assert one["document"] == two["document"]
    assert stat.S_IMODE((out / "key.json").stat().st_mode) == 0o600
    assert run_blind(out, workers=1) == (2, 0)  # nothing left to do
    assert json.loads((out / "answers" / "0001.json").read_text()) == one
    told = score_blind(out)
    assert told["answered"] == 2
    assert json.loads((out / "score.json").read_text()) == told

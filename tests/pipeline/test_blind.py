"""The blind check: labels stay sealed, diagnoses see surveys alone, scores are right."""

import json
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mlscorr.effects import known_effects
from mlscorr.io.surveys import read_survey
from mlscorr.pipeline import make_blind, run_blind, score_blind
from mlscorr.simulate import Scenario, simulate
from tests.beds import own_effects

pytestmark = pytest.mark.long

CASES = 2
SEED = 5


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
    names = {kind.name for kind in known_effects()}
    assert [folder.name for folder in folders] == ["0001", "0002"]
    assert not list(made.rglob("truth*"))
    assert stat.S_IMODE((made / "key.json").stat().st_mode) == 0o600
    for folder in folders:
        survey = read_survey(folder)
        assert len(survey.control) >= 12
        assert 100_000 < sum(file.points for file in survey.clouds) < 3_000_000
        assert (survey.reference is not None) == (folder / "reference.ply").exists()
        assert json.loads((folder / "library.json").read_text())["without"][0] in names
    seals = json.loads((made / "seals.json").read_text())["seals"]
    assert all(len(seal) == 64 for seal in seals.values())


def test_goes_on_where_it_stopped_and_refuses_another_check(made, tmp_path):
    "A second make leaves all as it is; one with another seed is refused"
    out = copied(made, tmp_path)
    before = (out / "key.json").read_text()
    assert make_blind(out, CASES, SEED, workers=1) == CASES
    assert (out / "key.json").read_text() == before
    with pytest.raises(ValueError, match=r"2 cases with seed 5 and 704 mechanisms, not this one"):
        make_blind(out, CASES, SEED + 1, workers=1)


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
    with pytest.raises(ValueError, match="has no answers"):
        score_blind(made)


def test_a_readable_truth_is_refused(made, tmp_path):
    "A truth in a survey's folder stops the run before anything is diagnosed"
    out = copied(made, tmp_path)
    (out / "cases" / "0002" / "truth.json").write_text("{}")
    with pytest.raises(ValueError, match=r"The diagnosis can read .*0002/truth.json"):
        run_blind(out, workers=1)
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


def test_effects_of_a_file_are_drawn_diagnosed_and_scored(tmp_path):
    "Of 30 effects a user's is the first to be drawn with a seed: it is made, weighed and scored"
    own = Path(own_effects.__file__).read_text()
    own += "\n\nfrom mlscorr.effects import register\n\nregister(Squat)\n"
    (tmp_path / "squat.py").write_text(own)
    code = (
        "import sys, numpy as np; from mlscorr.blind._mix import mix\n"
        "from mlscorr.effects import register_file; register_file(sys.argv[1])\n"
        "def drawn(seed): return mix(1, np.random.default_rng([seed]))[0]\n"
        "print(next(s for s in range(10**4) if drawn(s).names == ('squat',) and drawn(s).mdb >= 4 "
        "and drawn(s).kind == 'single'))"
    )

    def run(*command):
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)

    seed = run(sys.executable, "-c", code, "squat.py").stdout.strip()
    blind = (sys.executable, "-m", "mlscorr", "blind")
    own = ("--effects", "squat.py")
    run(*blind, "make", "out", "--cases", "1", "--seed", seed, "--workers", "1", *own)
    key = json.loads((tmp_path / "out" / "key.json").read_text())
    assert key["plan"]["effects"] == ["squat"]
    assert key["labels"]["0001"]["label"]["names"] == ["squat"]
    run(*blind, "run", "out", "--workers", "1", *own)
    answer = json.loads((tmp_path / "out" / "answers" / "0001.json").read_text())
    assert "squat" in {cause["effect"] for cause in answer["document"]["causes"]}
    score = json.loads(run(*blind, "score", "out", "--json", *own).stdout)
    assert score["answered"] == 1
    assert not score["failed"]

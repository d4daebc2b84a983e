"""mlscorr compare of two results: what it takes, says, writes and refuses."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from mlscorr.cli import app
from tests.beds.documents import undocumented


@pytest.fixture
def pair(commanded, tmp_path):
    "Two folders with the same result: (first, second)"
    _, out = commanded
    return [shutil.copytree(out, tmp_path / name) for name in ("one", "two")]


def run(*arguments):
    "Run a command in this process"
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


def test_two_results_are_compared_on_the_screen_alone(pair):
    "Without -o nothing is written; stdout has the document, stderr the first screen"
    before = [sorted(path.rglob("*")) for path in pair]
    ended = run(*pair, "--json")
    assert ended.exit_code == 0, ended.stderr
    document = json.loads(ended.stdout)
    assert document["schema"] == "mlscorr.compare_results/1"
    assert not undocumented(document)
    for row in document["statements"]:
        assert row["sentence"] in ended.stderr
    assert [sorted(path.rglob("*")) for path in pair] == before


def test_results_go_into_a_folder_once(pair, tmp_path):
    "-o writes document and page, refuses the same folder again, and never a folder that it reads"
    out = tmp_path / "compared"
    assert run(*pair, "-o", out).exit_code == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "compare_results.html",
        "compare_results.json",
        "log.txt",
    ]
    assert run(*pair, "-o", out).exit_code == 2
    assert run(*pair, "-o", out, "--overwrite").exit_code == 0
    assert run(*pair, "-o", pair[0], "--overwrite").exit_code == 2


def test_what_is_neither_a_survey_nor_two_results_is_refused(pair, street, tmp_path):
    "One result alone, a survey among them, methods of results: exit code 2"
    for arguments, part in (
        ([pair[0]], "a comparison needs two"),
        ([pair[0], "-o", tmp_path / "out"], "a comparison needs two"),
        ([pair[0], street], "is not a result of mlscorr correct"),
        ([street, pair[0]], "is not a result of mlscorr correct"),
        ([*pair, "--clouds", "lsc"], "--clouds applies to the methods on one survey"),
    ):
        ended = run(*arguments)
        assert ended.exit_code == 2 and part in ended.stderr, ended.stderr
    assert not (tmp_path / "out").exists()
    (pair[1] / "trajectory.csv").unlink()
    ended = run(*pair)
    assert ended.exit_code == 3 and "it has no trajectory.csv" in ended.stderr

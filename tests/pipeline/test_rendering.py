"""From a survey to pictures of it."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import mlscorr
from mlscorr.correction import Correction
from mlscorr.pipeline import render
from mlscorr.pipeline.rendering import read_correction
from tests.beds.places import ROOT

pytestmark = pytest.mark.long

EXAMPLE = ROOT / "benchmarks" / "pictures" / "render_before_after.py"


@pytest.fixture(scope="module")
def survey(street):
    return mlscorr.read_survey(street)


def test_the_example_makes_its_picture(street, tmp_path):
    "The example draws a survey that it is given, and puts three pages together"
    picture = tmp_path / "picture.png"
    out = tmp_path / "pages"
    subprocess.check_output(
        [sys.executable, EXAMPLE, street, "--picture", picture, "--out", out], text=True
    )
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert (out / "target-T05.png").exists()


def test_a_correction_is_read_back_from_its_results(street, survey, commanded):
    "The correction in a folder of mlscorr correct is the estimated one, to 0.1 mm"
    _, out = commanded
    read, rows = read_correction(survey, out)
    assert isinstance(read, Correction) and {row.name for row in rows} >= {"T01", "T05"}
    result = mlscorr.correct(survey)
    change = read.corrected.position - result.trajectory.position
    assert np.abs(change).max() < 1e-4


def test_the_command_writes_pictures_of_the_asked_size(survey, commanded, tmp_path):
    "Files in, files out: PNGs of 640 x 360, named in the document, and no second time"
    out = tmp_path / "pictures"
    document = render(survey, out, commanded[1], (640, 360), views=("overview", "section"))
    assert document["schema"] == "mlscorr.render/1"
    assert [row["file"] for row in document["pictures"]] == sorted(p.name for p in out.iterdir())
    with Image.open(out / "overview.png") as image:
        assert image.size == (640, 360)
    with pytest.raises(ValueError, match="--overwrite"):
        render(survey, out, commanded[1], (640, 360))


@pytest.mark.parametrize(
    "size, options, words",
    [((10, 10), {}, "5 x 8 pixels"), ((640, 360), {"views": ["side"]}, "no view 'side'")],
)
def test_what_cannot_be_drawn_is_refused_before_anything_is_read(
    survey, tmp_path, size, options, words
):
    "A page of 10 x 10 pixels and an unknown view come before results that are not there"
    with pytest.raises(ValueError, match=words):
        render(survey, tmp_path / "pictures", tmp_path, size, **options)


def test_results_of_another_survey_are_refused(survey, commanded, tmp_path):
    "A folder without results, and a trajectory of other epochs, are told apart"
    with pytest.raises(ValueError, match=r"no trajectory.csv and no report.json"):
        read_correction(survey, tmp_path)
    for name in ("trajectory.csv", "report.json"):
        shutil.copy(commanded[1] / name, tmp_path)
    lines = (tmp_path / "trajectory.csv").read_text().splitlines()
    (tmp_path / "trajectory.csv").write_text("\n".join(lines[:-5]) + "\n")
    with pytest.raises(ValueError, match="another survey"):
        read_correction(survey, tmp_path)

"""README and docs: what they name is there, and what they show can be used."""

import re
import tomllib

import pytest
from readme_tables import PAGES
from typer.main import get_command

from mlscorr.cli import app
from mlscorr.io.survey_sections import SurveyFile
from tests.beds.places import ROOT

NAMES = [page.name for page in PAGES]


@pytest.fixture(params=PAGES, ids=NAMES)
def page(request):
    return request.param


def anchors(text):
    "Places of a page that a link can name"
    heads = re.findall(r"(?m)^#+ (.*)$", text)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_lead_somewhere(page):
    "Each file, picture and headline that a page links to is there"
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text()):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target.read_text()), link


def test_commands_and_scripts_exist(page):
    "No page names a command or a script that is not there"
    text = page.read_text()
    known = set(get_command(app).commands)
    assert set(re.findall(r"(?m)^(?:\.venv/bin/)?mlscorr (\w+)", text)) <= known
    for script in re.findall(r"`python ((?:benchmarks|examples|tests)/\S+?\.py)", text):
        assert (ROOT / script).is_file(), script


def test_every_survey_toml_can_be_read(page):
    "The sections that the pages show are those that a survey has"
    for block in re.findall(r"```toml\n(.*?)```", page.read_text(), flags=re.S):
        SurveyFile.model_validate(tomllib.loads(block))


def test_the_readme_is_short_and_leads_to_every_page():
    "Under 120 lines, with a link to each page of the docs"
    readme = PAGES[0].read_text()
    assert len(readme.splitlines()) < 120
    text = "".join(page.read_text() for page in PAGES)
    for name in NAMES[1:]:
        assert name in text

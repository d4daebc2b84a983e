"""README and docs: what they name is there, and what they show can be used."""

import json
import re
import shutil
import tomllib
from pkgutil import resolve_name
from typing import get_args

import pytest
import readability
from pydantic import BaseModel
from readme_tables import PAGES
from typer.main import get_command

import mlscorr
from mlscorr.cli import app
from mlscorr.effects import catalogue, known_effects
from mlscorr.io.surveys import SurveyFile
from mlscorr.io.surveys.project_file import ProjectFile
from mlscorr.simulate import Scenario
from mlscorr.simulate.simulator_file import SimulatorFile
from tests.beds.places import ROOT

NAMES = [page.name for page in PAGES]
FIVE_MINUTES = 1000  # words of prose
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
BENCHMARK_OPTIONS = {"--seeds", "--passes", "--without-paint", "--words"}
PRINTED_PATH = re.compile(r"`((?:mlscorr|tests|benchmarks|docs)/[\w/.-]*)`")


@pytest.fixture(params=[*PAGES, CONTRIBUTING], ids=[*NAMES, CONTRIBUTING.name])
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


def options_of(command, words):
    "Names of the options of a command, or of the one within it that the words name"
    inner = getattr(command, "commands", {})
    if words and words[0] in inner:
        return options_of(inner[words[0]], words[1:])
    return {name for one in command.params for name in (*one.opts, *one.secondary_opts)}


def test_every_option_of_a_command_exists(page):
    "In lines of commands, continued or not, and in sentences and tables"
    text = page.read_text().replace("\\\n", " ")
    app_command = get_command(app)
    for line in re.findall(r"(?m)^mlscorr ([^#\n]+)", text):
        known = options_of(app_command, line.split()) | {"--help"}
        used = re.findall(r"(?<!\S)(--?[a-z][\w-]*)", re.sub(r"\"[^\"]*\"|'[^']*'", "", line))
        assert set(used) <= known, line
    every = {"--version", "--install-completion", "--help"}
    for command in app_command.commands.values():
        for one in (command, *getattr(command, "commands", {}).values()):
            every |= options_of(one, [])
    others = ("CONTRIBUTING.md", "cluster.md")  # options of dask and of benchmarks
    inline = re.findall(r"`(--[a-z][a-z-]+)", text)
    assert page.name in others or not {*inline} - every - BENCHMARK_OPTIONS


def test_every_survey_toml_can_be_read(page):
    "The sections that the pages show are those of a survey, a project, a scenario or a simulator"
    for block in re.findall(r"```toml\n(.*?)```", page.read_text(), flags=re.S):
        document = tomllib.loads(block)
        model = SimulatorFile
        if "cloud" in document:
            model = SurveyFile
        elif isinstance(document.get("drive"), list):
            model = ProjectFile
        elif "drive" in document:
            model = Scenario
        model.model_validate(document)


def test_paths_of_the_project_are_there(page):
    "Files that a page names are in the project"
    for name in PRINTED_PATH.findall(page.read_text()):
        assert (ROOT / name).exists(), name


@pytest.mark.parametrize("path", readability.PAGES, ids=lambda path: path.name)
def test_a_page_reads_well(path):
    "No sentence over 35 words, a Flesch reading ease of 45 or more"
    found = readability.reading(readability.text_of(path))
    assert len(readability.words_of(found.longest)) <= readability.LONGEST, found.longest
    assert found.ease >= readability.EASE
    assert found.words <= FIVE_MINUTES


@pytest.mark.parametrize("path", PAGES, ids=NAMES)
def test_a_page_opens_with_a_picture(path):
    "Above the first heading below the title"
    assert "![" in path.read_text().split("\n## ")[0]


def test_the_reading_ease_is_that_of_flesch():
    "The cat sat on the mat: six words of a syllable, 116 as published; code and tables count not"
    easy = readability.reading("# Title\n\nThe cat sat on the mat.\n\n| a | table |\n")
    assert easy.words == 6
    assert easy.ease == pytest.approx(116.1, abs=0.1)
    hard = readability.reading("Collocation estimates parameters, `--order` included.\n")
    assert hard.ease < 0
    assert readability.reading("It is held.\n").private[0][:2] == (1, "held")


def test_the_readme_is_short_and_leads_to_every_page():
    "Under 120 lines, with a link to each page of the docs"
    readme = PAGES[0].read_text()
    assert len(readme.splitlines()) < 120
    text = "".join(page.read_text() for page in PAGES)
    for name in NAMES[1:]:
        assert name in text


def test_names_of_the_package_are_there(page):
    "Every mlscorr.room.function on a page can be imported"
    for name in re.findall(r"`(mlscorr\.[a-z_.]+)`", page.read_text()):
        resolve_name(name)


@pytest.mark.parametrize("name", ["tutorial", "own-effect", "targets", "api"])
def test_python_of_the_manual_runs(name, street, tmp_path, monkeypatch):
    "The blocks of a page run one after the other beside a survey.toml"
    monkeypatch.chdir(shutil.copytree(street, tmp_path / "street"))
    monkeypatch.setattr(catalogue, "_registered", {})
    text = (ROOT / "docs" / f"{name}.md").read_text()
    exec("\n".join(re.findall(r"```python\n(.*?)```", text, flags=re.S)), {"__name__": name})


def test_the_index_leads_to_every_page():
    "Each page of docs/ stands once in the contents, which the manual is ordered by"
    index = (ROOT / "docs" / "index.md").read_text()
    pages = [path.name for end in ("md", "ipynb") for path in (ROOT / "docs").glob(f"*.{end}")]
    for name in {*pages} - {"index.md"}:
        assert index.count(f"]({name})") == 1, name


@pytest.mark.parametrize("name", ["notebook-correct", "notebook-diagnose"])
def test_a_notebook_holds_no_results(name):
    "Its outputs are made while the manual is built, and are nobody's data"
    notebook = json.loads((ROOT / "docs" / f"{name}.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert cells and not any(cell["outputs"] or cell["execution_count"] for cell in cells)


def test_the_api_page_has_every_name():
    "All that import mlscorr offers"
    names = re.findall(r"auto(?:function|class):: (\w+)", (ROOT / "docs" / "api.md").read_text())
    assert {name for name in mlscorr.__all__ if hasattr(mlscorr, name)} <= set(names)


def test_no_property_of_the_api_page_opens_with_a_colon():
    "The parser of docstrings takes what stands before it for the property's type"
    text = (ROOT / "docs" / "api.md").read_text()
    room = "mlscorr"
    for directive, name in re.findall(r"\.\. (currentmodule|autoclass):: (\S+)", text):
        if directive == "currentmodule":
            room = name
            continue
        for base in resolve_name(f"{room}:{name}").__mro__[:-1]:
            for attribute, value in vars(base).items():
                function = getattr(value, "fget", None) or getattr(value, "func", None)
                if function is not None and function.__doc__ and not attribute.startswith("_"):
                    first = function.__doc__.strip().splitlines()[0]
                    assert ":" not in first, f"{name}.{attribute}: {first}"


def test_every_effect_is_listed_with_its_unit_and_usual_size():
    "docs/effects.md states what the library does"
    text = (ROOT / "docs" / "effects.md").read_text()
    for kind in known_effects():
        (row,) = re.findall(rf"(?m)^\| `{kind.name}` \| (.*) \|$", text)
        magnitude = kind.quantities()["magnitude"]
        assert row.startswith(kind.meaning)
        assert f"`magnitude` ({magnitude.unit})" in row and row.endswith(f"{magnitude.typical:g}")
        assert all(f"`{name}`" in row for name in kind.circumstances())


def keys_of(model):
    "Names of the keys of a section of survey.toml, and of those in it"
    for name, field in model.model_fields.items():
        yield name
        waiting = [field.annotation]
        for annotation in waiting:
            waiting += get_args(annotation)
            if isinstance(annotation, type) and issubclass(annotation, BaseModel):
                yield from keys_of(annotation)


@pytest.mark.parametrize(("name", "model"), [("survey", SurveyFile), ("scenarios", Scenario)])
def test_every_key_of_a_file_is_explained(name, model):
    "docs/survey.md knows what survey.toml may hold, docs/scenarios.md what a scenario"
    words = set(re.findall(r"\w+", (ROOT / "docs" / f"{name}.md").read_text()))
    assert not set(keys_of(model)) - words

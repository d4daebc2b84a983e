"""The pages of a diagnosis and of a plan: they say what their documents say, and need no other."""

import json
import re
from html import escape, unescape
from html.parser import HTMLParser

import pytest

from mlscorr.report.gap import diagnosis_page, plan_page
from mlscorr.report.gap._verdict import advice, facts, smallest, verdict
from mlscorr.wording import number, signed
from tests.beds.browser import browse, need_browser
from tests.beds.gap_documents import KINDS, gap_document, plan_document

DRAWN = ("effect", "none", "alike", "bump", "too little")  # a page takes a second
ALONE = {"meta", "img", "br", "input"}  # tags that are not closed


def words(html):
    "The page's text without its style and scripts, one space between words"
    html = re.sub(r"<(style|script)\b.*?</\1>", "", html, flags=re.S)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def first_screen(page):
    "Contents above the links to the sections"
    return words(page.partition("<nav")[0])


class Structure(HTMLParser):
    "Tags, links and ids; every tag must be closed in its order"

    def __init__(self, html):
        super().__init__()
        self.open, self.tags, self.links, self.ids, self.images = [], set(), [], [], []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        attributes = dict(attributes)
        self.links += [attributes[k] for k in ("src", "href", "srcset", "data") if k in attributes]
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag == "img":
            self.images.append(attributes)
        if tag not in ALONE:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def pages():
    "The pages of several kinds of verdict, and of a plan"
    made = {kind: diagnosis_page(KINDS[kind](), "street").html() for kind in DRAWN}
    return made | {"plan": plan_page(plan_document(), "street").html()}


@pytest.mark.parametrize("kind", DRAWN)
def test_the_first_screen_shows_all_of_it(pages, kind):
    "Every sentence of verdict, facts and advice stands above the links to the sections"
    document = KINDS[kind]()
    text = first_screen(pages[kind])
    shown = [verdict(document).kicker, *verdict(document).sentences, *advice(document)[1]]
    shown += [text for one in facts(document) for text in one]
    shown += document["warnings"]
    assert [sentence for sentence in shown if " ".join(sentence.split()) not in text] == []


def test_a_clean_survey_says_what_it_could_have_shown(pages):
    "The smallest detectable size of each effect, by its worst part, in a unit that suits"
    document = KINDS["none"]()
    text = first_screen(pages["none"])
    detectable = document["separability"]["detectable"]
    assert detectable["time_offset"][0]["detectable"] == 0.0012
    assert "Scanner clock offset 1.2 ms" in text and "Lever arm 13 mm" in text
    for effect, size in smallest(detectable):
        assert f"{effect} {size}" in text


@pytest.mark.parametrize("kind", [*DRAWN, "plan"])
def test_the_page_is_well_formed_and_needs_nothing_but_itself(pages, kind):
    "Tags closed, each id once, pictures with words inside the file, no address outside, < 5 MB"
    page = pages[kind]
    found = Structure(page)
    inside = [link for link in found.links if link.startswith("#")]
    others = [link for link in found.links if link not in inside]
    assert all(link.startswith("data:image/svg+xml;base64,") for link in others)
    assert inside and {link[1:] for link in inside} <= set(found.ids)
    assert len(found.ids) == len(set(found.ids))
    assert all(len(image["alt"]) > 20 for image in found.images)
    assert not found.tags & {"link", "iframe", "object"}
    assert "@import" not in page and "url(" not in page and "http" not in words(page)
    assert "default-src 'none'; img-src data:;" in page
    assert len(page) < 5e6


def test_what_was_not_determined_is_a_dash(pages):
    "None and NaN are shown as a dash, wherever they stand"
    assert [signed(value) for value in (None, float("nan"))] == ["–", "–"]
    row = r'<tr class="verdict-row">(?:(?!</tr>).)*height.*?</tr>'
    row = re.search(row, pages["bump"], re.S)[0]
    assert words(row) == "Temporary GNSS error 88 % 12.3 height – – – m"
    for kind, page in pages.items():
        assert not re.search(r"\b(None|nan|NaN|null)\b", words(page)), kind


def test_every_number_of_the_causes_stands_in_the_table(pages):
    "Estimate, sigma and detectable size in the unit that suits"
    text = words(pages["effect"])
    assert "Scanner clock offset 98.2 % 12.3 magnitude -4.53 0.527 2.18 ms" in text
    assert "12.3 right -93.2 4.10 16.3 mm" in text


def test_the_gap_by_covariate_stands_in_the_table(pages):
    "Each bin with its rows, gap before and after, share and null band"
    text = words(pages["effect"])
    for split in gap_document()["where"]:
        numbers = zip(split["before"], split["after"], strict=True)
        for pair in numbers:
            assert f"100 {' '.join(number(value, 1) for value in pair)} " in text


def test_what_was_left_out_and_warned_of_reaches_the_page(pages):
    "Warnings, channels with rows, effects left out with the reason, the lead, next data"
    text = words(pages["effect"])
    expected = [
        "No plane was scanned twice.",
        "Roughness 961 residuals",
        "Targets 48 residuals",
        "0.97 0.31",
    ]
    expected += ["Wide beam No residual of this survey depends on it.", "mlscorr 0.1.0"]
    expected += ["Lever arm and vertical datum are not separable", "Each of 4 blocks of 25 s"]
    assert [piece for piece in expected if piece not in text] == []


@pytest.mark.long
def test_many_rows_make_no_large_page_and_names_are_shown_and_not_run():
    "20 000 rows stay below 5 MB: their marks are a picture; a name that holds HTML is text"
    name = '<img src=x onerror="alert(1)">&$_{'
    document = gap_document(rows=20_000, advice=["<b>look</b>"], warnings=[name])
    document["map"]["targets"][0]["name"] = name
    page = diagnosis_page(document, name).html()
    assert name not in page and escape(name, quote=False).partition('"')[0] in page
    assert "&lt;b&gt;look" in page
    assert len(page) < 5e6


def test_a_plan_says_what_it_can_see(pages):
    "Smallest and usual size of each parameter, and whether it shows, in words"
    text = words(pages["plan"])
    first = "4 types of error would be detectable at the usual size, 4 would not."
    expected = [first, "Scanner clock offset magnitude 1.20 8.10 ms yes"]
    expected += ["Vertical datum magnitude 14.4 8.10 mm only from 1.8 times the usual size"]
    expected += ["Scanner clock drift magnitude 2400 – ppm –"]
    expected += ["Measure the same road at twice the speed.", "lever arm and vertical datum"]
    assert [piece for piece in expected if piece not in text] == []


WRAPPER = """<!DOCTYPE html><meta charset="utf-8"><pre id="result">not run</pre>
<script>
const wait = time => new Promise(done => setTimeout(done, time));
async function examine(name, width) {
  const frame = document.createElement("iframe");
  frame.style = `width: ${width}px; height: 800px; border: 0`;
  frame.src = name;
  const loaded = new Promise(done => { frame.onload = done; });
  document.body.append(frame);
  await loaded;
  await wait(100);
  const page = frame.contentDocument, view = frame.contentWindow, found = {};
  const over = () => page.documentElement.scrollWidth - page.documentElement.clientWidth;
  found.overflow = [over()];
  const bottom = name => page.querySelector(name)?.getBoundingClientRect().bottom ?? 0;
  found.bottom = Math.max(bottom(".answer"), bottom(".told"), bottom(".now"), bottom(".smallest"));
  for (const part of page.querySelectorAll("details")) part.open = true;
  found.overflow.push(over());
  const walker = page.createTreeWalker(page.body, view.NodeFilter.SHOW_TEXT);
  found.smallestLetter = 99;
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (walker.currentNode.data.trim() && parent.getClientRects().length)
      found.smallestLetter = Math.min(
        found.smallestLetter, parseFloat(view.getComputedStyle(parent).fontSize));
  }
  found.loaded = [...page.images].every(image => image.complete && image.naturalWidth > 0);
  const table = page.querySelector("table.sortable"), heading = table.querySelector(
    "th[data-column='3']");
  heading.querySelector("button").click();
  found.sorted = [...table.tBodies[0].rows].map(row => parseFloat(row.cells[3].textContent));
  found.requests = view.performance.getEntriesByType("resource").map(entry => entry.name);
  return found;
}
async function run() {
  const found = {};
  for (const [name, width] of PAGES) found[`${name} ${width}`] = await examine(name, width);
  return found;
}
"""
SEEN = [("effect", 400), ("effect", 1280), ("none", 1280), ("alike", 1280), ("plan", 400)]
SEEN += [("bump", 1600), ("plan", 1600)]


@pytest.fixture(scope="module")
def opened(pages, tmp_path_factory):
    "Findings of Chromium in the pages: (results by page and width, lines of its console)"
    need_browser()
    folder = tmp_path_factory.mktemp("browser")
    for kind in {kind for kind, _ in SEEN}:
        (folder / f"{kind}.html").write_text(pages[kind], encoding="utf-8")
    frames = json.dumps([(f"{kind}.html", width) for kind, width in SEEN])
    text, console = browse(folder, WRAPPER.replace("PAGES", frames))
    return json.loads(text), console


@pytest.mark.long
def test_the_pages_fit_phone_and_desk(opened):
    "No page is wider than its screen, letters are 12 px at least, nothing is requested"
    assert opened[1] == []
    assert len(opened[0]) == len(SEEN)
    for name, found in opened[0].items():
        assert max(found["overflow"]) <= 0, name
        assert found["smallestLetter"] >= 12.0, name
        assert found["loaded"], name
        assert [one for one in found["requests"] if not one.startswith("data:")] == [], name


@pytest.mark.long
def test_the_first_screen_needs_no_scrolling(opened):
    "At 1280 x 800 verdict, certainty, shrinking, advice and smallest sizes all are in sight"
    for name, found in opened[0].items():
        if name.endswith("1280"):
            assert 0 < found["bottom"] <= 800, name


@pytest.mark.long
def test_a_table_sorts_by_the_heading_that_is_pressed(opened):
    "Rising by the gap before"
    values = opened[0]["effect.html 1280"]["sorted"]
    assert len(values) == 12
    assert values == sorted(values)


@pytest.mark.long
def test_the_plan_says_whether_an_addition_is_needed_or_helps():
    """Two effects that look alike need one: where none is offered, those that were tried failed."""
    needed = plan_document(next_data=[])
    said = words(plan_page(needed, "street").html())
    assert "None of the additions tested would separate these much better" in said
    assert "No addition is needed" not in said
    said = words(plan_page(needed | {"classes": []}, "street").html())
    assert "No addition is needed: the remaining causes are separable." in said
    assert "None of the additions" not in said
    open_pair = KINDS["alike"]() | {"next_data": []}
    said = words(diagnosis_page(open_pair, "street").html())
    assert "much better: lever arm and vertical datum." in said

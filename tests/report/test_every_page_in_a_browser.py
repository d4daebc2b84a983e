"""Every kind of page, as a phone, a desk, a wide screen, a dark screen and a printer show it."""

import json

import pytest

from mlscorr.report import calibration_page, write_comparison
from mlscorr.report.gap import diagnosis_page, plan_page
from tests.beds.browser import browse, need_browser, print_glyphs
from tests.beds.gap_documents import KINDS, plan_document
from tests.beds.reports import drive, fabricate, page
from tests.report.test_calibration_page import calibrated, calibrated_together
from tests.report.test_comparison_page import fake

pytestmark = pytest.mark.long

PAPER = {"compare": 1031}  # px: A4 lying, without its margins; the others stand
UPRIGHT = 688  # px, so too
FRAMES = [("400", 400), ("1000", 1000), ("1600", 1600), ("dark", 1000), ("print", UPRIGHT)]

WRAPPER = """<!DOCTYPE html><meta charset="utf-8"><pre id="result">not run</pre>
<script>
const wait = time => new Promise(done => setTimeout(done, time));

function asPrinted(page) { // rules for paper hold, rules for screens don't
  for (const sheet of page.styleSheets) for (const rule of sheet.cssRules) {
    if (!rule.media) continue;
    const text = rule.media.mediaText;
    if (/print/.test(text)) rule.media.mediaText = "all";
    else if (/screen/.test(text)) rule.media.mediaText = "not all";
  }
}

const channels = text => (text.match(/[\\d.]+/g) || []).map(Number);
function over(colour, below) { // a colour laid over an opaque one
  const [r, g, b, a = 1] = channels(colour);
  return [r, g, b].map((value, k) => a * value + (1 - a) * below[k]);
}
function luminance(colour) {
  const linear = v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const [r, g, b] = colour.map(value => linear(value / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function contrast(view, element) { // WCAG 2.2, 1.4.3
  const line = [];
  for (let e = element; e; e = e.parentElement) line.unshift(view.getComputedStyle(e));
  let ground = [255, 255, 255];
  for (const style of line) ground = over(style.backgroundColor, ground);
  const own = line.at(-1), size = parseFloat(own.fontSize);
  const both = [over(own.color, ground), ground].map(luminance);
  const isLarge = size >= 24 || (size >= 18.66 && own.fontWeight >= 700);
  return (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05) / (isLarge ? 3 : 4.5);
}

async function examine(name, label, width) {
  const frame = document.createElement("iframe");
  frame.style = `width: ${width}px; height: 900px; border: 0; color-scheme: light`;
  if (label === "dark") frame.style.colorScheme = "dark";
  const request = new XMLHttpRequest();
  request.open("GET", `${name}.html`, false); request.send();
  frame.srcdoc = request.responseText;
  const loaded = new Promise(done => { frame.onload = done; });
  document.body.append(frame); await loaded;
  const page = frame.contentDocument, view = frame.contentWindow, found = {};
  for (const part of page.querySelectorAll("details")) part.open = true;
  await wait(200);
  if (label === "print") { asPrinted(page); view.dispatchEvent(new view.Event("beforeprint")); }
  await wait(50);
  found.ground = view.getComputedStyle(page.body).backgroundColor;
  found.overflow = page.documentElement.scrollWidth - page.documentElement.clientWidth;
  const place = element => element.getBoundingClientRect();
  found.cut = [...page.querySelectorAll("table")]
    .map(table => [table, place(table).right - place(table.parentElement).right])
    .filter(([table, beyond]) => table.getClientRects().length && beyond > 1)
    .map(([table, beyond]) => [table.textContent.trim().slice(0, 60), beyond]);
  found.faint = []; found.small = [];
  found.loaded = [...page.images].every(image => image.complete && image.naturalWidth > 0);
  const walker = page.createTreeWalker(page.body, view.NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement, text = walker.currentNode.data.trim();
    if (!text || !parent.getClientRects().length || parent.closest("script")) continue;
    const ratio = width === 1000 ? contrast(view, parent) : 1; // widths have the same colours
    if (ratio < 1) found.faint.push([text.slice(0, 40), ratio]);
    const size = parseFloat(view.getComputedStyle(parent).fontSize);
    if (size < 12) found.small.push(text.slice(0, 40));
  }
  frame.remove();
  return found;
}

async function run() {
  const results = {};
  for (const [name, label, width] of FRAMES)
    results[`${name} ${label}`] = await examine(name, label, width);
  return results;
}
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    "Paths of a page of each kind, in one folder"
    need_browser()
    folder = tmp_path_factory.mktemp("pages")
    content = calibrated(determined=False)
    write_comparison(folder / "compare.html", fake({"raw": 0.5, "shift": 0.2, "lsc": None}))
    htmls = {
        "correct": page(folder, *fabricate(drive(), 24)),
        "calibrate": calibration_page({"name": "site", **content}).html(),
        "scanners": calibration_page({"name": "site", **calibrated_together()}).html(),
        "diagnose": diagnosis_page(KINDS["effect"](), "street").html(),
        "plan": plan_page(plan_document(), "street").html(),
    }
    for name, html in htmls.items():
        (folder / f"{name}.html").write_text(html, encoding="utf-8")
    return [folder / f"{name}.html" for name in (*htmls, "compare")]


@pytest.fixture(scope="module")
def opened(pages):
    "Findings of Chromium in every page: (results by page and frame, lines of its console)"
    frames = [
        (path.stem, label, PAPER.get(path.stem, width) if label == "print" else width)
        for path in pages
        for label, width in FRAMES
    ]
    wrapper = WRAPPER.replace("of FRAMES", f"of {json.dumps(frames)}")
    text, console = browse(pages[0].parent, wrapper)
    return json.loads(text), console


def test_no_page_is_wider_than_its_screen_and_no_table_hides_a_column(opened):
    "Nor is a table cut on paper; the console stays empty"
    results, console = opened
    assert console == []
    assert {
        name: found["overflow"] for name, found in results.items() if found["overflow"] > 0
    } == {}
    assert {name: found["cut"] for name, found in results.items() if found["cut"]} == {}
    assert all(found["loaded"] for found in results.values())


def test_letters_stand_out_by_day_and_by_night(opened):
    "Contrast AA everywhere, letters of 12 px on screens; a dark screen has a dark page"
    results = opened[0]
    assert {name: found["faint"] for name, found in results.items() if found["faint"]} == {}
    small = {n: f["small"] for n, f in results.items() if f["small"] and not n.endswith("print")}
    assert small == {}
    for name, found in results.items():
        assert (found["ground"] != "rgb(255, 255, 255)") == name.endswith("dark"), name


def test_the_first_sheet_of_paper_holds_the_answer(pages):
    "More than title and date, which some 100 glyphs are"
    for path in pages:
        assert print_glyphs(path)[0] > 400, path.name

"""The report's page as a browser runs it: headless Chromium opens it, clicks and looks."""

import json
import re
import shutil

import numpy as np
import pytest

from tests.beds.browser import browse, need_browser

pytestmark = pytest.mark.long

# two frames: a phone with WebGL, and a wide screen without it
WRAPPER = """<!DOCTYPE html><meta charset="utf-8"><pre id="result">not run</pre>
<script>
const wait = time => new Promise(done => setTimeout(done, time));
// Chromium's virtual time, which makes the test quick, paints one frame only
const frames = `requestAnimationFrame = act => setTimeout(() => act(performance.now()), 16);`;
const lacking = `const plain = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function(kind, ...more) {
  return kind.startsWith("webgl") ? null : plain.call(this, kind, ...more); };`;

async function examine(frame) {
  const page = frame.contentDocument, view = frame.contentWindow, found = {};
  const send = (element, name) => element.dispatchEvent(new view.Event(name, { bubbles: true }));
  found.overflow = page.documentElement.scrollWidth - page.documentElement.clientWidth;
  for (const part of page.querySelectorAll("details")) part.open = true;
  found.overflowOpen = page.documentElement.scrollWidth - page.documentElement.clientWidth;
  const walker = page.createTreeWalker(page.body, view.NodeFilter.SHOW_TEXT);
  let smallest = 99;
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (walker.currentNode.data.trim() && parent.getClientRects().length)
      smallest = Math.min(smallest, parseFloat(view.getComputedStyle(parent).fontSize));
  }
  found.smallestLetter = smallest;

  const table = page.querySelector("table.sortable"), body = table.tBodies[0];
  const heading = [...table.querySelectorAll("th[data-column]")].filter(
    cell => cell.textContent === "3D")[0];
  const column = () => [...body.rows].slice(1).map(
    row => parseFloat(row.cells[heading.dataset.column].textContent));
  found.sorted = [];
  for (let k = 0; k < 2; k++) {
    heading.querySelector("button").click();
    found.sorted.push([heading.getAttribute("aria-sort"), column()]);
  }
  found.head = body.rows[0].textContent.trim();

  const pairs = [...page.querySelectorAll(".pair")], clips = pair => ["before", "after"].map(
    side => view.getComputedStyle(pair.querySelector(`.${side} img`)).clipPath);
  found.pictures = pairs.length;
  found.loaded = [...page.images].every(image => image.complete && image.naturalWidth > 0);
  pairs[0].querySelector("input").value = 30;
  send(pairs[0].querySelector("input"), "input");
  found.slid = clips(pairs[0]);
  page.getElementById("all").value = 75;
  send(page.getElementById("all"), "input");
  found.allSlid = pairs.slice(-2).map(clips);

  const stage = page.querySelector(".stage"), marks = stage.querySelector(".marks");
  const choice = page.querySelector(".turn select");
  const looks = [];
  const look = async () => { // what is drawn next
    for (let k = 0; k < 50; k++) {
      const now = marks.toDataURL();
      if (stage.dataset.drawn && now !== looks.at(-1)) return looks.push(now);
      await wait(100);
    }
  };
  await look();
  found.drawnBy = stage.dataset.drawn;
  found.choices = choice.options.length;
  const pointer = (name, x) => stage.dispatchEvent(new view.PointerEvent(
    name, { pointerId: 1, clientX: x, clientY: 100, buttons: 1, bubbles: true }));
  stage.setPointerCapture = () => {};
  pointer("pointerdown", 100); pointer("pointermove", 180); pointer("pointerup", 180);
  await look();
  choice.selectedIndex = 1;
  send(choice, "change");
  await look();
  const after = page.querySelector('.turn input[name=state][value="1"]');
  after.checked = true;
  send(after, "change");
  for (let k = 0; k < 50 && stage.dataset.share !== "1"; k++) await wait(100);
  found.share = stage.dataset.share;
  await look();
  stage.dispatchEvent(new view.KeyboardEvent("keydown", { key: "+" }));
  await look();
  found.looks = new Set(looks).size;
  stage.dispatchEvent(new view.KeyboardEvent("keydown", { key: "Home" }));
  await look();
  const pen = stage.querySelector(".points").getContext("2d");
  if (pen) { // the points that our own z-buffer drew
    const { width, height } = pen.canvas, { data } = pen.getImageData(0, 0, width, height);
    found.dark = data.filter((value, k) => k % 4 === 0 && value < 250).length;
    const dark = (k) => data[4 * k] < 250;
    const count = (length, isIn) => { // of points in each row or column
      const number = new Array(length).fill(0);
      for (let k = 0; k < width * height; k++) if (dark(k)) number[isIn(k)]++;
      return number;
    };
    found.rows = count(height, k => Math.floor(k / width));
    found.columns = count(width, k => k % width);
  }
  found.requests = view.performance.getEntriesByType("resource").map(entry => entry.name);
  return found;
}

async function open(width, page, script) {
  const frame = document.createElement("iframe");
  frame.style = `width: ${width}px; height: 900px; border: 0`;
  frame.srcdoc = page.replace("<head>", "<head><script>" + script + "<" + "/script>");
  const loaded = new Promise(done => { frame.onload = done; });
  document.body.append(frame);
  await loaded;
  await wait(200);
  return examine(frame);
}

async function run() {
  const request = new XMLHttpRequest();
  request.open("GET", "report.html", false);
  request.send();
  return {
    narrow: await open(400, request.responseText, frames),
    wide: await open(1600, request.responseText, frames + lacking),
  };
}
"""


@pytest.fixture(scope="module")
def opened(commanded, tmp_path_factory):
    "Findings of Chromium in the report: (results by frame, lines of its console, report)"
    need_browser()
    folder = tmp_path_factory.mktemp("browser")
    shutil.copy(commanded[1] / "report.html", folder)
    text, console = browse(folder, WRAPPER)
    report = json.loads((commanded[1] / "report.json").read_text(encoding="utf-8"))
    return json.loads(text), console, report


@pytest.fixture(params=["narrow", "wide"])
def frame(request, opened):
    "Findings at 400 px and at 1600 px width"
    return opened[0][request.param]


def test_the_console_stays_empty_and_nothing_is_requested(opened):
    "No error, no warning, and no address but the page's own data"
    assert opened[1] == []
    for found in opened[0].values():
        assert [name for name in found["requests"] if not name.startswith("data:")] == []


def test_the_page_fits_its_width_in_letters_that_can_be_read(frame):
    "Nothing makes the page wider than the screen, and no letter is smaller than 12 px"
    assert frame["overflow"] <= 0 and frame["overflowOpen"] <= 0
    assert frame["smallestLetter"] >= 12.0
    assert frame["loaded"]


def test_a_table_sorts_by_the_heading_that_is_pressed(frame, opened):
    "Rising, then falling, within its group of rows, whose head stays on top"
    (up, rising), (down, falling) = frame["sorted"]
    used = [row for row in opened[2]["targets"] if row["used"]]
    assert (up, down) == ("ascending", "descending")
    assert len(rising) == len(used) > 2
    assert rising == sorted(rising) and falling == sorted(falling, reverse=True)
    assert frame["head"] == "Control points"


def test_the_handle_of_a_picture_moves_the_line(frame, opened):
    "Left of 30 % is before, right of it is after; one handle moves all close-ups"
    seen = {row["name"] for row in opened[2]["targets"] if row["observed"]}
    assert frame["pictures"] >= 1 + len(seen)
    before, after = frame["slid"]
    assert re.fullmatch(r"inset\(0px calc\(70%\) 0px 0px\)|inset\(0px 70% 0px 0px\)", before)
    assert re.fullmatch(r"inset\(0px 0px 0px calc\(30%\)\)|inset\(0px 0px 0px 30%\)", after)
    assert all("75%" in before and "25%" in after for before, after in frame["allSlid"])


def test_the_cloud_can_be_turned_with_and_without_webgl(opened):
    "Dragging, going to a target, before to after and zooming each change the view"
    for found, drawn_by in ((opened[0]["narrow"], "webgl"), (opened[0]["wide"], "canvas")):
        assert found["drawnBy"] == drawn_by
        assert found["share"] == "1"
        assert found["looks"] == 5
        assert found["choices"] == 1 + len({row["name"] for row in opened[2]["targets"]})
    assert opened[0]["wide"]["dark"] > 500  # pixels of points


def test_the_whole_survey_is_whole_in_the_picture(opened):
    "The Home key shows the cloud: hardly a point touches an edge, and it fills height or width"
    rows, columns = (np.array(opened[0]["wide"][name]) for name in ("rows", "columns"))
    assert rows[0] + rows[-1] + columns[0] + columns[-1] < 1e-4 * rows.sum()
    assert max(np.mean(rows > 0), np.mean(columns > 0)) > 0.7

"""Clouds and results shown together: what is listed, where it lies, and the page in a browser."""

import json
import re

import numpy as np
import open3d as o3d
import pytest

import mlscorr
from mlscorr.correction import Correction
from mlscorr.survey import PointCloud
from tests.beds.browser import browse, need_browser
from tests.beds.drives import CORNER, cloud_of, drive, with_errors
from tests.beds.street_of_points import unpacked


@pytest.fixture(scope="module")
def correction():
    "Of a winding drive of 200 m, up to decimeters"
    recorded = drive()
    return Correction(recorded, with_errors(recorded))


@pytest.fixture(scope="module")
def cloud(correction):
    "20 000 points about it, brighter from point to point"
    plain = cloud_of(correction.recorded)
    return PointCloud(plain.xyz, plain.gps_time, np.arange(len(plain)) % 5000)


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    "As on a server"
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


def read(path):
    "Contents of a page: pairs (name, words), its layers, its origin (m), its text"
    text = path.read_text(encoding="utf-8")
    scene = json.loads(re.search(r'id="scene">(.*?)</script>', text, re.S)[1])
    entries = re.findall(r"<b>(.*?)</b> <span>(.*?)</span>", text)
    words = re.search(r"Map axes relative to (\d+) E, (\d+) N, (-?\d+) H", text)
    origin = np.array([float(word) for word in words.groups()])
    return entries, scene["layers"], origin, text


def places(layer, origin):
    "Positions of the points of a layer on the map (n, 3), in m"
    return unpacked(layer["places"]).reshape(-1, 3) + origin


def test_a_pair_lies_where_it_was_and_where_it_was_moved_to(correction, cloud, tmp_path):
    "The same points of both states are shown, each within 0.1 mm of its place in the map"
    path = mlscorr.show(correction.before_after(cloud), page=tmp_path / "pair.html")
    entries, layers, origin, _ = read(path)
    assert [name for name, _ in entries] == ["before", "after"]
    before, after = (places(layer, origin) for layer in layers)
    assert np.abs(before - cloud.xyz).max() < 1e-4
    assert np.abs(after - correction.apply(cloud).xyz).max() < 1e-4


def test_clouds_are_thinned_evenly_and_the_page_says_to_what(cloud, tmp_path):
    "1 000 of two clouds of 20 000 points: each keeps at most 500, all over its extent"
    other = PointCloud(cloud.xyz + 0.1, cloud.gps_time + 1.0, cloud.intensity)
    path = mlscorr.show(cloud, other, page=tmp_path / "thin.html", points=1000)
    entries, layers, origin, text = read(path)
    for layer, (name, words) in zip(layers, entries, strict=True):
        shown = places(layer, origin)
        assert 150 < len(shown) <= 500
        assert name.startswith("Point cloud") and f"{len(shown)} of 20 000 points" in words
        assert (np.ptp(shown, axis=0) > 0.9 * np.ptp(cloud.xyz, axis=0)).all()
    total = sum(len(places(layer, origin)) for layer in layers)
    assert re.search(rf"{total:,} of 40,000 points".replace(",", " ?"), text)


def test_lines_are_whole_and_tell_their_colors(correction, tmp_path):
    "A trajectory of 4 000 epochs keeps all of its lines, though clouds may have one point only"
    recorded = correction.recorded
    lines = recorded.to_open3d()
    colors = np.zeros((3999, 3))
    colors[:, 0] = np.linspace(0.0, 1.0, 3999)
    lines.line["colors"] = colors
    path = mlscorr.show(recorded, red=lines, page=tmp_path / "lines.html", points=1)
    entries, layers, origin, _ = read(path)
    assert [name for name, _ in entries] == ["Trajectory", "red"]
    for layer in layers:
        assert np.abs(places(layer, origin) - recorded.position).max() < 1e-4
        pairs = unpacked(layer["pairs"], "<u4").reshape(-1, 2)
        assert np.array_equal(pairs, recorded.line_pairs)
    red = unpacked(layers[1]["colours"], "u1").reshape(-1, 3)
    assert np.abs(red[:, 0] / 255 - colors[:, 0]).max() < 0.003 and not red[:, 1:].any()


def test_everything_that_goes_to_open3d_can_be_shown(correction, cloud, tmp_path):
    "Tensor and legacy geometries about origins of their own, and dicts of them, lie together"
    origin = CORNER + np.array([0.0, 300.0, 0.0])
    geometry = cloud.to_open3d(origin)
    legacy = cloud.to_open3d(np.zeros(3)).to_legacy()
    path = mlscorr.show(
        geometry,
        {"of old": legacy, "nested": {"path": correction.recorded}},
        page=tmp_path / "all.html",
    )
    entries, layers, place, _ = read(path)
    assert [name for name, _ in entries] == ["Point cloud", "of old", "nested: path"]
    for layer in layers[:2]:
        assert np.abs(places(layer, place) - cloud.xyz).max() < 1e-4
    assert np.abs(places(layers[2], place) - correction.recorded.position).max() < 1e-4


def test_points_are_colored_by_colors_else_intensity_else_in_one(cloud, tmp_path):
    "Colors of LAS files with 16 bits too; a cloud without either has one color, unlike the next"
    rgb = np.tile(np.array([65_535, 256, 0], np.uint16), (len(cloud), 1))
    dull = PointCloud(cloud.xyz, cloud.gps_time, np.zeros(len(cloud)))
    painted = PointCloud(cloud.xyz, cloud.gps_time, cloud.intensity, {"colors": rgb})
    path = mlscorr.show(painted, cloud, dull, dull, page=tmp_path / "colors.html")
    entries, layers, *_ = read(path)
    assert [words.partition(", ")[2] for _, words in entries] == [
        "own colors",
        "colored by intensity",
        "",
        "",
    ]
    shades = [unpacked(layer["colours"], "u1").reshape(-1, 3) for layer in layers]
    assert (shades[0] == [255, 1, 0]).all()
    assert len(np.unique(shades[1], axis=0)) > 200
    one, other = (np.unique(shade, axis=0) for shade in shades[2:])
    assert len(one) == len(other) == 1 and not np.array_equal(one, other)


def test_without_a_display_a_page_of_its_own_is_written(cloud):
    "Each call has a new one, which asks no network for anything"
    paths = [mlscorr.show(cloud, points=100) for _ in range(2)]
    assert paths[0] != paths[1]
    text = paths[0].read_text(encoding="utf-8")
    assert not re.search(r"https?:|src=|<link|@import", text)


def test_a_page_is_not_overwritten_unasked(cloud, tmp_path):
    "The second page of a name needs overwrite=True; a call that fails leaves none behind"
    path = tmp_path / "page.html"
    mlscorr.show(cloud, page=path, points=10)
    with pytest.raises(ValueError, match="overwrite=True"):
        mlscorr.show(cloud, page=path)
    mlscorr.show(cloud, page=path, points=20, overwrite=True)
    with pytest.raises(OSError, match="missing"):
        mlscorr.show(cloud, page=tmp_path / "missing" / "page.html")
    assert [entry.name for entry in tmp_path.iterdir()] == ["page.html"]


def test_names_from_users_are_text(cloud, tmp_path):
    "A name and a title with tags are shown as they are"
    path = mlscorr.show({"<b>&": cloud}, page=tmp_path / "x.html", title="<script>", points=10)
    text = path.read_text(encoding="utf-8")
    assert "&lt;b&gt;&amp;" in text and "<h1>&lt;script&gt;</h1>" in text


def test_what_cannot_be_shown_is_refused(cloud, correction, tmp_path):
    "Nothing, an empty cloud, a text, a mesh, a place that is NaN; no page is left behind"
    page = tmp_path / "none.html"
    with pytest.raises(ValueError, match="Nothing was given"):
        mlscorr.show(page=page)
    with pytest.raises(ValueError, match="empty"):
        mlscorr.show(cloud[:0], page=page)
    with pytest.raises(TypeError, match="walls: a str can't be shown"):
        mlscorr.show(walls="cloud.laz", page=page)
    with pytest.raises(TypeError, match="TriangleMesh"):
        mlscorr.show(o3d.t.geometry.TriangleMesh.create_box(), page=page)
    with pytest.raises(ValueError, match="shows nothing"):
        mlscorr.show(cloud, points=0, page=page)
    broken = cloud.xyz.copy()
    broken[3] = np.inf
    with pytest.raises(ValueError, match=r"1 of 20000 points .* point 3"):
        mlscorr.show(PointCloud(broken, cloud.gps_time, cloud.intensity), page=page)
    assert not page.exists()


def test_a_geometry_in_a_local_frame_beside_one_in_the_map_is_refused(cloud, tmp_path):
    "They lie 3 400 km apart, where float32 has no decimeters: both are named"
    local = o3d.t.geometry.PointCloud(cloud.xyz - CORNER)
    with pytest.raises(ValueError, match=r"local and street are 3\d\d\d km apart|street and local"):
        mlscorr.show(street=cloud, local=local, page=tmp_path / "far.html")


WRAPPER = """<!DOCTYPE html><meta charset="utf-8"><pre id="result">not run</pre>
<script>
const wait = time => new Promise(done => setTimeout(done, time));
const frames = `requestAnimationFrame = act => setTimeout(() => act(performance.now()), 16);`;
const lacking = `const plain = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function(kind, ...more) {
  return kind.startsWith("webgl") ? null : plain.call(this, kind, ...more); };`;

async function examine(frame) {
  const page = frame.contentDocument, view = frame.contentWindow, found = {};
  const stage = page.querySelector(".stage"), marks = stage.querySelector(".marks");
  found.overflow = page.documentElement.scrollWidth - page.documentElement.clientWidth;
  const settle = async () => { await wait(300); };
  const pixels = canvas => { // of a copy, as reading a canvas again and again slows it down
    const copy = page.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const pen = copy.getContext("2d");
    pen.drawImage(canvas, 0, 0);
    return pen.getImageData(0, 0, copy.width, copy.height).data;
  };
  const colored = canvas => { // pixels of lines, which are neither white nor grey
    const data = pixels(canvas);
    let count = 0;
    for (let k = 0; k < data.length; k += 4)
      if (data[k + 3] > 0 && Math.abs(data[k] - data[k + 2]) > 60) count++;
    return count;
  };
  await settle();
  found.drawnBy = stage.dataset.drawn;
  found.boxes = page.querySelectorAll(".layers input").length;
  found.lines = [colored(marks)];
  const points = () => {
    const data = pixels(stage.querySelector(".points"));
    return data.filter((value, k) => k % 4 === 0 && value < 250).length;
  };
  found.points = [points()];
  const looks = [marks.toDataURL()];
  const key = async (name, shift) => {
    stage.dispatchEvent(new view.KeyboardEvent("keydown", { key: name, shiftKey: !!shift }));
    await settle();
    looks.push(marks.toDataURL());
  };
  await key("2");
  found.lines.push(colored(marks));
  found.checked = [...page.querySelectorAll(".layers input")].map(box => box.checked);
  await key("2");
  const first = page.querySelector(".layers input");
  first.checked = false;
  first.dispatchEvent(new view.Event("change", { bubbles: true }));
  await settle();
  found.points.push(points());
  first.checked = true;
  first.dispatchEvent(new view.Event("change", { bubbles: true }));
  await settle();
  await key("ArrowLeft"); await key("ArrowUp", true); await key("+");
  const pointer = (name, x) => stage.dispatchEvent(new view.PointerEvent(
    name, { pointerId: 1, clientX: x, clientY: 100, buttons: 1, bubbles: true }));
  stage.setPointerCapture = () => {};
  pointer("pointerdown", 100); pointer("pointermove", 180); pointer("pointerup", 180);
  await settle();
  looks.push(marks.toDataURL());
  stage.focus();
  const nearer = { deltaY: -100, bubbles: true, cancelable: true };
  stage.dispatchEvent(new view.WheelEvent("wheel", nearer));
  await settle();
  looks.push(marks.toDataURL());
  found.looks = new Set(looks).size;
  await key("Home");
  found.home = marks.toDataURL() === looks[0];
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
  request.open("GET", "show.html", false);
  request.send();
  return {
    narrow: await open(400, request.responseText, frames),
    wide: await open(1600, request.responseText, frames + lacking),
  };
}
"""


@pytest.mark.long
def test_a_page_runs_in_a_browser_with_and_without_webgl(correction, cloud, tmp_path):
    "Check boxes and keys show and hide, mouse and keys turn, move and zoom; nothing is requested"
    need_browser()
    page = tmp_path / "show.html"
    mlscorr.show(cloud=cloud, path=correction.recorded, page=page)
    text, console = browse(tmp_path, WRAPPER)
    assert console == []
    for found, drawn_by in zip(json.loads(text).values(), ("webgl", "canvas"), strict=True):
        assert found["drawnBy"] == drawn_by
        assert found["overflow"] <= 0 and found["boxes"] == 2
        assert found["checked"] == [True, False]
        assert found["lines"][0] > 100 and found["lines"][1] == 0  # pixels of the trajectory
        assert found["looks"] == 7 and found["home"]  # all, no lines, turned, moved, three nearer
        assert [name for name in found["requests"] if not name.startswith("data:")] == []
    with_cloud, without = json.loads(text)["wide"]["points"]
    assert with_cloud > 500 and without == 0

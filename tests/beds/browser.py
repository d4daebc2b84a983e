"""Headless Chromium: what a wrapper page finds out about pages that it opens in frames."""

import re
import shutil
import subprocess
import zlib
from html import unescape

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next((path for name in NAMES if (path := shutil.which(name))), None)
ENDING = """run().then(found => JSON.stringify(found), error => "failed: " + error.stack).then(
  text => { document.getElementById("result").textContent = text; });
</script>"""
ITS_OWN = ("GL Driver Message", "software WebGL")  # what Chromium says of a machine without a GPU


def need_browser():
    "Skip with a sentence where there is none"
    if BROWSER is None:
        pytest.skip("No Chromium is installed, so the page was not opened in a browser.")


def browse(folder, wrapper):
    "Text that run() in the last script of a wrapper page returns, and the lines of the console"
    path = folder / "wrapper.html"
    path.write_text(wrapper + ENDING, encoding="utf-8")
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-background-networking",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--allow-file-access-from-files",
        f"--user-data-dir={folder / 'profile'}",
        "--window-size=1700,1000",
        "--virtual-time-budget=30000",
        "--enable-logging=stderr",
        "--dump-dom",
        path.as_uri(),
    ]
    process = subprocess.run(command, capture_output=True, text=True, timeout=600)
    text = re.search(r'<pre id="result">(.*?)</pre>', process.stdout, re.S)
    assert text, process.stderr[-2000:]
    text = unescape(text[1])
    assert text.startswith("{"), text
    console = [line for line in process.stderr.splitlines() if "CONSOLE" in line]
    return text, [line for line in console if not any(words in line for words in ITS_OWN)]


def print_glyphs(path):
    "Number of glyphs on each sheet of paper (Letter) that a page is printed on"
    target = path.with_suffix(".pdf")
    command = [BROWSER, "--headless", "--no-sandbox", "--no-pdf-header-footer"]
    profile = f"--user-data-dir={path.parent / 'profile'}"
    command += [profile, f"--print-to-pdf={target}", path.as_uri()]
    subprocess.run(command, capture_output=True, timeout=600, check=True)
    pdf = target.read_bytes()
    sheets = re.findall(rb"/Type /Page\n.*?/Contents (\d+) 0 R", pdf, re.S)
    return [_glyphs(pdf, int(number)) for number in sheets]


def _glyphs(pdf, number):
    "Number of glyphs, of four hexadecimal digits each, in a stream of a PDF"
    start = pdf.index(b"stream\n", re.search(rb"^%d 0 obj" % number, pdf, re.M).end()) + 7
    content = zlib.decompressobj().decompress(pdf[start:])
    return sum(len(text) // 4 for text in re.findall(rb"<([0-9A-F]+)> Tj", content))

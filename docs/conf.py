"""How Sphinx builds the manual: the pages of docs/ and of the project as they stand on the forge.

The root is the project's, so that links lead to the same files in both; the order of the pages is
that of the links in docs/index.md; formulas become MathML, which needs no net and no script.
"""

import logging
import os
import re
import runpy
import shutil
from importlib import metadata
from pathlib import Path

import typer.main
from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx_gallery.scrapers import figure_rst

project = "mlscorr"
author = "mlscorr's authors"
release = metadata.version("mlscorr")
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
]
root_doc = "docs/index"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "docs/**",
    "build/gallery/*.rst",
]
exclude_patterns = [".*", "assets", "benchmarks", "examples", "mlscorr*", "tests"]
exclude_patterns += ["build/manual", "build/doctrees", "build/examples", "build/surveys"]

html_theme = "furo"
html_title = "mlscorr"
html_math_renderer = "mathml"
html_copy_source = html_show_sourcelink = html_show_copyright = False
html_static_path: list[str] = []
highlight_language = "none"
copybutton_exclude = ".linenos, .gp, .go"  # prompts and what is printed

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 900  # s a cell; a fresh machine compiles first, a busy one slowly
nb_execution_raise_on_error = True
nb_output_stderr = "warn"
# a profile of its own, in which the kernel does not warn that TCP is not encrypted
PROFILE = Path(__file__).parents[1] / "build" / "ipython" / "profile_default"
PROFILE.mkdir(parents=True, exist_ok=True)
(PROFILE / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 40\n")
os.environ["IPYTHONDIR"] = str(PROFILE.parent)
logging.getLogger("traitlets").setLevel(logging.ERROR)  # dash, which open3d loads, is not there
logging.getLogger("mlscorr").propagate = False  # the log of an example goes into its log.txt alone

ROOT = Path(__file__).resolve().parents[1]

# docs/architecture.md shows the imports as they are now
ROOMS = runpy.run_path(str(ROOT / "benchmarks" / "pictures" / "rooms.py"))
ROOMS["draw"](ROOT / "assets" / "architecture.svg")


def start_example(gallery_conf, name):
    """Let an example start without the files that an earlier build left of it."""
    if name.startswith("0") or name.startswith("1"):
        shutil.rmtree(ROOT / "build" / "examples" / Path(name).stem, ignore_errors=True)


def new_pictures(block, variables, gallery_conf):
    """Show the pictures that a cell of an example has written into its folder."""
    folder = ROOT / "build" / "examples" / Path(variables["src_file"]).stem
    shown = variables.setdefault("shown_pictures", set())
    paths = []
    for picture in sorted(set(folder.glob("*.png")) - shown):
        shown.add(picture)
        paths.append(next(variables["image_path_iterator"]))
        shutil.copy(picture, paths[-1])
    return figure_rst(paths, gallery_conf["src_dir"])


sphinx_gallery_conf = {
    "examples_dirs": str(ROOT / "examples"),
    "gallery_dirs": str(ROOT / "build" / "gallery"),
    "filename_pattern": r"/\d\d_",
    "ignore_pattern": r"small_surveys\.py",
    "copyfile_regex": r"small_surveys\.py",
    "within_subsection_order": "FileNameSortKey",
    "nested_sections": False,
    "image_scrapers": (new_pictures,),
    "reset_modules": (start_example, "matplotlib"),
    "remove_config_comments": True,
    "show_signature": False,
    "show_memory": False,
    "download_all_examples": False,
    "notebook_extensions": set(),  # small_surveys is no module there
    "min_reported_time": 1e6,  # s: pages don't change with the machine
    "write_computation_times": False,
    "abort_on_example_error": True,
    "run_stale_examples": True,  # the package changes, and the examples don't
}
# functions can't be stored to notice that the configuration has changed
suppress_warnings = ["config.cache"]

autodoc_typehints = "none"  # the docstrings say them, with shapes and units
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "inherited-members": False}
napoleon_use_rtype = False

LINKS = re.compile(r"(?m)^- \[([^\]]+)\]\(([^)]+)\)|^## (.+)$")


def add_contents(app, docname, source):
    """Make the tree of pages from the headings and links of the index."""
    if docname != root_doc:
        return
    groups: list[tuple[str, list[str]]] = []
    for title, link, heading in LINKS.findall(source[0]):
        if heading:
            groups.append((heading, []))
        else:
            page = re.sub(r"\.(md|ipynb|rst)$", "", link).replace("../", "/")
            groups[-1][1].append(f"{title} <{page}>")
    for caption, pages in groups:
        lines = ["", "```{toctree}", ":hidden:", f":caption: {caption}", *pages, "```", ""]
        source[0] += "\n".join(lines)


def options_of(name, command):
    """Lines of Markdown: the options of a command, and of those within it."""
    lines = [f"### mlscorr {name}", "", "| option | meaning |", "|---|---|"]
    for one in command.params:
        if one.param_type_name == "option":
            names = ", ".join(f"`{option}`" for option in (*one.opts, *one.secondary_opts))
            meaning = " ".join((one.help or "").split()).replace("|", "\\|")
            lines.append(f"| {names} | {meaning} |")
    inner = getattr(command, "commands", {})
    if inner:
        lines = []
    for inner_name, one in inner.items():
        lines += ["", *options_of(f"{name} {inner_name}", one)]
    return lines


def add_options(app, docname, source):
    """Put the options of all commands, as --help has them, into their page."""
    if docname != "docs/options":
        return
    from mlscorr.cli import app as commands

    lines = ["## All options", ""]
    for name, command in typer.main.get_command(commands).commands.items():
        lines += [*options_of(name, command), ""]
    source[0] = source[0].replace("<!-- options -->", "\n".join(lines))


def lead_to_gallery(app, docname, source):
    """Let links to the examples lead to the pages that the build makes of them."""
    source[0] = source[0].replace("examples/README.rst", "build/gallery/index.rst")


def head_examples(app, what, name, obj, options, lines):
    """Give the examples of a docstring, which end it without a heading, one of their own."""
    first = next((i for i, line in enumerate(lines) if line.startswith(">>> ")), None)
    if first is not None and "Examples" not in lines:
        lines[first:first] = ["Examples", "--------"]


def write_math(self, node):
    """An element of MathML."""
    is_block = isinstance(node, nodes.math_block)
    math = tex2mathml(node.astext(), as_block=is_block)
    self.body.append(f'<div style="padding: 0.5em 0">{math}</div>' if is_block else math)
    raise nodes.SkipNode


def lead_to_index(app, exception):
    """Write index.html at the top, which leads to the manual's first page."""
    if exception is None:
        page = '<meta http-equiv="refresh" content="0; url=docs/index.html">\n'
        Path(app.outdir, "index.html").write_text(page, encoding="utf-8")


def setup(app):
    """Connect the above."""
    app.connect("source-read", lead_to_gallery, priority=400)  # before the contents
    app.connect("source-read", add_contents)
    app.connect("source-read", add_options)
    app.connect("autodoc-process-docstring", head_examples, priority=1)  # before napoleon
    app.connect("build-finished", lead_to_index)
    app.add_html_math_renderer("mathml", (write_math, None), (write_math, None))

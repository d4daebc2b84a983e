"""List the sentences that mlscorr shows, one a line, so that an editor can read them in one go.

    python benchmarks/sentences.py [ROOM ...]

Sentences of wording modules have real values: they are those of the catalogues in the tests. All
others are read from the source, with their placeholders in braces: errors, warnings, help of
options, other texts, and the text of the report's pages. Without a ROOM (such as io or cli) all of
them are listed, by room, kind and text.
"""

import argparse
import ast
import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

PACKAGE = ROOT / "mlscorr"
CATALOGUES = {  # room of the sentences: modules of the tests that list them
    "effects": ("tests.effects.test_wording",),
    "estimate": ("tests.estimate.test_wording",),
    "evaluate": ("tests.evaluate.test_wording",),
    "gap": ("tests.gap.test_wording",),
    "matching": ("tests.matching.test_wording",),
    "pipeline": ("tests.pipeline.test_choice_wording", "tests.pipeline.test_project_wording"),
    "report": ("tests.report.test_wording",),
}
CATALOGUED = (  # modules whose sentences the catalogues show with values
    "estimate/_wording.py",
    "evaluate/wording.py",
    "gap/wording.py",
    "matching/_wording.py",
    "pipeline/project/wording.py",
    "pipeline/wording.py",
    "report/wording.py",
)
WORDS = 3  # as many make a sentence; what is shorter is a key, a name or a unit


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="*", metavar="ROOM")
    rooms = parser.parse_args().rooms
    rows = sorted({*catalogued(), *written(), *shown_on_pages()})
    for room, kind, text in rows:
        if not rooms or room in rooms:
            print(f"{room:10} {kind:8} {text}")


def catalogued() -> Iterator[tuple[str, str, str]]:
    """Rows (room, kind, sentence with real values) of the catalogues."""
    for room, modules in CATALOGUES.items():
        for module in modules:
            for *_, sentence in importlib.import_module(module).CATALOGUE:
                yield room, "wording", sentence


def written() -> Iterator[tuple[str, str, str]]:
    """Rows (room, kind, sentence with placeholders) of the source."""
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE).as_posix()
        if name in CATALOGUED:
            continue
        room = name.split("/")[0].removesuffix(".py")
        for kind, text in texts(ast.parse(path.read_text(encoding="utf-8")), "text"):
            if is_sentence(text):
                yield room, kind, " ".join(text.split())


def is_sentence(text: str) -> bool:
    """Return True for a text with enough words besides its placeholders."""
    own = re.sub(r"{[^{}]*(?:{[^{}]*}[^{}]*)*}", " ", text)
    return len(re.findall(r"[^\W\d_]{2,}", own)) >= WORDS


def texts(node: ast.AST, kind: str) -> Iterator[tuple[str, str]]:
    """Pairs (kind, text) of the strings below a node that are no docstrings."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return
    if isinstance(node, ast.JoinedStr | ast.Constant):
        if text := template(node):
            yield kind, text
        return
    if isinstance(node, ast.Raise):
        kind = "error"
    elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("warn"):
        kind = "warning"
    elif isinstance(node, ast.keyword) and node.arg == "help":
        kind = "option"
    for child in ast.iter_child_nodes(node):
        yield from texts(child, kind)


def template(node: ast.AST) -> str:
    """The text of a string, with each expression of an f-string in braces."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    parts = []
    for part in node.values:
        if isinstance(part, ast.FormattedValue):
            parts.append(f"{{{ast.unparse(part.value)}}}")
        else:
            parts.append(template(part))
    return "".join(parts)


def shown_on_pages() -> Iterator[tuple[str, str, str]]:
    """Rows (room, kind, text) of the templates of pages."""
    for path in (PACKAGE / "report" / "page").glob("*.html"):
        text = re.sub(r"{%.*?%}|<script.*?</script>", "\n", path.read_text(), flags=re.S)
        text = re.sub(r"{{(.*?)}}", lambda field: f"{{{field[1].strip()}}}", text)
        for piece in re.split(r"<[^>]*>|\n", text):
            if is_sentence(piece):
                yield "report", "page", " ".join(piece.split())


if __name__ == "__main__":
    main()

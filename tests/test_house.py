"""Public names are documented and typed, and every test opens with a sentence.

``python tests/test_house.py`` prints figures of each room, which are no limits.
"""

import ast
import io
import tokenize
from collections import Counter
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "mlscorr"
MODULES = sorted(PACKAGE.rglob("*.py"))
SECTIONS = ("Parameters\n", "Returns\n", "Raises\n", "Yields\n", "Attributes\n")
BLANKS = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
)
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef
DEFINITIONS = ast.ClassDef | FUNCTIONS
DOCUMENTED = 0.65  # share of the public names with sections
UNANNOTATED = {"pipeline": 2, "report": 1}  # public functions without types, at most


@cache
def parsed(path):
    return ast.parse(path.read_text())


def name_of(path):
    return str(path.relative_to(ROOT))


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def docstring_lines(tree):
    "Numbers of the lines that docstrings cover"
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | DEFINITIONS) and ast.get_docstring(node) is not None:
            yield from range(node.body[0].lineno, node.body[0].end_lineno + 1)


def code_lines(path):
    "Numbers of the lines that hold code: no blank lines, comments, docstrings"
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline):
        if token.type not in BLANKS:
            lines.update(range(token.start[0], token.end[0] + 1))
    return lines - set(docstring_lines(parsed(path)))


def holds_number(value):
    "True if an expression contains a number"
    return value is not None and any(
        isinstance(node, ast.Constant) and type(node.value) in (int, float)
        for node in ast.walk(value)
    )


def numeric_constants(path):
    "Names of the module's constants and of the fields of its Settings that hold numbers"
    for node in parsed(path).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and holds_number(node.value):
            if isinstance(node, ast.Assign):
                targets = node.targets
            else:
                targets = [node.target]
            names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            if any(name.isupper() for name in names):
                yield names[0]
        elif isinstance(node, ast.ClassDef) and node.name.endswith("Settings"):
            fields = [field for field in node.body if isinstance(field, ast.AnnAssign)]
            yield from (field.target.id for field in fields if holds_number(field.value))


def public_definitions(tree):
    "Public functions and classes of a module, and the public methods of the latter"
    for node in tree.body:
        if isinstance(node, DEFINITIONS) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node)


def is_documented(node):
    return any(section in (ast.get_docstring(node) or "") for section in SECTIONS)


def is_annotated(function):
    "True if a function annotates its parameters and its result"
    a = function.args
    parameters = [*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg]
    named = [p for p in parameters if p is not None and p.arg not in ("self", "cls")]
    return function.returns is not None and all(p.annotation is not None for p in named)


def unannotated(path):
    "Public functions and methods of a module without all types"
    return [
        f"{name_of(path)}:{node.lineno} {node.name}"
        for node in public_definitions(parsed(path))
        if isinstance(node, FUNCTIONS) and not is_annotated(node)
    ]


def is_packed(node):
    "True if a statement binds several names to several expressions: a, b = x, y"
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Tuple)
        and any(isinstance(target, ast.Tuple) for target in node.targets)
    )


def is_dataclass(node):
    "True if a class is decorated as a dataclass"
    return isinstance(node, ast.ClassDef) and any(
        "dataclass" in ast.unparse(decorator) for decorator in node.decorator_list
    )


def is_past_face(node, path):
    "True if an import takes a name from a module of another room instead of from its face"
    if not isinstance(node, ast.ImportFrom) or not node.module.startswith("mlscorr."):
        return False
    module = ROOT / node.module.replace(".", "/")
    return not module.is_dir() and module.parent not in (PACKAGE, *path.parents)


def counts_of(path):
    "Counter of what a module holds"
    nodes = list(ast.walk(parsed(path)))
    public = list(public_definitions(parsed(path)))
    lines = code_lines(path)
    text = path.read_text().splitlines()
    return Counter(
        modules=1,
        lines=len(lines),
        characters=sum(len(text[number - 1].strip()) for number in lines),
        packed=sum(map(is_packed, nodes)),
        conditional=sum(isinstance(node, ast.IfExp) for node in nodes),
        dataclasses=sum(map(is_dataclass, nodes)),
        past_faces=sum(is_past_face(node, path) for node in nodes),
        constants=sum(1 for _ in numeric_constants(path)),
        public=len(public),
        documented=sum(map(is_documented, public)),
        unannotated=len(unannotated(path)),
    )


def figures(paths):
    "Counts of some modules: characters of a code line, packed and conditional of 1 000 of them"
    counts = sum(map(counts_of, paths), Counter())
    thousands = counts["lines"] / 1000
    return {
        "modules": counts["modules"],
        "lines": counts["lines"],
        "characters": f"{counts['characters'] / counts['lines']:.1f}",
        "packed": f"{counts['packed'] / thousands:.1f}",
        "conditional": f"{counts['conditional'] / thousands:.1f}",
        **{name: counts[name] for name in ("dataclasses", "past_faces", "constants")},
        **{name: counts[name] for name in ("public", "documented", "unannotated")},
    }


def test_public_names_say_what_they_take_and_give():
    "Docstrings of public functions and classes have sections Parameters, Returns or Raises"
    public = [node for path in MODULES for node in public_definitions(parsed(path))]
    assert sum(map(is_documented, public)) >= DOCUMENTED * len(public)


def test_public_functions_state_their_types():
    "Every public function and method annotates its parameters and its result"
    offenders = []
    for room in sorted(set(map(room_of, MODULES))):
        names = [name for path in MODULES if room_of(path) == room for name in unannotated(path)]
        if len(names) > UNANNOTATED.get(room, 0):
            offenders += names
    assert not offenders, "\n".join(offenders)


def test_every_test_opens_with_a_sentence():
    "The docstring of a test says what is true"
    silent = [
        f"{name_of(path)}:{node.lineno} {node.name}"
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        for node in ast.walk(parsed(path))
        if isinstance(node, FUNCTIONS)
        and node.name.startswith("test_")
        and not ast.get_docstring(node)
    ]
    assert not silent, "\n".join(silent)


if __name__ == "__main__":
    rooms = sorted(set(map(room_of, MODULES)))
    table = {room: figures([p for p in MODULES if room_of(p) == room]) for room in rooms}
    table["total"] = figures(MODULES)
    print(f"{'':14}" + "".join(f"{figure:>12}" for figure in table["total"]))
    for room, counts in table.items():
        print(f"{room:14}" + "".join(f"{count:>12}" for count in counts.values()))
    tests = sum(len(code_lines(path)) for path in (ROOT / "tests").rglob("*.py"))
    print("characters are of a code line; packed assignments and conditionals of 1 000 code lines")
    print(f"test code per line of source code: {tests / table['total']['lines']:.2f}")

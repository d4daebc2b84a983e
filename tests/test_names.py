"""The names of the house: nouns of the field, each with one meaning.

``python tests/test_names.py [ROOM]`` prints how many names of each room break this, and which.
"""

import ast
import sys
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "mlscorr"
BANNED = frozenset(  # pronouns, participles, adjectives, puns: they name nothing
    """one ones told untold found several mine yours ours theirs hers its itself looks look worth
    sure unsure few fewer fewest many most reach seen unseen said says tells wants wanted takes
    goes whose enough plenty alike likely nearly roughly again together alone aside sideways
    never even odd""".split()
)
VERBS = frozenset(  # in capitals: a constant is a quantity, no act, participle or preposition
    """ask believe bloomed carry claimed differ exchanged faded find grow grown hide keep kept know
    leave lose lost made make moved passed redraw redrawn refuse remember remembered restarted
    reversed see settle settled shrink suspect take taken tell touched tries tried try used write
    written beside between beyond within around behind towards twice""".split()
)
SHARED_CLASSES = {"Settings"}  # the numbers of a room, in each room
ALLOWED: dict[str, int] = {}  # names that are still to be replaced, at most


def bound_names(tree):
    "(name, line) of all that a module binds: variables, parameters, attributes, functions, classes"
    for node in ast.walk(tree):
        if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield (node.id if isinstance(node, ast.Name) else node.attr), node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.alias) and node.asname:
            yield node.asname, node.lineno


def is_banned(name):
    "True if a name has no meaning, or is a verb in capitals"
    plain = name.strip("_").rstrip("0123456789_")
    return plain.lower() in BANNED or (plain.isupper() and plain.lower() in VERBS)


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def banned_names():
    "room -> ['file:line name', ...]"
    rooms = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        rooms[room_of(path)] += [
            f"{path.relative_to(PACKAGE)}:{line} {name}"
            for name, line in bound_names(ast.parse(path.read_text()))
            if is_banned(name)
        ]
    return rooms


def doubled_classes():
    "Public class name -> modules, where several modules define it"
    homes = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(str(path.relative_to(PACKAGE)))
    return {
        name: places
        for name, places in homes.items()
        if len(places) > 1 and name not in SHARED_CLASSES
    }


def settings_fields():
    "Name of a field of Settings -> {module: whether its value is taken from a name elsewhere}"
    homes = defaultdict(dict)
    for path in sorted(PACKAGE.rglob("*settings.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and node.name == "Settings":
                for field in node.body:
                    if isinstance(field, ast.AnnAssign):
                        taken = any(isinstance(part, ast.Name) for part in ast.walk(field.value))
                        homes[field.target.id][str(path.relative_to(PACKAGE))] = taken
    return homes


def test_the_lint_knows_a_noun_from_a_pun():
    "Pronouns, participles and verbs in capitals are refused, nouns are not"
    assert all(map(is_banned, ("one", "_found", "FEWEST", "several", "TOLD", "mine", "KEEP")))
    assert not any(map(is_banned, ("targets", "epochs_in_gap", "SMALLEST_PLANE_POINTS", "cut")))


def test_names_are_nouns_of_the_field():
    "Nothing that a module binds is on the banned list"
    offenders = []
    for room, names in banned_names().items():
        if len(names) > ALLOWED.get(room, 0):
            offenders += names
    assert not offenders, "\n".join(offenders)


def test_a_class_name_has_one_meaning():
    "No public class name stands in two modules"
    assert not doubled_classes()


def test_a_number_has_one_name_and_one_home():
    "No two rooms give a setting the same name, unless one of them takes the other's value"
    homes = settings_fields()
    assert not {
        name: list(modules)
        for name, modules in homes.items()
        if len(modules) - sum(modules.values()) > 1
    }


if __name__ == "__main__":
    rooms = banned_names()
    for room in sys.argv[1:]:
        print(*rooms[room], sep="\n")
    print({room: len(names) for room, names in rooms.items() if names})
    print(*(f"{name}: {', '.join(homes)}" for name, homes in doubled_classes().items()), sep="\n")
    print(Counter(entry.split()[1] for names in rooms.values() for entry in names).most_common(30))

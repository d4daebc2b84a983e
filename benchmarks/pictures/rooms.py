"""Draw the rooms of the package on their floors, with the imports between them.

    python benchmarks/pictures/rooms.py [--picture FILE.svg]

Rooms and floors are FLOORS of tests/test_layers.py; imports are read from the sources. A line that
follows from others (a imports b, b imports c) is left out. The manual draws this when it is built.
"""

import argparse
import ast
from itertools import product
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "mlscorr"
PICTURES = ROOT / "build" / "pictures"
BOX = (136, 40)  # px, width and height of a room
FLOOR = 76  # px from floor to floor
WIDTH = 940  # px
STAGGER = 52  # px by which floors are shifted in turn, so that lines pass rooms that they skip
WORDS = {
    "cli": "commands",
    "pipeline": "read, stages, result",
    "blind": "sealed labels",
    "report": "screens, pages",
    "gap": "diagnosis",
    "evaluate": "check points, gates",
    "ties": "overlap of passes",
    "simulate": "simulated surveys",
    "baselines": "simple methods",
    "targets": "target centers",
    "estimate": "factors, correction",
    "surfaces": "planes, poles, paint",
    "effects": "errors by name",
    "io": "file formats",
    "matching": "names of targets",
    "pos": "POS error process",
    "correction": "points by their time",
    "collocation": "solver",
    "frames": "rotations",
    "survey": "nouns",
    "wording": "numbers in words",
    "compiled_loops": "compiled code",
}
COLORS = ("#e8f0f7", "#f4f7fa")  # of the floors, in turn
STYLE = (
    "text{font-family:sans-serif;font-size:13px;text-anchor:middle;dominant-baseline:central}"
    ".room{fill:#fff;stroke:#0072b2;stroke-width:1.2}"
    ".import{fill:none;stroke:#7a8794;stroke-width:1}"
    ".name{fill:#1b2733;font-weight:600}"
    ".words{fill:#55626e;font-size:11px}"
)


def floors():
    """Names of the rooms on each floor, from the ground up."""
    tree = ast.parse((ROOT / "tests" / "test_layers.py").read_text())
    for node in tree.body:
        if isinstance(node, ast.Assign) and node.targets[0].id == "FLOORS":
            return ast.literal_eval(node.value)
    raise ValueError("tests/test_layers.py has no FLOORS.")


def imported_rooms(room):
    """Names of the other rooms that the modules of a room import."""
    folder = PACKAGE / room
    paths = sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]
    found = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name.split(".")[1] for name in names if name.startswith("mlscorr.")}
    return found


def imports(rooms):
    """Pairs (room, imported room), without those that follow from others."""
    direct = {room: imported_rooms(room) & set(rooms) - {room} for room in rooms}
    reached = {room: set() for room in rooms}
    for room in rooms:  # from the ground up, so that those below are known
        for other in direct[room]:
            reached[room] |= {other} | reached[other]
    for room, others in direct.items():
        implied = set().union(*(reached[other] for other in others))
        yield from ((room, other) for other in sorted(others - implied))


def places(plan):
    """Middle (x, y) of each room in px."""
    found = {}
    for number, rooms in enumerate(plan):
        y = (len(plan) - number - 0.5) * FLOOR
        for i, room in enumerate(rooms):
            shift = STAGGER * (-1) ** number
            if len(rooms) > 3:
                shift = 0
            found[room] = (WIDTH * (i + 1) / (len(rooms) + 1) + shift, y)
    return found


def spread(plan, lines):
    """The plan with the rooms of each floor ordered so that lines are short."""
    plan = [list(rooms) for rooms in plan]
    neighbors = {}
    for room in (room for rooms in plan for room in rooms):
        neighbors[room] = {b for a, b in lines if a == room} | {a for a, b in lines if b == room}
    for _, rooms in product(range(8), plan):
        at = places(plan)
        middle = {
            room: sum(at[n][0] for n in neighbors[room]) / max(len(neighbors[room]), 1)
            for room in rooms
        }
        rooms.sort(key=middle.get)
    return plan


def draw(path):
    """Write the picture as SVG."""
    plan = floors()
    lines = list(imports([room for rooms in plan for room in rooms]))
    plan = spread(plan, lines)
    at = places(plan)
    height = FLOOR * len(plan)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        f'width="{WIDTH}" height="{height}">',
        f"<style>{STYLE}</style>",
    ]
    parts += [
        f'<rect x="0" y="{number * FLOOR}" width="{WIDTH}" height="{FLOOR}" '
        f'fill="{COLORS[number % 2]}"/>'
        for number in range(len(plan))
    ]
    for room, other in lines:
        (x1, y1), (x2, y2) = at[room], at[other]
        y1 += BOX[1] / 2
        y2 -= BOX[1] / 2
        bend = 0.5 * (y2 - y1)
        parts.append(
            f'<path class="import" d="M{x1:.0f} {y1:.0f} C{x1:.0f} {y1 + bend:.0f} '
            f'{x2:.0f} {y2 - bend:.0f} {x2:.0f} {y2:.0f}"/>'
        )
    for room, (x, y) in at.items():
        parts.append(
            f'<rect class="room" x="{x - BOX[0] / 2:.0f}" y="{y - BOX[1] / 2:.0f}" '
            f'width="{BOX[0]}" height="{BOX[1]}" rx="4"/>'
            f'<text class="name" x="{x:.0f}" y="{y - 7:.0f}">{room}</text>'
            f'<text class="words" x="{x:.0f}" y="{y + 9:.0f}">{WORDS.get(room, "")}</text>'
        )
    path.write_text("\n".join([*parts, "</svg>", ""]), encoding="utf-8")


def main():
    picture = parse().picture
    draw(picture)
    print(f"Picture: {picture}")


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, default=PICTURES / "architecture.svg")
    arguments = parser.parse_args()
    arguments.picture.parent.mkdir(parents=True, exist_ok=True)
    return arguments


if __name__ == "__main__":
    main()

"""Surveyed targets from control.csv."""

import csv
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

from mlscorr.io.tables import ENCODING, find_columns, nearest, not_text, read_header
from mlscorr.survey import KINDS, ControlPoints

POSITION = ("easting", "northing", "height")
COLUMNS = ("name", *POSITION, "sigma_horizontal", "sigma_vertical", "kind", "size", "role")
NORMAL = ("normal_e", "normal_n", "normal_h")
ROLES = ("control", "check")
LARGEST_TARGET = 10.0  # m, the size beyond which it was certainly given in mm
SMALLEST_TARGET = 0.02  # m: the scanners' beams are as wide
USUAL = 0.05, 1.5  # m, of targets
LARGEST_COORDINATE = 1e8  # m, twice the Earth's girth and more; map zones prefixed to E fit in
COARSE_SIGMA = 0.5  # m, beyond which a surveyed point corrects nothing


def read_control(path):
    """Control points and check points of a file: two ControlPoints, either of which may be empty.

    Raises ValueError for missing columns, names that are missing or doubled, cells that are no
    numbers, an unknown kind or role, and sizes and sigmas that can't be metres.
    """
    path = Path(path)
    header, skip = read_header(path)
    columns = find_columns(path, header, COLUMNS, (NORMAL,))
    try:
        rows = _rows(path, skip, header, columns)
    except UnicodeDecodeError:
        raise ValueError(not_text(path)) from None
    if not rows:
        raise ValueError(f"{path} has a header but no points.")
    doubled = [name for name, count in Counter(row["name"] for row in rows).items() if count > 1]
    if doubled:
        raise ValueError(
            f"{path} names {', '.join(doubled)} more than once; every control or check point "
            "needs a name of its own."
        )
    for row in rows:
        _check(path, row)
    return tuple(_points([row for row in rows if row["role"] == role]) for role in ROLES)


def holds_points(path):
    """Whether a file holds more than a header; an empty one stands for no control at all."""
    with Path(path).open(encoding=ENCODING, errors="replace") as file:
        lines = (line for line in file if line.strip(" \t\r\n,;"))
        return sum(1 for _ in zip(lines, range(2), strict=False)) > 1


def _rows(path, skip, header, columns):
    """Rows of the file as dicts: text, and numbers for the columns that hold numbers."""
    rows = []
    with path.open(encoding=ENCODING, newline="") as file:
        for _ in range(skip):
            next(file)
        reader = csv.reader(file, skipinitialspace=True)
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            line = f"Line {skip + reader.line_num} of {path}"
            if len(cells) != len(header):
                raise ValueError(
                    f"{line} has {len(cells)} columns where the header has {len(header)}: "
                    "the file may have been cut off, or a comma may be missing."
                )
            rows.append({name: _value(line, name, cells[i].strip()) for name, i in columns.items()})
    return rows


def _value(line, name, cell):
    if name in ("kind", "role"):
        return cell.casefold()
    if name == "name":
        if not cell:
            raise ValueError(f"{line} has no name.")
        return cell
    if name in NORMAL and not cell:
        return np.nan
    try:
        number = float(cell)
    except ValueError:
        raise ValueError(f"{line} has the {name} '{cell}', which is not a number.") from None
    if not np.isfinite(number) and name not in NORMAL:
        raise ValueError(f"{line} has the {name} '{cell}', which is not a finite number.")
    return number


def _check(path, row):
    """Refuse one row whose values can't be meant."""
    who = f"{row['name']} of {path}"
    for key, known in (("kind", KINDS), ("role", ROLES)):
        if row[key] not in known:
            raise ValueError(
                f"{who} has the unknown {key} '{row[key]}'; known are "
                f"{', '.join(known[:-1])} and {known[-1]}. "
                f"Is {nearest(row[key], known)} meant?"
            )
    if not SMALLEST_TARGET <= row["size"] <= LARGEST_TARGET:
        raise ValueError(
            f"{who} has the size {row['size']:g} m, outside [{SMALLEST_TARGET:g}, "
            f"{LARGEST_TARGET:g}] m: {_likely_unit(row['size'])}"
        )
    for key in POSITION:
        if abs(row[key]) > LARGEST_COORDINATE:
            raise ValueError(
                f"{who} has the {key} {row[key]:g} m, beyond {LARGEST_COORDINATE:g} m: no map "
                "reaches that far (millimetres?)."
            )
    for key in ("sigma_horizontal", "sigma_vertical"):
        if row[key] <= 0:
            raise ValueError(f"{who} has the {key} {row[key]:g} m; it must be greater than zero.")
        if row[key] > COARSE_SIGMA:
            warnings.warn(
                f"{who} has the {key} {row[key]:g} m and will hardly count (millimetres?).",
                stacklevel=3,
            )
    normal = [row.get(name, np.nan) for name in NORMAL]
    if np.isfinite(normal).any() and not (np.isfinite(normal).all() and np.any(normal)):
        raise ValueError(
            f"{who} has the normal {normal}; give three numbers, not all zero, or none."
        )


def _likely_unit(size):
    """What may be meant by a size that can't be metres."""
    if size <= 0:
        return "a diameter or edge is positive."
    for unit, factor in (("centimetres", 0.01), ("millimetres", 0.001)):
        if USUAL[0] <= factor * size <= USUAL[1]:
            return f"{unit}? Then give {factor * size:g}."
    return "sizes are in metres; is the decimal point misplaced, or another unit meant?"


def _points(rows):
    """ControlPoints of rows; none of them gives an empty one."""

    def numbers(*names):
        table = [[row.get(name, np.nan) for name in names] for row in rows]
        return np.array(table, dtype=float).reshape(len(rows), len(names))

    normal = numbers(*NORMAL)
    return ControlPoints(
        name=tuple(row["name"] for row in rows),
        position=numbers(*POSITION),
        sigma=numbers("sigma_horizontal", "sigma_horizontal", "sigma_vertical"),
        kind=tuple(row["kind"] for row in rows),
        size=numbers("size")[:, 0],
        normal=normal / np.linalg.norm(normal, axis=1, keepdims=True),
    )


NO_POINTS = _points([])

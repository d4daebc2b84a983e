"""Results as tables in CSV files."""

import csv
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from mlscorr.survey import AXES, Ties


def write_targets_csv(path: str | Path, targets: Sequence[dict]) -> None:
    """Write the targets of report.json as a table.

    Parameters
    ----------
    path : path
    targets : sequence of dict
        Misclosures are surveyed - observed. Units: m.
    """
    vectors = ("surveyed", "observed", "sigma", "before", "after", "left_out")
    names = [f"{vector}_{axis}" for vector in vectors for axis in AXES]
    rows = [("name", "pass", "gps_time", "role", *names, "used", "reason", "scanned")]
    for target in targets:
        numbers = [
            "" if value is None else f"{value:.4f}"
            for vector in vectors
            for value in (target[vector] or (None,) * len(AXES))
        ]
        time = ""
        if target["gps_time"] is not None:
            time = f"{target['gps_time']:.6f}"
        first = (target["name"], target["pass"] or "", time, target["role"])
        used, scanned = (str(target[key]).lower() for key in ("used", "scanned"))
        rows.append((*first, *numbers, used, target["reason"] or "", scanned))
    write_csv(path, rows)


def write_extracted_csv(path: str | Path, targets: Sequence[dict]) -> None:
    """Write the targets of targets.json as a table.

    Parameters
    ----------
    path : path
    targets : sequence of dict
        The table has a sigma for each axis. Units: m.
    """
    names = [*AXES, *(f"sigma_{axis}" for axis in AXES), "normal_e", "normal_n", "normal_h"]
    first = ("name", "pass", "gps_time", "kind", "size", "size_sigma")
    rows = [(*first, *names, "points", "score", "matched", "reason")]
    for target in targets:
        sigma = [math.sqrt(target["covariance"][axis][axis]) for axis in range(3)]
        vectors = (*target["observed"], *sigma, *target["normal"])
        sizes = [f"{target[key]:.4f}" for key in ("size", "size_sigma")]
        time = f"{target['gps_time']:.6f}"
        first = (target["name"] or "", target["pass"], time, target["kind"], *sizes)
        last = (target["points"], f"{target['score']:.3f}", str(target["matched"]).lower())
        rows.append((*first, *[f"{value:.4f}" for value in vectors], *last, target["reason"] or ""))
    write_csv(path, rows)


def write_ties_csv(path: str | Path, ties: Ties) -> None:
    """Write ties as a table.

    Parameters
    ----------
    path : path
    ties : Ties
        With recorded positions. Units: m.
    """
    places = [f"{axis}_{view}" for view in (1, 2) for axis in AXES]
    first = ("pass_1", "pass_2", "gps_time_1", "gps_time_2", "kind", *places)
    rows = [(*first, "direction_e", "direction_n", "direction_h", "misclosure", "sigma")]
    for i in range(len(ties)):
        times = [f"{time:.6f}" for time in ties.gps_time[i]]
        numbers = [f"{value:.4f}" for value in ties.place[i].ravel()]
        numbers += [f"{value:.6f}" for value in ties.direction[i]]
        last = (f"{ties.misclosure[i]:.5f}", f"{ties.sigma[i]:.5f}")
        rows.append((*ties.pass_number[i], *times, ties.kind[i], *numbers, *last))
    write_csv(path, rows)


def write_csv(path: str | Path, rows: Iterable[Sequence]) -> None:
    """Write rows of cells so that a spreadsheet runs no formula.

    Parameters
    ----------
    path : path
    rows : iterable of sequences
        The first has the names of the columns.
    """
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([_inert(cell) for cell in row] for row in rows)


def _inert(cell):
    """Cell that no spreadsheet runs as a formula; numbers do not change.

    >>> _inert("=1+1"), _inert("-0.0123"), _inert("T01")
    ("'=1+1", '-0.0123', 'T01')
    """
    is_formula = isinstance(cell, str) and re.match(r"[=+@\t\r-](?![\d.]*$)", cell)
    if is_formula:
        return f"'{cell}"
    return cell

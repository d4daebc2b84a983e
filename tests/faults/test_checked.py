"""A survey that passes the check is corrected: the matrix of faults, by both commands.

``make faults`` tries all of it.
"""

import shutil
from collections import Counter

import numpy as np
import pytest

from tests.beds.checked import verdicts
from tests.faults.sizes import IS_FULL, tries
from tests.faults.test_meanings import ESTIMATED, READ, column, rows_of, write
from tests.faults.test_mutations import BYTES, TEXT, mutated

DAMAGED = "damaged"  # points that can't be decoded: a check decodes some, a correction all


def surveyed_twice(folder):
    "Each point under two names"
    rows = rows_of(folder / "control.csv")
    again = [row | {"name": f"{row['name']}.1"} for row in rows]
    write(folder / "control.csv", [*rows, *again])


def thinned(folder):
    "One control point, and check points"
    rows = rows_of(folder / "control.csv")
    first = next(row for row in rows if row["role"] == "control")
    write(folder / "control.csv", [first, *(row for row in rows if row["role"] == "check")])


def hidden(folder):
    "Every control point 40 m beside itself, the check points as they are"
    rows = rows_of(folder / "control.csv")
    for row in rows:
        if row["role"] == "control":
            row["easting"] = f"{float(row['easting']) + 40.0:.4f}"
    write(folder / "control.csv", rows)


OWN = {
    "each point twice": lambda r: surveyed_twice,
    "one control point": lambda r: thinned,
    "control beside the cloud": lambda r: hidden,
    "no sigma of the POS": lambda r: column("trajectory.csv", ["sigma_easting"], -1.0),
}
KINDS = OWN | {kind: draw for kind, (draw, _) in (READ | ESTIMATED).items()}
QUICK = ("each point twice", "control beside the cloud", "another vertical datum")


@pytest.mark.parametrize("kind", KINDS if IS_FULL else QUICK)
def test_what_a_check_passes_is_corrected(kind, tiny, tmp_path, record_property):
    "Files that are whole and mean something else: a check finds a fault wherever correct refuses"
    folder = shutil.copytree(tiny, tmp_path / "survey")
    KINDS[kind](np.random.default_rng(23))(folder)
    said = verdicts(folder)
    assert not (said.is_passed and said.refusal), said
    record_property(f"checked and corrected, {kind}", "refused" if said.refusal else "corrected")


@pytest.mark.parametrize("name", ["control.csv", "trajectory.csv", "survey.toml", "pass-1.las"])
def test_what_a_check_passes_of_mutated_files_is_corrected(name, tiny, tmp_path, record_property):
    "Changed bytes and cells of any input: passed and corrected, or a fault of both"
    folder = shutil.copytree(tiny, tmp_path / "survey")
    whole = (folder / name).read_bytes()
    rng = np.random.default_rng(29)
    outcomes = Counter()
    for _ in range(tries(1, 40)):
        (folder / name).write_bytes(mutated(whole, rng, BYTES if name.endswith("las") else TEXT))
        said = verdicts(folder)
        assert not (said.is_passed and said.refusal) or DAMAGED in said.refusal, said
        outcomes["refused" if said.refusal else "corrected"] += 1
    record_property(f"mutated {name}, checked and corrected", dict(outcomes))

"""The paper's experiments run, and what must hold exactly in them does."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tests.beds.places import BENCHMARKS

PAPER = BENCHMARKS / "paper"


@pytest.fixture(scope="module")
def paper():
    "Import a module of benchmarks/paper by its name; none of them stays imported"
    before = set(sys.modules)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PAPER)
        yield import_module
    for name in set(sys.modules) - before:
        path = Path(getattr(sys.modules[name], "__file__", None) or "/")
        if path.parent in (PAPER, PAPER.parent):
            del sys.modules[name]


def test_the_squared_rms_is_a_parabola_in_c0_that_starts_at_least_squares(paper):
    "Table 3 holds exactly: C0 is a gain of the signal alone, and nothing is left without it"
    drive = paper("drive")
    whole = drive.Drive.of(0)
    for count, time in ((21, 30.0), (9, 120.0)):
        factors = np.linspace(0.0, 2.2, 8)
        kept = whole.with_control(count)
        found, _, unexplained, at_zero = drive.sweep_base(kept, time, factors)
        assert len(kept.survey.observations) == count
        assert np.ptp(found) > 0.001  # m: C0 does matter
        assert unexplained < 1e-12
        assert at_zero < 1e-7  # relative, against LS-5 by other code


def test_tuned_on_the_truth_it_is_never_worse_than_least_squares(paper):
    "The best C0 is the parabola's vertex, so no other C0 does better"
    drive, literal, tables = (paper(name) for name in ("drive", "literal", "tables"))
    one = drive.Drive.of(0)
    fit = literal.Literal.of(one.survey, 4)
    left, base = fit.tuned(one.gps_time, one.error, 30.0)
    assert np.all(tables.rms(left) <= tables.rms(one.least_squares(4)) + 1e-9)
    for factor in (0.9, 1.1):
        other = one.error - fit.predict(one.gps_time, factor * base, 30.0)
        assert np.all(tables.rms(other) >= tables.rms(left))


@pytest.mark.long
@pytest.mark.parametrize(
    ("script", "tables"),
    [("car", (1, 2, 3, 4)), ("boat", (5,)), ("calibration", (6, 7))],
)
def test_each_experiment_prints_its_tables_and_draws(
    script, tables, paper, tmp_path, capsys, monkeypatch
):
    "Tables beside the paper's own, said to be of a clone, and a picture"
    picture = tmp_path / f"{script}.png"
    module = paper(script)
    if script == "car":  # one order and one number of control points, for time
        monkeypatch.setattr(module, "ORDERS", (5,))
        monkeypatch.setattr(module, "COUNTS", (21,))
    module.main(["--seeds", "1", "--picture", str(picture)])
    printed = capsys.readouterr().out
    assert "a simulated clone, not the paper's data" in printed
    assert all(f"Table {number}" in printed for number in tables)
    assert picture.read_bytes().startswith(b"\x89PNG")

"""Small synthetic surveys for the examples: each is simulated once and kept in build/surveys."""

import sys
from pathlib import Path

import numpy as np

from mlscorr.simulate import Scenario, simulate

BUILD = Path(__file__).resolve().parents[1] / "build"
SCANNER = {"lines_per_second": 75.0, "points_per_line": 300}  # coarse: 20 000 points a second
WRONG_MOUNTING = (
    {"name": "lever_arm", "magnitude": [0.0, 0.03, 0.0]},  # m: right, forward, up
    {"name": "boresight", "magnitude": [0.0, -0.06, 0.2]},  # deg
)
WRONG_CLOCK = ({"name": "time_offset", "magnitude": 0.02},)  # s


def street() -> Path:
    """One pass of 10 s along a street; GNSS fails for 6 s."""
    return _made("street", drive={"duration": 10.0, "speed": 6.0}, pos=_outage())


def street_next_day() -> Path:
    """The same street and targets, driven the other way a day later."""
    drive = {"duration": 10.0, "speed": 6.0, "passes": [{"direction": "back"}]}
    return _made("next-day", drive=drive, pos=_outage(), start_time=444_100.0)


def two_passes() -> Path:
    """The same street there and back, 8 s each."""
    drive = {"duration": 8.0, "speed": 6.0, "passes": [{}, {"direction": "back"}]}
    return _made("two-passes", drive=drive)


def wrong_mounting() -> Path:
    """Two passes whose mounting was recorded with a wrong lever arm and boresight."""
    drive = {"duration": 8.0, "speed": 6.0, "passes": [{}, {"direction": "back"}]}
    return _made("wrong-mounting", drive=drive, effects=WRONG_MOUNTING)


def wrong_clock() -> Path:
    """One pass of 15 s; the scanner's clock is 20 ms off."""
    return _made(
        "wrong-clock",
        drive={"duration": 15.0},
        targets={"control": 8, "check": 3},
        effects=WRONG_CLOCK,
    )


def output_folder() -> Path:
    """Folder for what a script writes: its argument, or build/examples/NAME."""
    given = sys.argv[1:] or [BUILD / "examples" / Path(sys.argv[0]).stem]
    folder = Path(given[0])
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _outage():
    """A POS in real time that has no GNSS from the 2nd to the 8th second."""
    return {"processing": "filtered", "outages": ((2.0, 6.0),)}


def _made(name, **parts):
    """Folder of a survey, which is simulated where it is not there."""
    folder = BUILD / "surveys" / name
    if not folder.exists():
        few = {"control": 4, "check": 2, "hidden": 0.0}
        scenario = Scenario(**{"name": name, "targets": few, "scanner": [SCANNER], **parts})
        simulate(scenario, np.random.default_rng(1)).write(folder)
        with (folder / "survey.toml").open("a") as file:
            file.write("\n[matching]\nsearch_radius = 4.0\n")  # m: a short outage drifts less
    return folder

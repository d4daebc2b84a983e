"""simulator.toml: what a simulator believes of a survey, and the effects that it has."""

import json
import warnings
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.spatial.transform import Rotation

from mlscorr.effects import Effect, in_order
from mlscorr.io.settings import read_settings_file
from mlscorr.io.survey_file import (
    Degrees,
    Meters,
    Positive,
    PosSection,
    ScannerSection,
    Three,
)
from mlscorr.simulate.scenario import EffectScenario
from mlscorr.survey import Mounting, Pos, Scanner

DIGITS = range(3, 16)  # decimals of a number in deg, tried from the fewest
ULPS = np.arange(-4, 5)  # units in the last place, by which conversions to and fro may miss


@dataclass(frozen=True)
class Simulator:
    """What is believed of a survey, so that it can be simulated.

    Parameters
    ----------
    mounting : Mounting or None
        As recorded; None where nobody knows it.
    scanner : Scanner
    pos : Pos
    effects : tuple of Effect
        That turn what is true into what is recorded, in the order in which they act.
    """

    mounting: Mounting | None
    scanner: Scanner
    pos: Pos
    effects: tuple[Effect, ...] = ()


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class MountingSection(_Section):
    lever_arm: Annotated[list[Meters], Three]  # m: right, forward, up
    boresight: Annotated[list[Degrees], Three]  # deg, about x, y, z


class WindowSection(_Section):
    """A time in which the POS is worse, see Pos."""

    start: Annotated[float, Field(allow_inf_nan=False)]  # gps_time, s
    length: Positive  # s
    factor: Positive  # of the largest error on the stated sigma
    shape: Literal["rise", "hump"] = "rise"


class BelievedPosSection(PosSection):
    windows: list[WindowSection] = Field(default_factory=list)

    def pos(self):
        windows = tuple((w.start, w.length, w.factor, w.shape) for w in self.windows)
        return replace(super().pos(), windows=windows)


class SimulatorFile(_Section):
    """What stands in simulator.toml, in its own units (deg)."""

    mounting: MountingSection | None = None
    scanner: ScannerSection = ScannerSection()
    pos: BelievedPosSection = BelievedPosSection()
    effects: list[EffectScenario] = []

    @property
    def imperfections(self):
        return in_order(effect.effect for effect in self.effects)

    @model_validator(mode="after")
    def _has_each_noise_once(self):
        self.imperfections  # noqa: B018 - refuses random effects that are there twice
        return self


def beliefs_of(survey):
    """The Simulator that survey.toml describes: no effects.

    How well a calibration knows the mounting is no part of it.
    """
    mounting = survey.mounting and replace(survey.mounting, covariance=None)
    return Simulator(mounting, survey.scanner, survey.pos)


def read_simulator(path):
    """Simulator of a simulator.toml.

    Sections [mounting], [scanner] and [pos] have the keys and units of survey.toml, [[effects]]
    those of scenario.toml; what is left out has the defaults of survey.toml.

    Raises ValueError for bad TOML, unknown keys and effects (with the nearest known one) and
    values that no survey can have; FileNotFoundError where there is no such file.
    """
    path = Path(path)
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist"
        raise FileNotFoundError(f"{path} {what}; a simulator is a TOML file.")
    file = read_settings_file(path, SimulatorFile)
    mounting = None
    if file.mounting is not None:
        angles = np.array(file.mounting.boresight)
        mounting = Mounting(np.array(file.mounting.lever_arm, dtype=float), _turned(angles))
    return Simulator(mounting, file.scanner.scanner(), file.pos.pos(), file.imperfections)


def write_simulator(simulator, path):
    """Write simulator.toml, which is read as the same to the last bit: all that a survey.toml may
    say. A file there is replaced.
    """
    scanner, pos = simulator.scanner, simulator.pos
    sections = [("[scanner]", _scanner_keys(scanner)), ("[pos]", _pos_keys(pos))]
    if simulator.mounting is not None:
        sections.insert(0, ("[mounting]", _mounting_keys(simulator.mounting)))
    for effect in simulator.effects:
        sections.append(("[[effects]]", {"name": effect.name, **asdict(effect)}))
    keys = ("start", "length", "factor", "shape")
    for window in pos.windows:
        sections.append(("[[pos.windows]]", dict(zip(keys, window, strict=True))))
    text = "\n".join(
        "\n".join([title, *(f"{key} = {_toml(value)}" for key, value in keys.items()), ""])
        for title, keys in sections
    )
    Path(path).write_text(text, encoding="utf-8")


def _mounting_keys(mounting):
    return {
        "lever_arm": np.asarray(mounting.lever_arm, dtype=float).tolist(),
        "boresight": _angles(mounting.boresight),
    }


def _scanner_keys(scanner):
    return {
        "range_noise": float(scanner.range_noise),
        "angle_noise": _degrees(scanner.angle_noise),
        "lines_per_second": float(scanner.lines_per_second),
    }


def _pos_keys(pos):
    return {
        "position_sigma": float(pos.position_sigma),
        "attitude_sigma": [_degrees(sigma) for sigma in pos.attitude_sigma],
        "correlation_time": float(pos.correlation_time),
    }


def _toml(value):
    """A value in TOML: floats by their shortest digits that are read as the same number."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value)


def _turned(angles):
    """R_L^P = Rz(c) Ry(b) Rx(a) of angles [a, b, c] (..., 3) in deg."""
    return Rotation.from_euler("xyz", angles, degrees=True)


def _degrees(radians):
    """The number in deg with the fewest digits that is these radians when it is read."""
    near = np.degrees(radians)
    tried = [*(np.round(near, digits) for digits in DIGITS), *(near + ULPS * np.spacing(near))]
    return float(next((one for one in tried if np.radians(one) == radians), near))


def _angles(boresight):
    """The angles (3,) in deg with the fewest digits that are this rotation when they are read;
    to the last bit for angles of up to 15 decimals, to 1e-15 rad for others."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        near = boresight.as_euler("xyz", degrees=True)
    rounded = np.array([np.round(near, digits) for digits in DIGITS]) + 0.0
    same = (_turned(rounded).as_quat() == boresight.as_quat()).all(axis=1)
    return (rounded[np.argmax(same)] if same.any() else near).tolist()

"""simulator.toml: assumed properties of a survey in a simulator, and its effects."""

import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomlkit
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from mlscorr.effects import Effect, in_order
from mlscorr.io.store import Positive, TomlSection, read_toml
from mlscorr.io.surveys import MountingSection, PosSection, ScannerSection
from mlscorr.simulate.scenario import EffectScenario
from mlscorr.survey import Mounting, Pos, Scanner, Survey

DECIMALS = 12  # of numbers in deg that a person may have written


@dataclass(frozen=True)
class Simulator:
    """Assumed properties of a survey, with which it can be simulated.

    Parameters
    ----------
    mounting : Mounting or None
        Recorded mounting; None if unknown.
    scanner : Scanner
    pos : Pos
    effects : tuple of Effect
        Effects from truth to record, in the order in which they act.
    """

    mounting: Mounting | None
    scanner: Scanner
    pos: Pos
    effects: tuple[Effect, ...] = ()


class WindowSection(TomlSection):
    """Interval in which the POS is worse; see Pos."""

    start: Annotated[float, Field(allow_inf_nan=False)]  # gps_time, s
    length: Positive  # s
    factor: Positive  # of the largest error on the stated sigma
    shape: Literal["rise", "hump"] = "rise"


class AssumedPosSection(PosSection):
    """POS as stated by the survey, with intervals of larger errors."""

    windows: list[WindowSection] = Field(default_factory=list)

    def pos(self) -> Pos:
        """Return the Pos with its intervals."""
        windows = tuple((w.start, w.length, w.factor, w.shape) for w in self.windows)
        return replace(super().pos(), windows=windows)


class SimulatorFile(TomlSection):
    """Contents of simulator.toml, in its own units (deg)."""

    mounting: MountingSection | None = None
    scanner: ScannerSection = ScannerSection()
    pos: AssumedPosSection = AssumedPosSection()
    effects: list[EffectScenario] = Field(default_factory=list)

    @property
    def imperfections(self) -> tuple[Effect, ...]:
        """Effects, in the order in which they act."""
        return in_order(effect.effect for effect in self.effects)

    @model_validator(mode="after")
    def _has_each_noise_once(self):
        self.imperfections  # noqa: B018 - refuses random effects that are there twice
        return self


def beliefs_of(survey: Survey) -> Simulator:
    """Make the Simulator that survey.toml describes, without effects.

    The calibrated accuracy of the mounting is not included.

    Parameters
    ----------
    survey : Survey
    """
    mounting = survey.mounting and replace(survey.mounting, covariance=None)
    return Simulator(mounting, survey.scanner, survey.pos)


def read_simulator(path: Path | str) -> Simulator:
    r"""Read the Simulator of a simulator.toml.

    Sections [mounting], [scanner] and [pos] have the keys and units of survey.toml, [[effects]]
    those of scenario.toml; missing keys have the defaults of survey.toml.

    Raises ValueError for bad TOML, unknown keys and effects (with the most similar one) and
    impossible values; FileNotFoundError if there is no such file.

    Parameters
    ----------
    path : path

    >>> import mlscorr, pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp(), "simulator.toml")
    >>> _ = path.write_text("[scanner]\nrange_noise = 0.004\n")
    >>> mlscorr.read_simulator(path).scanner.range_noise
    0.004
    """
    file = read_toml(path, SimulatorFile, "a simulator")
    if file.mounting is None:
        mounting = None
    else:
        mounting = file.mounting.mounting()
    return Simulator(mounting, file.scanner.scanner(), file.pos.pos(), file.imperfections)


def write_simulator(simulator: Simulator, path: Path | str) -> None:
    """Write simulator.toml, replacing an existing file.

    Unstated values are omitted, so that a reader knows that they are assumed. Numbers of up to 12
    decimals in deg are read as the same to the last bit, others to 1e-15 rad.

    Parameters
    ----------
    simulator : Simulator
    path : path
    """
    scanner = simulator.scanner
    pos = simulator.pos
    mounting = simulator.mounting
    sections: dict[str, Any] = {
        "scanner": {
            "range_noise": float(scanner.range_noise),
            "angle_noise": _degrees(scanner.angle_noise),
            "lines_per_second": float(scanner.lines_per_second),
        },
        "pos": {
            "position_sigma": float(pos.position_sigma),
            "attitude_sigma": [_degrees(sigma) for sigma in pos.attitude_sigma],
            "correlation_time": float(pos.correlation_time),
        },
    }
    for section, assumed in (("scanner", scanner.assumed), ("pos", pos.assumed)):
        for name in assumed:
            del sections[section][name]
    if mounting is not None:
        lever_arm = np.asarray(mounting.lever_arm, dtype=float).tolist()
        boresight = {"lever_arm": lever_arm, "boresight": _angles(mounting.boresight)}
        sections = {"mounting": boresight, **sections}
    if pos.windows:
        sections["pos"]["windows"] = [
            dict(zip(WindowSection.model_fields, window, strict=True)) for window in pos.windows
        ]
    if simulator.effects:
        sections["effects"] = [effect.document() for effect in simulator.effects]
    Path(path).write_text(tomlkit.dumps(sections), encoding="utf-8")


def _degrees(radians):
    """Value in deg that is read as exactly these radians: rounded if that gives the same."""
    degrees = np.degrees(radians)
    rounded = np.round(degrees, DECIMALS)
    if np.radians(rounded) == radians:
        return float(rounded)
    return float(degrees)


def _angles(boresight):
    """Angles [a, b, c] in deg of R_L^P = Rz(c) Ry(b) Rx(a), rounded as above."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = boresight.as_euler("xyz", degrees=True)
    rounded = np.round(angles, DECIMALS) + 0.0
    repeated = Rotation.from_euler("xyz", rounded, degrees=True)
    if np.array_equal(repeated.as_quat(), boresight.as_quat()):
        return rounded.tolist()
    return angles.tolist()

"""Scenario of a simulated survey as one frozen value, and scenario.toml, which states it.

Lengths in m, times in s, angles in deg. Every default has its source.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from mlscorr.effects import Effect, in_order, make_effect
from mlscorr.io.store import read_toml
from mlscorr.io.trajectories import check_crs
from mlscorr.survey import WEEK

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float, float]
Kinds = Annotated[tuple[Literal["circle", "square"], ...], Field(min_length=1)]
Supports = Annotated[tuple[Literal["post", "wall", "road"], ...], Field(min_length=1)]
Spans = tuple[tuple[NotNegative, Positive], ...]  # (start, duration), from the drive's start


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class SceneScenario(_Part):
    """Objects along the way."""

    kind: Literal["street", "river", "mesh"] = "street"
    file: Path | None = None  # PLY or OBJ in map coordinates, for kind = "mesh"
    reflectance: Share = 0.3  # of a mesh: asphalt 0.2 to plaster 0.5 at 905-1550 nm
    house_height: tuple[Positive, Positive] = (6.0, 11.0)  # two to three stories
    gaps: Share = 0.4  # of the houses, followed by a gap in which a cross wall is visible
    trees: NotNegative = 4.0  # per 100 m of street
    cars: NotNegative = 5.0  # parked, per 100 m of street
    poles: NotNegative = 5.5  # per 100 m of street: lamps every 18 m
    markings: bool = False  # a dashed middle line, and a line along each curb of a street
    reference: bool = False  # write reference.ply: ground and walls as a static scan gives them

    @model_validator(mode="after")
    def _has_a_file(self):
        if (self.kind == "mesh") != (self.file is not None):
            raise ValueError('kind = "mesh" needs a file, and no other kind takes one')
        return self


class TargetScenario(_Part):
    """Surveyed targets, evenly spaced along the way."""

    control: Annotated[int, Field(ge=1)] = 16
    check: Annotated[int, Field(ge=0)] = 8
    kinds: Kinds = ("circle", "square")
    size: Positive = 0.6  # disc diameter or plate edge, as in Mao et al. 2015's class of target
    supports: Supports = ("post", "wall", "road")
    hidden: Share = 0.1  # of the targets, partly hidden by a narrow post in front
    survey_sigma: tuple[NotNegative, NotNegative] = (0.003, 0.003)  # across, up: total station


class PassScenario(_Part):
    """One pass along the way: forward or back, off the center line, after a pause."""

    direction: Literal["forward", "back"] = "forward"
    lateral: float = 0.0  # to the right of the center line as seen forward
    pause: Positive = 30.0  # before this pass; the trajectory has a gap there
    speed: Positive | None = None  # by default the drive's


class DriveScenario(_Part):
    """Motion of the vehicle, or a trajectory file instead."""

    duration: Positive = 60.0  # of the first pass, which sets the length of the way
    speed: Positive = 8.0  # m/s, usual of mobile mapping in towns
    stops: Spans = ()  # standing still in the first pass
    turns: Annotated[float, Field(ge=0, le=90)] = 15.0  # deg, swing of the way to each side
    u_turn: bool = False  # drive the way back in the same pass
    passes: Annotated[tuple[PassScenario, ...], Field(min_length=1)] = (PassScenario(),)
    pose_rate: Positive = 100.0  # Hz, usual of exported trajectories
    file: Path | None = None  # CSV, SBET, GNSS_RTK.pos or poses to follow; sets duration and way


class ScannerScenario(_Part):
    """Line scanner, or spinning scanner with rings of beams; with its own mounting."""

    kind: Literal["line", "spinning"] = "line"
    lever_arm: Vector = (0.10, -0.60, 0.40)  # right, forward, up
    boresight: Vector = (90.0, 0.0, 35.0)  # R_L^P = Rz(c) Ry(b) Rx(a): oblique plane, as usual
    lines_per_second: Positive = 150.0  # or turns a second of a spinning one (10 to 20)
    points_per_line: Annotated[int, Field(ge=8)] = 1000  # pulses a line and ring
    field_of_view: tuple[float, float] = (-180.0, 180.0)  # scan angles that are measured
    rings: tuple[float, ...] = (0.0,)  # elevations of a spinning scanner's beams
    range_noise: NotNegative = 0.004  # one sigma; data sheets: 3 (RIEGL VMQ) to 5 mm (VQ-250)
    angle_noise: NotNegative = 0.002  # one sigma, the paper's class of scanner
    beam_divergence: NotNegative = 0.0  # mrad, full angle; 0.35 for RIEGL VQ-250
    max_range: Positive = 100.0
    loss: Share = 0.0  # of returns with 1 % of full strength, as of asphalt 12 m away


class PosScenario(_Part):
    """GNSS and inertial sensors with their errors, or a series of errors from a file."""

    grade: Literal["tactical", "mems"] = "tactical"  # see pos_error for the figures of each
    gnss_rate: Positive = 1.0  # Hz, the paper's
    odometer: bool = False  # a wheel odometer, also used by the filter
    processing: Literal["smoothed", "filtered"] = "smoothed"  # post-processed, or in real time
    outages: Spans = ()  # no GNSS at all
    canyons: Spans = ()  # few satellites, multipath
    sky_view: bool = False  # outages and multipath from the height of the scene's walls
    error_file: Path | None = None  # a given error series (OB_GINS .err), instead of the sensors


class EffectScenario(_Part):
    """One effect by its name and parameters, as in mlscorr.effects."""

    model_config = ConfigDict(extra="allow", frozen=True)
    name: str

    @property
    def effect(self) -> Effect:
        """Return the effect as a value: an Effect of mlscorr.effects."""
        return make_effect(self.name, **(self.model_extra or {}))

    @model_validator(mode="after")
    def _is_known(self):
        make_effect(self.name, **(self.model_extra or {}))  # refuses impossible values
        return self


class Scenario(_Part):
    """Complete simulated survey; times count from the start of the drive."""

    name: str = "street"
    crs: str = "EPSG:32650"
    origin: Vector = (532_000.0, 3_374_000.0, 42.0)  # E, N, H at the start: Wuhan's UTM zone
    start_time: Annotated[float, Field(ge=0, lt=WEEK)] = 357_700.0  # s of the GPS week
    scene: SceneScenario = SceneScenario()
    targets: TargetScenario = TargetScenario()
    drive: DriveScenario = DriveScenario()
    scanner: Annotated[tuple[ScannerScenario, ...], Field(min_length=1)] = (ScannerScenario(),)
    pos: PosScenario = PosScenario()
    effects: tuple[EffectScenario, ...] = ()

    @property
    def imperfections(self) -> tuple[Effect, ...]:
        """Effects as values (tuple of Effect), in the order in which they act."""
        return in_order(effect.effect for effect in self.effects)

    @property
    def end(self) -> float | None:
        """Latest end of the last pass, from the start of the drive; None for a file."""
        if self.drive.file is not None:
            return None
        factors = [self.drive.speed / (p.speed or self.drive.speed) for p in self.drive.passes]
        return self.drive.duration * sum(factors) + sum(p.pause for p in self.drive.passes[1:])

    @model_validator(mode="after")
    def _holds_its_events(self):
        if self.end is not None and self.end > WEEK:
            raise ValueError(f"the drive of {self.end:g} s is longer than a week of {WEEK:g} s")
        spans = [("drive.stops", self.drive.stops)]
        spans += [("pos.outages", self.pos.outages), ("pos.canyons", self.pos.canyons)]
        events = [
            (f"{key} of {length:g} s from", start, start + length)
            for key, spans_of_key in spans
            for start, length in spans_of_key
        ]
        events += [(f"{e.name} at", e.time, e.time) for e in self.imperfections if e.moment()]
        for what, start, end in events:
            if self.end is not None and end > self.end:
                raise ValueError(f"{what} {start:g} s is outside the drive of {self.end:g} s")
        return self


DEMO = Scenario(  # slow and coarse, so that a million points are enough
    name="demo",
    drive=DriveScenario(speed=4.2),
    scanner=(ScannerScenario(lines_per_second=75.0, points_per_line=400),),
    # in real time, not post-processed, so that the drift is easy to see
    pos=PosScenario(processing="filtered", outages=((25.0, 25.0),), canyons=((4.0, 12.0),)),
)
FILES = (("scene", "file"), ("drive", "file"), ("pos", "error_file"))  # that a scenario may name


def read_scenario(path: Path | str) -> Scenario:
    """Read the scenario of a TOML file; file names are relative to it.

    Raises ValueError for bad TOML, unknown keys (with the most similar one) and impossible values;
    FileNotFoundError for missing files.

    Parameters
    ----------
    path : path
    """
    path = Path(path)
    scenario = read_toml(path, Scenario, "a scenario")
    check_crs(scenario.crs)
    for part, key in FILES:
        section = getattr(scenario, part)
        if (name := getattr(section, key)) is None:
            continue
        file = path.parent / name
        if not file.is_file():
            raise FileNotFoundError(f"{part}.{key} of {path} names {file}, which does not exist.")
        scenario = scenario.model_copy(
            update={part: section.model_copy(update={key: file.absolute()})}
        )
    return scenario


def scenario_files(scenario: Scenario) -> list[Path]:
    """Paths of the files named in a scenario, which a simulation must not overwrite.

    Parameters
    ----------
    scenario : Scenario
    """
    named = (getattr(getattr(scenario, part), key) for part, key in FILES)
    return [file for file in named if file is not None]

"""Unnamed mechanisms: errors drawn at random from a grammar, for training and grading.

Each moves points in one direction, by a function of a covariate that varies along the drive. None
is in the library of effects. Pairs of direction and covariate are split by a hash: one half is for
training and setting of constants, the other for grading a diagnosis, and no pair is in both.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.effects import run_file
from mlscorr.simulate.scene import UP
from mlscorr.simulate.survey import PulseBlock, SimulatedSurvey
from mlscorr.survey import Mounting, Trajectory

Described = dict[str, tuple[Callable, tuple[str, float], tuple[str, str]]]
MOMENT = 0.3  # s to each side, over which speed, turns and acceleration are computed
EPOCH = 0.1  # s between the times at which the motion is computed
DIRECTIONS = {  # words of which a correct hint has one; unit; largest size
    "beam": ("range error", "m", 0.5),
    "scan": ("scan angle error|across|roll error|range error", "rad", 0.02),
    "across": ("across|heading error|pitch error|along", "rad", 0.02),
    "roll": ("roll error|right|height|scan angle", "rad", 0.05),
    "pitch": ("pitch error|height|along|across", "rad", 0.05),
    "heading": ("heading error|right|along|across", "rad", 0.05),
    "east": ("easting|northing|right|along", "m", 1.0),
    "north": ("easting|northing|right|along", "m", 1.0),
    "height": ("height error|pitch error|roll error", "m", 1.0),
    "right": ("right|roll error|heading error|easting|northing", "m", 1.0),
    "forward": ("along|time error|pitch error|easting|northing", "m", 1.0),
    "clock": ("time error|along|easting|northing", "s", 0.2),
}
COVARIATES = {  # words of which a correct hint has one
    "range": "range|incidence|intensity",
    "scan angle": "scan angle|turn of the scanner|incidence",
    "side": "scan angle|turn of the scanner|range",
    "height of the point": "scan angle|turn of the scanner|range|incidence",
    "speed": "speed|acceleration|time",
    "turn rate": "turn|heading|time|place",
    "acceleration": "acceleration|speed|time",
    "climb": "pitch|time|place|acceleration",
    "roll": "roll|turn|time|place",
    "pitch": "pitch|time|place|acceleration",
    "roll rate": "roll rate|turn|time",
    "heading": "heading|pass|place|time",
    "elapsed": "time|pass",
    "elapsed in the pass": "time|pass|place",
    "way": "place|time",
    "place": "place|time|map",
}
SHAPES = (
    "linear",
    "square",
    "absolute",
    "threshold",
    "wave",
    "saturating",
    "bump",
    "sawtooth",
)


@dataclass(frozen=True)
class RecordedPoints:
    """Points as recorded, with the data used for georeferencing.

    Parameters
    ----------
    gps_time : (n,) array
        Units: s.
    xyz : (n, 3) array
        On the map. Units: m.
    scanner_xyz : (n, 3) array
        In the scanner's frame. Units: m.
    trajectory : Trajectory
        Of all passes.
    mounting : Mounting
    """

    gps_time: np.ndarray
    xyz: np.ndarray
    scanner_xyz: np.ndarray
    trajectory: Trajectory
    mounting: Mounting


@dataclass(frozen=True)
class DisplacedSurvey(SimulatedSurvey):
    """SimulatedSurvey with one scanner whose recorded points are displaced.

    ``move`` is a function of RecordedPoints that returns displacements (n, 3) in m on the map.
    """

    move: Any = None

    @classmethod
    def of(cls, survey: SimulatedSurvey, move: Callable) -> "DisplacedSurvey":
        """Return the same survey, displaced.

        Parameters
        ----------
        survey : SimulatedSurvey
        move : function
            Returns displacements of RecordedPoints, (n, 3) in m on the map.
        """
        known = {field.name: getattr(survey, field.name) for field in fields(survey)}
        return cls(**known, move=move)

    def blocks(self, **size: int) -> Iterator[PulseBlock]:
        """Yield blocks of the survey with displaced points."""
        for block in super().blocks(**size):
            cloud = block.cloud
            poses = (self.trajectory, self.mounting)
            points = RecordedPoints(cloud.gps_time, cloud.xyz, block.pulses.scanner_xyz, *poses)
            yield replace(block, cloud=replace(cloud, xyz=cloud.xyz + self.move(points)))


@dataclass(frozen=True)
class Mechanism:
    """One sentence of the grammar: a direction, a covariate, and a function of it."""

    direction: str
    covariate: str
    shape: str

    @property
    def name(self) -> str:
        """Sentence of the mechanism."""
        return f"{self.direction} by {self.covariate}, {self.shape}"

    @property
    def unit(self) -> tuple[str, float]:
        """Unit of its size, and the largest size that a user would not notice immediately."""
        return DIRECTIONS[self.direction][1:]

    @property
    def hint(self) -> tuple[str, str]:
        """Words of a correct hint, which has one of each; alternatives are separated by |."""
        return DIRECTIONS[self.direction][0], COVARIATES[self.covariate]

    @property
    def is_for_training(self) -> bool:
        """True if it may be used for training, by a hash of direction and covariate, for any
        shape.
        """
        pair = f"{self.direction} by {self.covariate}".encode()
        return hashlib.sha256(pair).digest()[0] % 2 == 0

    def __call__(self, points: RecordedPoints, size: float, rng: np.random.Generator) -> np.ndarray:
        """Displacements of points: (n, 3) in m on the map.

        Parameters
        ----------
        points : RecordedPoints
        size : float
            Size in its unit; the displacement is linear in it.
        rng : Generator
            For positions of thresholds and wavelengths.
        """
        a, b = rng.random(2)
        value = _shaped(self.shape, _covariate(self.covariate, points), a, b)
        return size * value[:, None] * _direction(self.direction, points)


def mechanisms() -> tuple[Mechanism, ...]:
    """Return all sentences of the grammar."""
    return tuple(Mechanism(*parts) for parts in product(DIRECTIONS, COVARIATES, SHAPES))


def training_mechanisms() -> tuple[Mechanism, ...]:
    """Return the half for which constants may be set."""
    return tuple(each for each in mechanisms() if each.is_for_training)


def described(known: Iterable[Mechanism]) -> Described:
    """Function, unit with largest size, and hint of each mechanism, by name.

    Parameters
    ----------
    known : iterable of Mechanism
    """
    return {each.name: (each, each.unit, each.hint) for each in known}


def load_mechanisms(path: Path) -> Described:
    """Load the same from a file with MECHANISMS (functions), UNITS (unit, largest) and LEADS.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        If one of them is missing, or the file cannot be run.
    FileNotFoundError
        If the file is missing.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path} does not exist. It should define MECHANISMS.")
    module = run_file(path)
    for name in ("MECHANISMS", "LEADS", "UNITS"):
        if set(getattr(module, name, {})) != set(getattr(module, "MECHANISMS", {"": None})):
            raise ValueError(
                f"{path} has no {name}. A file of mechanisms needs MECHANISMS (functions), LEADS "
                "(words) and UNITS (unit and largest size)."
            )
    return {
        name: (function, module.UNITS[name], module.LEADS[name])
        for name, function in module.MECHANISMS.items()
    }


def _shaped(name, u, a, b):
    """Values of a covariate u (n,) from about -1 to 1, shaped by two numbers from 0 to 1."""
    return {
        "linear": u,
        "square": u**2,
        "absolute": np.abs(u - (a - 0.5)),
        "threshold": (u > a - 0.5).astype(float),
        "wave": np.sin(2 * np.pi * ((0.5 + 2.0 * a) * u + b)),
        "saturating": 1.0 - np.exp(-(u + 1.0) * (1.0 + 4.0 * a)),
        "bump": np.exp(-0.5 * ((u - 1.2 * (a - 0.5)) / (0.15 + 0.35 * b)) ** 2),
        "sawtooth": np.mod((0.5 + 1.5 * a) * u + b, 1.0) - 0.5,
    }[name]


def _direction(name, points):
    """Displacements (n, 3) for one unit: a meter, a radian, a second."""
    pose = points.trajectory.at(points.gps_time)
    right, forward, up = np.moveaxis(pose.attitude.as_matrix(), 2, 0)
    arm = points.xyz - pose.position
    sight = arm - pose.attitude.apply(points.mounting.lever_arm)
    axis = pose.attitude.apply(points.mounting.boresight.apply(UP))
    if name in ("east", "north", "height"):
        return np.broadcast_to(np.eye(3)[("east", "north", "height").index(name)], sight.shape)
    if name == "clock":
        motion = _motion(points)
        return motion["velocity"] + np.cross(motion["turn"], arm)
    away = np.linalg.norm(sight, axis=1, keepdims=True)
    return {
        "beam": sight / away,
        "scan": np.cross(axis, sight),
        "across": axis * away,
        "roll": np.cross(forward, arm),
        "pitch": np.cross(right, arm),
        "heading": np.cross(-up, arm),
        "right": right,
        "forward": forward,
    }[name]


def _covariate(name, points):
    """Values (n,), mostly from -1 to 1 in any part of the survey."""
    trajectory = points.trajectory
    pose = trajectory.at(points.gps_time)
    sight = np.linalg.norm(points.scanner_xyz, axis=1)
    if name == "range":
        return sight / 15.0 - 1.0
    if name == "scan angle":
        return np.arctan2(points.scanner_xyz[:, 1], points.scanner_xyz[:, 0]) / np.pi
    if name in ("side", "height of the point"):
        body = pose.attitude.inv().apply(points.xyz - pose.position)
        if name == "side":
            return body[:, 0] / 15.0
        return body[:, 2] / 5.0
    if name == "heading":
        return pose.attitude.apply([0.0, 1.0, 0.0])[:, 0]  # the same for angles a full turn apart
    if name == "elapsed":
        return _spread(points.gps_time, trajectory.gps_time)
    if name == "elapsed in the pass":
        start, end = trajectory.passes[trajectory.segment(points.gps_time)].T
        return 2 * (points.gps_time - start) / (end - start) - 1
    if name in ("way", "place"):
        centred = trajectory.position[:, :2] - trajectory.position[:, :2].mean(axis=0)
        along = np.linalg.svd(centred, full_matrices=False)[2][int(name == "place")]
        return _spread(points.xyz[:, :2] @ along, trajectory.position[:, :2] @ along)
    motion = _motion(points)
    whole = _motion_table(trajectory)
    return _spread(motion[name], whole[name])


def _spread(values, whole):
    """Scale values so that the 5th and 95th percentiles of the whole become -1 and 1."""
    low, high = np.percentile(whole, [5.0, 95.0])
    return np.clip((2 * values - low - high) / max(high - low, 1e-9), -1.5, 1.5)


def _motion(points):
    """Motion of the vehicle at the times of points (n,)."""
    table = _motion_table(points.trajectory)

    def when_seen(values):
        return np.interp(points.gps_time, table["time"], values)

    return {name: np.apply_along_axis(when_seen, 0, values) for name, values in table.items()}


def _motion_table(trajectory):
    """Speed (m/s), turn rate (rad/s), acceleration (m/s^2) and more of each pass, by time."""
    parts: dict[str, list] = {}
    for start, end in trajectory.passes:
        time = np.linspace(start, end, max(4, int((end - start) / EPOCH)))
        late, early = (trajectory.at(np.clip(time + s, start, end)) for s in (MOMENT, -MOMENT))
        span = (late.gps_time - early.gps_time)[:, None]
        velocity = (late.position - early.position) / span
        turn = (late.attitude * early.attitude.inv()).as_rotvec() / span
        right, forward, _ = np.moveaxis(trajectory.at(time).attitude.as_matrix(), 2, 0)
        speed = np.linalg.norm(velocity, axis=1)
        values = {
            "time": time,
            "velocity": velocity,
            "turn": turn,
            "speed": speed,
            "turn rate": turn[:, 2],
            "acceleration": np.gradient(speed, time),
            "climb": velocity[:, 2],
            "roll": right[:, 2],
            "pitch": forward[:, 2],
            "roll rate": np.einsum("ni,ni->n", turn, forward),
        }
        for name, columns in values.items():
            parts.setdefault(name, []).append(columns)
    return {name: np.concatenate(columns) for name, columns in parts.items()}

"""A survey as recorded, and the assumed accuracies of its instruments where no file states them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from mlscorr.survey.clouds import CloudFile, CloudInMemory, PointCloud
from mlscorr.survey.summary import Summary
from mlscorr.survey.targets import ControlPoints
from mlscorr.survey.trajectory import Mounting, Trajectory
from mlscorr.wording import counted

SEARCH_RADIUS = 10.0  # m; a lone GNSS receiver errs by 8 m (GPS SPS 2020, 95 %)


@dataclass(frozen=True)
class Assumption:
    """Accuracy that nobody stated: a default is used, and no test relies on it.

    Parameters
    ----------
    key : str
        Key of survey.toml that states it, such as ``pos.position_sigma``.
    value : float or tuple of float
        The default.
    unit : str
        Unit used in survey.toml.
    """

    key: str
    value: float | tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class Scanner:
    """Assumed properties of a scanner.

    Parameters
    ----------
    range_noise : float
        One sigma. Units: m.
    angle_noise : float
        One sigma. Units: rad.
    lines_per_second : float
    assumed : tuple of str
        Names of the noise values that nobody stated.

    >>> from mlscorr.survey import Scanner
    >>> Scanner(range_noise=0.003, lines_per_second=200.0).range_noise
    0.003
    """

    range_noise: float = 0.005  # m, typical of mobile line scanners (RIEGL VQ-250 data sheet)
    angle_noise: float = np.radians(0.002)  # the paper's class of scanner
    lines_per_second: float = 100.0
    assumed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Pos:
    """Assumed accuracy of the POS, used if the trajectory has no sigma columns.

    Parameters
    ----------
    position_sigma : float
        Of each axis. Units: m.
    attitude_sigma : (3,) array
        Of roll, pitch, heading. Units: rad.
    correlation_time : float
        Units: s.
    windows : tuple of (start, length, factor, shape)
        Intervals (s) with an additional position error, as in a GNSS outage, of at most factor
        sigmas. Shape ``rise`` grows toward the end, ``hump`` toward the middle.
    assumed : tuple of str
        Names of the values that nobody stated.

    >>> from mlscorr.survey import Pos
    >>> Pos(position_sigma=0.05, correlation_time=60.0).correlation_time
    60.0
    """

    position_sigma: float = 0.02  # m, nominal for the paper's SPAN-FSAS in good GNSS
    attitude_sigma: np.ndarray = field(  # rad: roll, pitch, heading; the paper's section 3
        default_factory=lambda: np.array([1.1e-4, 1.1e-4, 2.45e-4])
    )
    correlation_time: float = 30.0  # s, the paper's section 3.1.1
    windows: tuple[tuple[float, float, float, str], ...] = ()
    assumed: tuple[str, ...] = ()


@dataclass(frozen=True)
class InputFile:
    """Input file and its state when it was read.

    Parameters
    ----------
    what : str
        Description of the file.
    path : Path
    state : tuple of int or str
        Size (bytes), time of change (ns; a store's ETag) and digest of both ends when its reading
        began; zeros without a file.
    """

    what: str
    path: Path
    state: tuple[int | str, ...]


@dataclass(frozen=True)
class ProjectNames:
    """Names for the head of a report and a certificate; empty if not given.

    Parameters
    ----------
    title, client, project, instrument, operator : str

    >>> from mlscorr.survey import ProjectNames
    >>> ProjectNames(client="City of Wuhan").known
    {'Client': 'City of Wuhan'}
    """

    title: str = ""
    client: str = ""
    project: str = ""
    instrument: str = ""
    operator: str = ""

    @property
    def known(self) -> dict[str, str]:
        """Given names except the title, in the order of a title page."""
        names = {
            "Client": self.client,
            "Project": self.project,
            "Instrument": self.instrument,
            "Operator": self.operator,
        }
        return {what: name for what, name in names.items() if name}


@dataclass(frozen=True)
class MountedScanner:
    """One of several scanners on a vehicle.

    Parameters
    ----------
    name : str
    scanner : Scanner
    mounting : Mounting or None
    clouds : tuple of CloudFile
        Files of this scanner.
    """

    name: str
    scanner: Scanner
    mounting: Mounting | None
    clouds: tuple[CloudFile, ...]


@dataclass(frozen=True, repr=False)
class Survey(Summary):
    """One mobile survey as recorded: clouds, trajectory, mounting, control and assumed accuracies.

    Parameters
    ----------
    name : str
    path : Path
        Of survey.toml.
    crs : str or None
    clouds : tuple of CloudFile
    trajectory : Trajectory
    mounting : Mounting or None
        Mounting of a single scanner; None if there are several.
    control, check : ControlPoints
        Points used in the estimate, and independent points that never are.
    scanner : Scanner
        The single scanner; ignored if there are several.
    pos : Pos
    reference : Path, optional
        A reference surface in the cloud's coordinates.
    search_radius : float
        Largest distance of a target in the cloud from its surveyed point. Units: m.
    use_ties : bool
        True if a correction may use tie features in overlaps.
    notes : tuple of str
        Findings of the readers, for the report.
    layouts : tuple of str
        Notes on how foreign tables were interpreted.
    inputs : tuple of InputFile
        survey.toml and every file that it names.
    scanners : tuple of MountedScanner
        Given if there are several. Each cloud file belongs to one of them; a file with points of
        several appears once for each.
    corrected_by : tuple of str
        Names of the control points used in an earlier correction of trajectory and clouds.
    is_remounted : bool
        True if a calibration changed the mounting while the clouds still follow the recorded one.
    project : ProjectNames
    beam_origin : (3,) array, optional
        Origin of the beams in body axes, estimated from the cloud if no mounting is given. Units:
        m.
    excluded : ControlPoints
        Control points that the user excluded from the estimate.
    included : tuple of str
        Names of the control points that are used regardless of the tests.
    """

    name: str
    path: Path
    crs: str | None
    clouds: tuple[CloudFile, ...]
    trajectory: Trajectory
    mounting: Mounting | None
    control: ControlPoints
    check: ControlPoints
    scanner: Scanner = field(default_factory=Scanner)
    pos: Pos = field(default_factory=Pos)
    reference: Path | None = None
    search_radius: float = SEARCH_RADIUS
    use_ties: bool = True
    notes: tuple[str, ...] = ()
    layouts: tuple[str, ...] = ()
    inputs: tuple[InputFile, ...] = ()
    scanners: tuple[MountedScanner, ...] = ()
    corrected_by: tuple[str, ...] = ()
    is_remounted: bool = False
    project: ProjectNames = field(default_factory=ProjectNames)
    beam_origin: np.ndarray | None = None
    excluded: ControlPoints = field(default_factory=ControlPoints.none)
    included: tuple[str, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        clouds: PointCloud | Sequence[PointCloud] | tuple[ArrayLike, ...],
        trajectory: Trajectory,
        control: ControlPoints,
        check: ControlPoints | None = None,
        mounting: Mounting | None = None,
        crs: str | None = None,
        name: str = "arrays",
        scanner: Scanner | None = None,
        pos: Pos | None = None,
        search_radius: float = SEARCH_RADIUS,
        use_ties: bool = True,
    ) -> Survey:
        """Make a survey from data in memory, without files.

        Parameters
        ----------
        clouds : PointCloud, or a sequence of them
            Each acts as a file. Or arrays: (xyz, gps_time) or (xyz, gps_time, intensity).
        trajectory : Trajectory
        control : ControlPoints
        check : ControlPoints, optional
            Independent points, not used in any estimate.
        mounting : Mounting, optional
            Scanner to body; needed by a calibration, optional for a correction.
        crs : str, optional
            For example ``EPSG:32650``.
        name : str
        scanner, pos : Scanner, Pos, optional
            Assumed accuracies.
        search_radius : float
            Largest distance of a target from its surveyed position. Units: m.
        use_ties : bool

        Returns
        -------
        Survey
            Accepted by every command; the ``write`` method of a result makes LAZ files of its
            clouds.

        Raises
        ------
        ValueError
            If a cloud is empty or has no point within the trajectory; see also
            ``PointCloud.from_arrays``.

        >>> import numpy as np
        >>> from mlscorr.survey import ControlPoints, Survey, Trajectory
        >>> place = np.array([[532_000.0, 3_374_000.0, 42.0], [532_001.0, 3_374_000.0, 42.0]])
        >>> time = np.array([357_700.0, 357_700.1])
        >>> path = Trajectory.from_arrays(time, place, np.zeros((2, 3)))
        >>> control = ControlPoints.from_arrays(["T01"], place[:1], [0.003] * 3, "circle", 0.6)
        >>> Survey.from_arrays((place, time), path, control).points
        2
        """
        parts = _clouds_of(clouds)
        nothing = control[[]]
        files = []
        for number, cloud in enumerate(parts, start=1):
            inside = trajectory.segment(cloud.gps_time) >= 0
            if not inside.any():
                first, last = trajectory.gps_time[[0, -1]]
                raise ValueError(
                    f"None of the {counted(len(cloud), 'point')} of cloud {number} has a "
                    f"gps_time within the trajectory [{first:.3f}, {last:.3f}] s. Cloud and "
                    "trajectory may use different time systems: add the constant difference to "
                    "the times."
                )
            stem = name if len(parts) == 1 else f"{name}-{number}"
            files.append(
                CloudInMemory(
                    Path(f"{stem}.laz"), len(cloud), 0.0, "of the trajectory", cloud=cloud, crs=crs
                )
            )
        return cls(
            name=name,
            path=Path(name),
            crs=crs,
            clouds=tuple(files),
            trajectory=trajectory,
            mounting=mounting,
            control=control,
            check=nothing if check is None else check,
            scanner=scanner or Scanner(assumed=("range_noise", "angle_noise")),
            pos=pos or Pos(assumed=("position_sigma", "attitude_sigma", "correlation_time")),
            search_radius=search_radius,
            use_ties=use_ties,
        )

    @cached_property
    def surveyed(self) -> ControlPoints:
        """Control points, check points and excluded points, in this order."""
        return self.control + self.check + self.excluded

    def choosing(self, exclude: Collection[str] = (), include: Collection[str] = ()) -> Survey:
        """Return the survey with some control points excluded and others used in any case.

        Parameters
        ----------
        exclude : collection of str
            Names of control points to exclude; their residuals are reported.
        include : collection of str
            Names of control points to use even if matching or the other points contradict them,
            including points excluded before.

        Raises
        ------
        ValueError
            If a name is not a control point (with the most similar name), or is given in both.
        """
        return choosing(self, exclude, include)

    @property
    def cloud_paths(self) -> tuple[Path, ...]:
        """Paths of the cloud files, each once."""
        return tuple(dict.fromkeys(file.path for file in self.clouds))

    @property
    def points(self) -> int:
        """Number of points in all cloud files."""
        return sum(file.points for file in self.clouds)

    def _overview(self):
        """Return the rows that a notebook shows."""
        start, end = self.trajectory.gps_time[[0, -1]]
        gaps = len(self.trajectory.gaps)
        driven = f"{len(self.trajectory)} epochs, {start:.1f} to {end:.1f} s, gaps {gaps}"
        mounted = "not given" if self.mounting is None else "given"
        if self.scanners:
            mounted = ", ".join(scanner.name for scanner in self.scanners)
        return [
            ("name", self.name),
            ("coordinates", self.crs or "not stated"),
            ("clouds", f"{counted(len(self.cloud_paths), 'file')}, {self.points} points"),
            ("trajectory", driven),
            ("surveyed", f"{len(self.control)} control and {len(self.check)} check points"),
            ("mounting", mounted),
        ]

    @property
    def assumed_pos(self) -> tuple[Assumption, ...]:
        """Accuracies of the POS that neither the trajectory nor survey.toml states."""
        trajectory = self.trajectory
        pos = self.pos
        angles = tuple(np.degrees(pos.attitude_sigma).round(9).tolist())
        defaults: dict[str, tuple[np.ndarray | None, float | tuple[float, ...], str]] = {
            "position_sigma": (trajectory.position_sigma, pos.position_sigma, "m"),
            "attitude_sigma": (trajectory.attitude_sigma, angles, "deg"),
            "correlation_time": (None, pos.correlation_time, "s"),
        }
        return tuple(
            Assumption(f"pos.{name}", value, unit)
            for name, (stated, value, unit) in defaults.items()
            if stated is None and name in pos.assumed
        )

    @property
    def has_assumed_position(self) -> bool:
        """True if a default replaces the sigma of the POS position."""
        return any(row.key == "pos.position_sigma" for row in self.assumed_pos)

    @property
    def assumed_scanner(self) -> tuple[Assumption, ...]:
        """Noise values of the single scanner that survey.toml does not state."""
        scanner = self.scanner
        angle = float(np.degrees(scanner.angle_noise).round(9))
        defaults = {"range_noise": (scanner.range_noise, "m"), "angle_noise": (angle, "deg")}
        return tuple(
            Assumption(f"scanner.{name}", value, unit)
            for name, (value, unit) in defaults.items()
            if name in scanner.assumed
        )

    @property
    def assumed_mounting(self) -> Mounting:
        """Mounting, or an assumed one if none is known.

        Assumed are body axes at the beam origin estimated from the cloud, or else at the navigation
        center.
        """
        if self.beam_origin is None:
            origin = np.zeros(3)
        else:
            origin = self.beam_origin
        return self.mounting or Mounting(origin, Rotation.identity())

    @cached_property
    def by_scanner(self) -> dict[str, Survey]:
        """Survey of each scanner by its name, with its files, mounting and prior.

        With one scanner: the survey itself, under an empty name.
        """
        parts = {
            mounted.name: replace(self, **vars(mounted) | {"name": self.name, "scanners": ()})
            for mounted in self.scanners
        }
        return parts or {"": self}

    def of(self, file: CloudFile) -> Survey:
        """Return the survey of the scanner that wrote a file.

        Parameters
        ----------
        file : CloudFile
        """
        return next((part for part in self.by_scanner.values() if file in part.clouds), self)

    @property
    def mountings(self) -> tuple[Mounting | None, ...]:
        """Mounting of each scanner."""
        return tuple(part.mounting for part in self.by_scanner.values())

    def with_mountings(self, mountings: Iterable[Mounting]) -> Survey:
        """Return the survey with another mounting for each scanner.

        Parameters
        ----------
        mountings : iterable of Mounting
        """
        if not self.scanners:
            return replace(self, mounting=next(iter(mountings)))
        pairs = zip(self.scanners, mountings, strict=True)
        return replace(self, scanners=tuple(replace(part, mounting=m) for part, m in pairs))

    @cached_property
    def scanner_numbers(self) -> np.ndarray:
        """Index of the scanner of each cloud file, from 0."""
        numbers = np.zeros(len(self.clouds), int)
        for number, part in enumerate(self.by_scanner.values()):
            numbers[[self.clouds.index(file) for file in part.clouds]] = number
        return numbers

    def rows_by_scanner(self, scanner: np.ndarray) -> Iterator[tuple[Survey, np.ndarray | slice]]:
        """Yield the survey of each scanner, and the rows it measured.

        Parameters
        ----------
        scanner : (n,) int array
            Index of the scanner of each row, from 0.

        Yields
        ------
        survey : Survey
        rows : (n,) bool array, or a slice of all
        """
        for number, part in enumerate(self.by_scanner.values()):
            rows = slice(None)
            if self.scanners:
                rows = scanner == number
            yield part, rows

    def check_one_scanner(self, verb: str) -> None:
        """Refuse surveys with several scanners, for steps that rest on one mounting.

        Parameters
        ----------
        verb : str
            Verb of the step, for the message.

        Raises
        ------
        ValueError
            If there are several; the message names them and the remedy.
        """
        if self.scanners:
            names = ", ".join(mounted.name for mounted in self.scanners)
            raise ValueError(
                f"{self.path} has {len(self.scanners)} scanners ({names}), but {verb} needs a "
                "single mounting. Make a survey.toml for each scanner with its files under "
                "[cloud] (split files with points of several), its [mounting] and its [scanner]."
            )


def _clouds_of(clouds):
    """Return a list of PointClouds from one, several or arrays."""
    if isinstance(clouds, PointCloud):
        parts = [clouds]
    elif all(isinstance(part, PointCloud) for part in clouds):
        parts = list(clouds)
    else:
        parts = [PointCloud.from_arrays(*clouds)]
    if not parts or not all(map(len, parts)):
        raise ValueError("A survey needs clouds with at least one point each.")
    return parts


class SurveyFileError(ValueError):
    """Fault in survey.toml that only the data or the processing reveal."""


def check_survey(value: object) -> None:
    """Refuse a value that is not a survey, such as its path.

    Parameters
    ----------
    value : object
        Passed in place of a Survey.

    Raises
    ------
    TypeError
        With the remedy.
    """
    if not isinstance(value, Survey):
        raise TypeError(
            f"Expected a Survey, not {str(value)[:60]!r} ({type(value).__name__}). Read one with "
            "mlscorr.read_survey(path)."
        )


def check_rng(value: object) -> None:
    """Refuse a value that is not a random generator, such as a seed.

    Parameters
    ----------
    value : object
        Passed as rng.

    Raises
    ------
    ValueError
        With the remedy.
    """
    if not isinstance(value, np.random.Generator):
        raise ValueError(
            f"rng = {str(value)[:60]!r} is not a random generator. Create one with "
            "numpy.random.default_rng(seed)."
        )


def choosing(recording: Any, exclude: Collection[str], include: Collection[str]) -> Any:
    """A survey or project with some control points kept out of the estimate, others kept in it.

    Parameters
    ----------
    recording : Survey or ProjectParts
        With ``control``, ``check``, ``excluded`` and ``included``.
    exclude, include : collection of str
        As of ``Survey.choosing``.

    Raises
    ------
    ValueError
        As ``Survey.choosing``.
    """
    points = recording.control + recording.excluded
    for key, names in (("exclude", exclude), ("include", include)):
        for name in names:
            _check_choice(key, name, points, recording.check)
    if both := sorted(set(exclude) & set(include)):
        raise SurveyFileError(f"exclude and include both list {', '.join(both)}. Choose one.")
    out = (set(recording.excluded.name) | set(exclude)) - set(include)
    is_out = np.isin(np.array(points.name, dtype=str), list(out))
    kept_in = (set(recording.included) | set(include)) - set(exclude)
    included = tuple(name for name in points.name if name in kept_in)
    return replace(recording, control=points[~is_out], excluded=points[is_out], included=included)


def _check_choice(key, name, points, check):
    """Refuse a name that is no control point."""
    if name in points.name:
        return
    if name in check.name:
        raise SurveyFileError(
            f"{key} lists {name}, which is a check point and never used in an estimate. List "
            "control points only, or change its role in the control list."
        )
    near = get_close_matches(name, points.name, n=1, cutoff=0.0)
    hint = f"; the nearest name is {near[0]}" if near else ""
    raise SurveyFileError(
        f"{key} lists {name}, which is not among the {counted(len(points), 'control point')}{hint}."
    )

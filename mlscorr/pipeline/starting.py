"""``init``: a survey.toml for the files in a folder; ambiguities are listed, never guessed.

Each question is answered by a temporary example, so that reading continues to the next: all of them
are asked at once, and their values in survey.toml remain open.
"""

import os
import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mlscorr.io.clouds import find_copies, is_foreign, read_chunks, read_layout, recorded_points
from mlscorr.io.store import (
    PLACE_OF_CRS,
    OpenPlace,
    OpenQuestion,
    files_like,
    glance,
    output_file,
    places_of,
    validate,
)
from mlscorr.io.surveys import (
    FILE_NAME,
    SIMULATED,
    FileRole,
    PlannedSurveyFile,
    read_survey,
    sort_files,
)
from mlscorr.io.tables import AxesError, ControlSection, holds_points, read_control
from mlscorr.matching import SETTINGS as MATCHING
from mlscorr.pipeline.beams import line_rate
from mlscorr.pipeline.choice import choose_control, choose_crs
from mlscorr.pipeline.drives import Cloud, choose_accuracy, choose_trajectory
from mlscorr.pipeline.settings import SETTINGS
from mlscorr.pipeline.survey_text import SurveyText
from mlscorr.survey import PointCloud, Trajectory
from mlscorr.wording import counted


@dataclass(frozen=True)
class StartedSurvey:
    """survey.toml that is complete once its open values are filled in, and the role of each file.

    Parameters
    ----------
    path : Path
        Path of the survey.toml to write.
    text : str
    roles : tuple of FileRole
        ``none`` and ``table`` are not used.
    notes : tuple of str
        Notes from reading it.
    questions : tuple of str
        Sentences on values that only the user knows.
    places : tuple of OpenPlace
        Open values in text, which answer the questions.
    """

    path: Path
    text: str
    roles: tuple[FileRole, ...]
    notes: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()
    places: tuple[OpenPlace, ...] = ()

    def write(self) -> Path:
        """Write survey.toml atomically, and return its path.

        Raises
        ------
        ValueError
            If there is one already.
        OSError
        """
        _check_free(self.path)
        with output_file(self.path) as part:
            part.write_text(self.text, encoding="utf-8")
        return self.path


def init(
    folder: str | Path, out: str | Path | None = None, given: Mapping[str, Any] | None = None
) -> StartedSurvey:
    """List the contents of a folder, and make a survey.toml of it that runs.

    Parameters
    ----------
    folder : path
        With LAS or LAZ files, a trajectory, and control, if any.
    out : path, optional
        Path of the survey.toml, in the folder by default.
    given : mapping, optional
        Contents of survey.toml, by section, with priority over findings.

    Returns
    -------
    StartedSurvey
        Nothing is written yet.

    Raises
    ------
    ValueError
        If survey.toml exists, or files are missing or do not match; with the remedy.
    OSError
        If the folder of out does not exist.

    >>> import mlscorr, numpy as np, tempfile
    >>> from mlscorr.simulate import Scenario, simulate
    >>> folder = tempfile.mkdtemp()
    >>> short = Scenario(drive={"duration": 4.0}, targets={"control": 3, "check": 1})
    >>> simulate(short, np.random.default_rng(1)).write(folder)
    >>> mlscorr.init(folder, f"{folder}/started.toml").write().name
    'started.toml'
    """
    folder = Path(folder)
    given = given or {}
    if not folder.is_dir():
        raise ValueError(f"{folder} is not a folder. Give the one with the clouds.")
    path = folder / FILE_NAME if out is None else Path(out)
    _check_free(path)
    if not path.parent.is_dir():
        raise OSError(f"{path.parent} is not a folder, so {path.name} can't be written there.")
    _validate(given)
    answers = _Answers(folder, given)
    with glance():
        roles = sort_files(folder)
        while True:
            try:
                _ask_of_control(folder, answers, roles)
                text, used = _text(folder, path, answers, roles)
                if answers.is_crs_open:
                    notes = ()
                else:
                    notes = _read_notes(path, text.render(False))
                break
            except ValueError as error:
                answers.add(error)
    notes = () if answers.places else notes  # on examples
    return StartedSurvey(
        path, str(text), tuple(used), notes, tuple(answers.questions), answers.places
    )


class _Answers:
    """User's answers, and examples for values that only the user knows.

    Parameters
    ----------
    folder : Path
    given : mapping
    """

    def __init__(self, folder, given):
        self.folder, self.given = folder, _copied(given)
        self.questions: list[str] = []
        self.open: dict[str, OpenPlace] = {}

    @property
    def places(self):
        """Open values, in order of occurrence."""
        return tuple(self.open.values())

    @property
    def is_crs_open(self):
        """True if there is no example of the CRS; its coordinates are then not compared."""
        return PLACE_OF_CRS.key in self.open

    def add(self, error):
        """Add a question and its examples; raises ValueError if it cannot be answered this way."""
        places = [self._in_folder(place) for place in places_of(error)]
        if not places or any(place.key in self.open for place in places):
            raise ValueError(self._refusal(error)) from None
        self.questions.append(str(error))
        for place in places:
            self.open[place.key] = place
            if place.examples:
                _put_nested(self.given, place.keys, place.examples[0])

    def _refusal(self, error):
        """Error for a fault that survey.toml cannot correct, after the questions."""
        if not self.questions:
            return f"{error} Nothing was written."
        options = " ".join(place.option for place in self.places)
        others = " ".join(self.questions)
        return f"{error} Also needed: {others} {options} Nothing was written."

    def _in_folder(self, place):
        """Open value with example files, named relative to the folder."""
        if place.keys[-1] not in ("file", "accuracy"):
            return place
        names = [Path(os.path.relpath(name, self.folder)).as_posix() for name in place.examples]
        return replace(place, examples=tuple(names))


def _copied(given):
    """Copy nested tables for modification."""
    return {key: _copied(v) if isinstance(v, Mapping) else v for key, v in given.items()}


def _put_nested(document, keys, value):
    """Put a value into nested tables."""
    for key in keys[:-1]:
        document = document.setdefault(key, {})
    document[keys[-1]] = value


def _check_free(path):
    if path.exists():
        raise ValueError(
            f"{path} already exists. Fill in its open values, move it, or write another file "
            "with -o FILE."
        )


def _ask_of_control(folder, answers, roles):
    """Process the questions on the single list of control points, for any trajectory."""
    lists = _roles(folder, answers.given, "control", roles)
    lists = [role.path for role in lists if role.role == "control" and holds_points(role.path)]
    if len(lists) != 1:
        return
    section = ControlSection.model_validate(
        {**answers.given.get("control", {}), "file": lists[0].name}
    )
    try:
        with warnings.catch_warnings(action="ignore"):
            read_control(lists[0], section)
    except AxesError:
        return  # the trajectory may determine it
    except OpenQuestion as question:
        if question.places:
            raise


def _text(folder, path, answers, roles):
    """SurveyText, and the roles with unused files."""
    given = answers.given
    clouds = _clouds(folder, given, roles)
    drive, late = choose_trajectory(
        _roles(folder, given, "trajectory", roles), clouds, given.get("trajectory", {})
    )
    crs = None
    why_crs = "open"
    if not answers.is_crs_open:
        crs, why_crs = choose_crs(clouds, drive, given.get("crs"))
    copies = find_copies(cloud.layout.cloud for cloud in sorted(clouds, key=_preference))
    clouds = [cloud for cloud in clouds if cloud.layout.cloud not in copies]
    if answers.is_crs_open:
        accuracy = {}
        trajectory = drive.recorded.trajectory
        near = None
    else:
        accuracy = choose_accuracy([r for r in roles if r.role == "accuracy"], drive, crs)
        trajectory = near = drive.read(crs, accuracy)
    control, points, refused = choose_control(
        _roles(folder, given, "control", roles), near, given.get("control", {})
    )
    refusals = late | refused
    refusals |= {
        copy: f"a copy of {first.name}, which would count twice" for copy, first in copies.items()
    }
    roles = [
        replace(role, role="none", reason=refusals[role.path]) if role.path in refusals else role
        for role in roles
    ]
    text = SurveyText(given, answers.places)
    text.put("", "name", folder.resolve().name, "name of the folder")
    if crs is not None or answers.is_crs_open:
        text.put("", "crs", crs or "", why_crs)
    else:
        text.note("", f'crs = "EPSG:..."  of cloud and control: {why_crs}')
    _put_clouds(text, path, clouds, trajectory)
    _note_sources(text, clouds)
    _put_sessions(text, path, drive, accuracy)
    if control is not None:
        is_known = not any(place.keys[0] == "control" for place in answers.places)
        number = counted(len(points.control + points.check), "point")
        text.put("control", "file", _name(path, control), _targets(points) if is_known else number)
    rate = None if near is None else _rate(clouds[0], trajectory)
    if rate is not None:
        text.put("scanner", "lines_per_second", round(rate, 1), f"gps_time of {clouds[0].name}")
    meshes = [role.path for role in roles if role.role == "reference"]
    if len(meshes) == 1:
        text.put("scene", "reference", _name(path, meshes[0]), "the only mesh")
    elif meshes:
        text.note("scene", f"One of {', '.join(mesh.name for mesh in meshes)}:")
    return text, roles


def _validate(given):
    """Refuse contents that are impossible in survey.toml."""
    document: dict[str, Any] = {"trajectory": {"file": ""}, **given}
    for section, key in (("trajectory", "file"), ("control", "file"), ("cloud", "files")):
        if section in given and isinstance(given[section], list):
            raise ValueError(
                f"[[{section}]] can't be given with --set: init finds the files itself."
            )
        if section in given:
            document[section] = {key: [""] if key == "files" else "", **given[section]}
    validate("--set", document, PlannedSurveyFile)


def _roles(folder, given, key, roles):
    """Candidate files for a role: the given one, otherwise those that resemble it."""
    name = given.get(key, {}).get("file")
    if name is not None:
        if not (folder / name).is_file():
            raise ValueError(f"{key}.file = {name} was given, but {folder / name} does not exist.")
        return [FileRole(folder / name, key, "as given")]
    return [role for role in roles if role.role in (key, "table")]


def _clouds(folder, given, roles):
    """Clouds of a folder. Raises ValueError if one is damaged, or there are none."""
    names = given.get("cloud", {}).get("files")
    if names is not None:
        files = [path for name in names for path in files_like(folder, name)]
        return [Cloud(read_layout(path)) for path in files] or _no_cloud(folder)
    damaged = [
        role.reason
        for role in roles
        if role.role == "none" and role.path.suffix.lower() in (".las", ".laz")
    ]
    if damaged:
        raise ValueError(" ".join(damaged))
    clouds = [Cloud(read_layout(role.path)) for role in roles if role.role == "cloud"]
    reasons = [role.reason for role in roles if role.role == "none" and is_foreign(role.path)]
    reasons += [
        f"{folder} has no cloud of its own, and {role.path} is {SIMULATED}: give that folder."
        for role in roles
        if role.reason == SIMULATED
    ]
    return clouds or _no_cloud(folder, reasons)


def _preference(cloud):
    """Rank of a cloud among copies: a LAS or LAZ sorted by time is read fastest."""
    is_in_order = (np.diff(cloud.times) >= 0).all()
    return is_foreign(cloud.layout.cloud), not is_in_order, str(cloud.layout.cloud)


def _no_cloud(folder, reasons=()):
    raise ValueError(
        " ".join(reasons)
        or f"{folder} has no LAS, LAZ, E57 or PLY cloud. Add the clouds with their gps_time."
    )


def _put_clouds(text, path, clouds, trajectory):
    """Set files of the clouds, their time systems and passes."""
    names = [_name(path, cloud.layout.cloud) for cloud in clouds]
    patterns = {f"{os.path.dirname(name)}/*{Path(name).suffix}".lstrip("/") for name in names}
    if len(names) > SETTINGS.listed_files and len(patterns) == 1:
        there = list(path.parent.glob(next(iter(patterns))))
        names = sorted(patterns) if len(there) == len(names) else names
    points = sum(recorded_points(cloud.file()) for cloud in clouds)
    spans = []
    placed = []
    systems = Counter()
    for cloud in clouds:
        match = cloud.match(trajectory, text.given.get("cloud.gps_time", "auto"))
        times = match.placed(cloud.known_times)
        placed.append(times)
        spans.append((times.min(), times.max()))
        systems[str(match)] += 1
    passes = trajectory.count_passes(placed, MATCHING.visit_gap)
    text.put("cloud", "files", names, f"files: {len(clouds)}, points: {points}, passes: {passes}")
    text.put("cloud", "gps_time", "auto", "; ".join(systems))
    start, end = np.array(sorted(spans)).T
    if (end[:-1] - start[1:] > SETTINGS.tile_overlap * (end - start)[:-1]).any():
        text.note(
            "cloud", "Files overlap in time. If they come from two scanners, list the files of each"
        )
        text.note("cloud", "under [[scanner]] (docs/survey.md), with its own mounting.")


def _note_sources(text, clouds):
    """Note if the IDs of points may be those of scanners."""
    mixed = [cloud.name for cloud in clouds if cloud.takes_turns]
    if mixed:
        text.note("cloud", f"The ids of points (point_source_id) alternate in {', '.join(mixed)}.")
        text.note("cloud", "If each is a scanner, list them under [[scanner]] (docs/survey.md).")


def _put_sessions(text, path, drive, accuracy):
    """Set file and accuracy of the trajectory, or of each."""
    for number, (file, part) in enumerate(zip(drive.paths, drive.recorded.parts, strict=True)):
        if len(drive.paths) == 1:
            section = "trajectory"
        else:
            section = text.listed("trajectory", number)
        length = f"{len(part)} epochs, {part.duration:.0f} s without gaps"
        text.put(section, "file", _name(path, file), length)
        if file in accuracy:
            text.put(section, "accuracy", _name(path, accuracy[file]), "sigmas of the trajectory")


def _targets(points):
    """Phrase on control and check points, and their kinds and sizes."""
    whole = points.control + points.check
    kinds = Counter(zip(whole.kind, whole.size.tolist(), strict=True))
    listed = ", ".join(f"{n} {kind} {size:g} m" for (kind, size), n in kinds.most_common(5))
    return f"{len(points.control)} control, {counted(len(points.check), 'check point')}: {listed}"


def _rate(cloud: Cloud, trajectory: Trajectory) -> float | None:
    """Lines per second of a cloud, None if unknown."""
    file = cloud.file(cloud.match(trajectory))
    points = cloud.layout.points
    first = max(0, points - SETTINGS.rated_points) // 2
    run = read_chunks(file, first=first, end=min(points, first + SETTINGS.rated_points))
    return line_rate(PointCloud.concatenate(list(run)), trajectory)


def _name(path, file):
    """Name of a file as in survey.toml."""
    return Path(os.path.relpath(file.resolve(), path.parent.resolve())).as_posix()


def _read_notes(path, text):
    """Notes from reading a survey.toml with this text. Raises ValueError like read_survey."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        with warnings.catch_warnings(record=True, action="always") as caught:
            survey = read_survey(part)
    except (ValueError, FileNotFoundError) as error:
        raise ValueError(str(error).replace(str(part), str(path))) from None
    finally:
        part.unlink(missing_ok=True)
    return (*survey.notes, *(f"Warning: {warning.message}" for warning in caught))

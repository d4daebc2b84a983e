"""Copies of survey.toml in another folder, with some values changed."""

import glob
import os
import warnings
from collections.abc import Sequence
from pathlib import Path, PurePath

import numpy as np
import tomlkit
from tomlkit.items import InlineTable

from mlscorr.io.clouds import written_name
from mlscorr.io.store import ENCODING, as_path, is_remote, is_url, read_bytes, resolved
from mlscorr.io.surveys.survey_paths import matching
from mlscorr.survey import Mounting

PATHS = (("control", "file"), ("scene", "reference"))


def write_survey_copy(
    source: str | Path,
    target: str | Path,
    folder: str | Path,
    mountings: Sequence[Mounting] = (),
    clouds: Sequence[Sequence[str]] = (),
    trajectory: str | None = None,
    control: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> None:
    """Copy a survey.toml; everything unchanged is preserved, including comments and order.

    Parameters
    ----------
    source : path
        Original survey.toml.
    target : path
        The file to write.
    folder : path
        Final folder of the file; paths are written relative to it.
    mountings : sequence of Mounting, optional
        Mounting of each scanner, to 0.01 mm and 1e-6 deg.
    clouds : sequence of sequences of str, optional
        New files of each scanner, in the folder. Without them, new mountings do not yet apply to
        the clouds, and the copy states this.
    trajectory : str, optional
        New trajectory.file of all sessions, in the folder.
    control : sequence of str, optional
        Names of the control points used to correct the trajectory.
    notes : sequence of str, optional
        Comment on the sigmas of each mounting, possibly empty.
    """
    source = as_path(source)
    document = tomlkit.parse(read_bytes(source).decode(ENCODING))
    there = _relative_folder(source.absolute().parent, Path(folder).absolute())
    for section, key in PATHS:
        if key in document.get(section, {}):
            document[section][key] = _moved(there, document[section][key])
    sessions = _listed(document["trajectory"])
    scanners = _listed(document.get("scanner"))
    for section in sessions or [document["trajectory"]]:
        for key in {"file", "accuracy"} & set(section):
            section[key] = _moved(there, section[key])
    if clouds:
        _set_clouds(source, document, sessions, scanners, clouds)
    else:
        for section in (document["cloud"], *sessions, *scanners):
            for number, name in enumerate(section.get("files", ())):  # keeps comments between
                section["files"][number] = _moved(there, name, source.parent)
        if mountings:  # a further calibration would count the same correction twice
            document["cloud"]["mounting"] = "recorded"
    if trajectory is not None:
        _set_trajectory(document, trajectory, sorted(set(control)))
    sections = scanners or [document]
    notes = notes or [""] * len(mountings)
    for section, mounting, note in zip(sections, mountings, notes, strict=bool(mountings)):
        if isinstance(section, InlineTable):  # no comment is possible there
            _set_mounting(section["mounting"], mounting, "")
        else:
            _set_mounting(section["mounting"], mounting, note)
    Path(target).write_text(tomlkit.dumps(document), encoding="utf-8")


def _set_clouds(source, document, sessions, scanners, clouds):
    """Set new files of each scanner; those of sessions keep their names, not their folders."""
    for section in sessions:
        if "files" in section:
            paths = [matching(source, "trajectory.files", pattern) for pattern in section["files"]]
            section["files"] = sorted({written_name(path) for some in paths for path in some})
    document["cloud"]["files"] = list(dict.fromkeys(name for names in clouds for name in names))
    for section, names in zip(scanners, clouds, strict=bool(scanners)):
        if "files" in section:
            section["files"] = list(names)


def _set_trajectory(document, name, control):
    """Set one trajectory in our own columns, with the control points used to correct it."""
    if _listed(document["trajectory"]):
        document["trajectory"] = tomlkit.table()
    for key in set(document["trajectory"]) - {"file"}:  # sigmas and columns are its own
        del document["trajectory"][key]
    document["trajectory"]["file"] = name
    if control:
        document["trajectory"]["corrected_by"] = control


def _listed(section):
    """Sections of a list of tables; empty for a table."""
    if isinstance(section, list):
        return section
    return []


def _set_mounting(section, mounting, note):
    """Set lever arm and boresight, and their accuracy."""
    values = mounting_values(mounting)
    if mounting.covariance is None:  # sigmas of a calibration are joint, measured ones separate
        is_calibrated = section.pop("correlation", None) is not None
        for key in [key for key in values if is_calibrated or values[key] != section[key]]:
            section.pop(f"{key}_sigma", None)
    section.update(values)
    if mounting.covariance is not None:
        sigma = _set_covariance(section, mounting.covariance)
        is_line = isinstance(section, InlineTable)  # TOML has comments only after it
        trivia = section.trivia if is_line else sigma.trivia
        if note:
            trivia.comment_ws = "  "
            trivia.comment = f"# {note}"
        elif not is_line:
            trivia.comment_ws = ""
            trivia.comment = ""


def _set_covariance(section, covariance):
    """Set sigmas to 0.01 mm and 1e-6 deg, and correlations to 1e-6; return the first TOML item."""
    sigma = np.sqrt(np.diag(covariance))
    first = tomlkit.item(np.maximum(np.round(sigma[:3], 5), 1e-5).tolist())
    section["lever_arm_sigma"] = first
    section["boresight_sigma"] = np.maximum(np.round(np.degrees(sigma[3:]), 6), 1e-6).tolist()
    rows = tomlkit.array()
    for row in (covariance / np.outer(sigma, sigma)).round(6).clip(-1, 1).tolist():
        rows.add_line(row)
    section["correlation"] = rows.multiline(True)
    return first


def mounting_values(mounting: Mounting) -> dict[str, list[float]]:
    """Format ``lever_arm`` and ``boresight`` as in survey.toml, to 0.01 mm and 1e-6 deg.

    Parameters
    ----------
    mounting : Mounting

    Returns
    -------
    dict of lists of three float
        Units: m, deg.
    """
    with warnings.catch_warnings(action="ignore"):  # of ambiguous angles: any will do
        boresight = mounting.boresight.as_euler("xyz", degrees=True)
    rounded = np.round(mounting.lever_arm, 5) + 0.0, np.round(boresight, 6) + 0.0
    return dict(zip(("lever_arm", "boresight"), map(np.ndarray.tolist, rounded), strict=True))


def _relative_folder(old, new):
    """Relative path from the new folder to the old one, links resolved; absolute if there is
    none.
    """
    if is_remote(old):
        return old
    try:
        return PurePath(os.path.relpath(old.resolve(), new.resolve()))
    except ValueError:  # another drive
        return old


def _moved(there, name, folder=None):
    """Path, or pattern if it is one in its old folder, relative to the new folder."""
    if is_url(name):
        return name
    if is_remote(there):
        return str(resolved(there / name))
    if folder is not None and glob.has_magic(name) and not (folder / name).exists():
        there = PurePath(glob.escape(str(there)))
    return (there / name).as_posix()

"""Effects found by a diagnosis or calibration, with their clouds, for removal."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mlscorr.effects import Effect, effect_class, make_effect
from mlscorr.estimate import sigma_note
from mlscorr.io.store import FileIdentity
from mlscorr.survey import Survey
from mlscorr.wording import joined

CLOCK = "time_offset"
MOUNTING = ("lever_arm", "boresight")
DATUM = ("horizontal_datum", "vertical_datum")
TAKEN_OUT = (CLOCK, *MOUNTING, *DATUM)


@dataclass(frozen=True)
class FoundEffects:
    """Effects that were found together.

    Parameters
    ----------
    effects : tuple of Effect
    clouds : tuple of dict
        Name, bytes and digest of the clouds with the effects, if known.
    covariance : (6, 6) array, optional
        Covariance of the mounting without them. Units: m, rad.
    note : str
        Origin of the covariance.
    """

    effects: tuple[Effect, ...]
    clouds: tuple[dict, ...] = ()
    covariance: np.ndarray | None = None
    note: str = ""

    @property
    def is_of_mounting(self) -> bool:
        """True if lever arm or boresight are among them."""
        return any(effect.name in MOUNTING for effect in self.effects)

    def check_clouds(self, survey: Survey) -> None:
        """Refuse a survey of other clouds.

        Parameters
        ----------
        survey : Survey

        Raises
        ------
        ValueError
            If none of its clouds is one of those with the effects.
        """
        known = {(row["bytes"], row["digest"]) for row in self.clouds}
        here = cloud_rows(survey) if known else []
        if known and known.isdisjoint((row["bytes"], row["digest"]) for row in here):
            names = joined([effect.name for effect in self.effects])
            raise ValueError(
                f"None of the {len(here)} clouds of {survey.path} is among the {len(known)} in "
                f"which {names} was found (first: {self.clouds[0]['name']}). They belong to "
                "another survey, or it was already removed from them. Give the survey in which "
                "it was found, or NAME=SIZE if these clouds have the same error."
            )


def cloud_rows(survey: Survey) -> list[dict[str, str | int]]:
    """``clouds`` of a document: name, bytes and digest of each, for identification.

    Parameters
    ----------
    survey : Survey
    """
    identities = {file.path.name: FileIdentity.of(file.path) for file in survey.clouds}
    return [{"name": n, "bytes": i.size, "digest": i.digest} for n, i in identities.items()]


def read_effects(source: str | Path) -> FoundEffects:
    """Read effects from a document of diagnose or calibrate, or one effect by name and size.

    Parameters
    ----------
    source : str or path
        gap.json, calibration.json, or ``NAME=SIZE`` with three numbers for a vector, two for a
        horizontal one: ``boresight=0.1,0,-0.2`` (deg).

    Raises
    ------
    ValueError
        If it is neither, or contains no effects.
    OSError
        If a document cannot be read.
    """
    name, equals, size = str(source).partition("=")
    if equals and name in TAKEN_OUT:
        try:
            values = [float(value) for value in size.split(",")]
        except ValueError:
            raise ValueError(
                f"{source}: {size!r} is neither a number nor several with commas."
            ) from None
        return FoundEffects(_effects({name: values}))
    if not Path(source).is_file():
        raise ValueError(
            f"There is no file {source}. Give a gap.json, a calibration.json, or NAME=SIZE with "
            f"one of {joined(TAKEN_OUT, 'or')}, as time_offset=0.005 (s)."
        )
    try:
        content = json.loads(Path(source).read_text(encoding="utf-8"))
        readers = {"mlscorr.gap/1": _of_gap, "mlscorr.calibration/1": _of_calibration}
        effects = readers[content["schema"]](content)
        return replace(effects, clouds=tuple(content.get("clouds", ())))
    except (KeyError, TypeError, json.JSONDecodeError):
        raise ValueError(
            f"{source} is not a gap.json or calibration.json of mlscorr, or it has several "
            "scanners; for these, calibrate --clouds writes the clouds."
        ) from None


def _of_gap(content):
    """Effects of the most probable cause; raises ValueError without one."""
    label = content["verdict"]["label"]
    cause = content["causes"][0] if content["causes"] else None
    if label in ("none", "unknown") or cause is None or cause["effect"] != label:
        raise ValueError(
            f"The only cause that the diagnosis names is {label}, so nothing can be removed."
        )
    sizes = {}
    for name in label.split("+"):
        kind = effect_class(name)
        if name not in TAKEN_OUT:
            raise ValueError(
                f"{name}, one of the causes, can't be removed from the cloud. {kind.remedy}"
            )
        rows = {row["name"].removeprefix(f"{name} "): row for row in cause["parameters"]}
        sizes[name] = [rows[part]["estimate"] for part in kind.parts]
    return FoundEffects(_effects(sizes))


def _of_calibration(content):
    """Corrections of the recorded mounting, and the accuracy of the corrected one."""
    arm, turn = (content["lsc"][name] for name in MOUNTING)
    sigma = np.append(arm["sigma"], np.radians(turn["sigma"]))
    covariance = np.array(content["lsc"]["correlation"]) * np.outer(sigma, sigma)
    effects = _effects(dict(zip(MOUNTING, (arm["correction"], turn["correction"]), strict=True)))
    note = sigma_note(np.array(content["determined"]))
    return FoundEffects(effects, covariance=covariance, note=note)


def _effects(sizes: Mapping[str, Sequence[float]]) -> tuple[Effect, ...]:
    """Effects by their names and sizes."""
    return tuple(
        make_effect(name, magnitude=values if len(values) > 1 else values[0])
        for name, values in sizes.items()
    )

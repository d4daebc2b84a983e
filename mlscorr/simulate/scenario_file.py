"""scenario.toml as one Scenario."""

from pathlib import Path

from mlscorr.io.store import read_toml
from mlscorr.io.trajectories import check_crs
from mlscorr.simulate.scenario import Scenario

FILES = (("scene", "file"), ("drive", "file"), ("pos", "error_file"))  # that a scenario may name


def read_scenario(path: Path | str) -> Scenario:
    """Scenario of a TOML file; the files it names stand relative to it.

    Raises ValueError for bad TOML, unknown keys (with the nearest known one) and values that no
    survey can have; FileNotFoundError for files that aren't there.

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
    """Paths of the files that a scenario names, which a simulation must not overwrite.

    Parameters
    ----------
    scenario : Scenario
    """
    named = (getattr(getattr(scenario, part), key) for part, key in FILES)
    return [file for file in named if file is not None]

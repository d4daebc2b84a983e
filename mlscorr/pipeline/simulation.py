"""``simulate`` and ``demo``: from a scenario to a survey folder."""

from pathlib import Path

import numpy as np

from mlscorr.io.store import check_output, document, output_folder
from mlscorr.io.surveys import read_survey
from mlscorr.pipeline.correction import correct
from mlscorr.pipeline.finding import silent
from mlscorr.pipeline.logs import write_log


def demo(out, seed=1, overwrite=False, progress=None):
    """Simulate a small survey and correct it: a folder with ``survey`` and ``corrected``.

    Returns the document of report.json.
    """
    from mlscorr.simulate import DEMO, simulate

    with output_folder(out, overwrite=overwrite) as folder:
        simulated = Path(folder) / "survey"
        simulated.mkdir()
        (progress or silent)("Building a street")
        simulate(DEMO, np.random.default_rng(seed)).write(simulated, progress=progress)
        result = correct(read_survey(simulated), progress=progress)
        return result.write(Path(folder) / "corrected", progress=progress)


def simulate_survey(scenario_path, out, seed=1, overwrite=False, progress=None):
    """Simulate the survey of a scenario file: a survey folder, with truth.npz and truth.json.

    The folder is written atomically. Returns the document of the JSON output. Raises ValueError for
    an impossible scenario, or a folder that contains an input or, without overwrite, anything;
    OSError if writing fails.
    """
    from mlscorr.simulate import read_scenario, scenario_files, simulate

    scenario = read_scenario(scenario_path)
    check_output(out, [scenario_path, *scenario_files(scenario)], overwrite)
    (progress or silent)("Building the scene")
    simulate(scenario, np.random.default_rng(seed)).write(out, progress, overwrite)
    write_log(Path(out))
    return _simulated(read_survey(out), scenario, seed)


def _simulated(survey, scenario, seed):
    """Document of a simulated survey, as read again from its folder."""
    return document(
        "simulate",
        {
            "name": scenario.name,
            "crs": scenario.crs,
            "seed": seed,
            "start": float(survey.trajectory.gps_time[0]),
            "end": float(survey.trajectory.gps_time[-1]),
            "passes": len(survey.trajectory.gaps) + 1,
            "control": len(survey.control),
            "check": len(survey.check),
            "effects": [effect.document() for effect in scenario.imperfections],
            "files": [{"name": file.path.name, "points": file.points} for file in survey.clouds],
        },
    )

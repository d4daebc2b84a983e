"""Command that finds tie features in overlaps."""

import mlscorr
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.terminal import (
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyArgument,
    Verbose,
    say,
    say_results,
)
from mlscorr.cli.work import print_json, work
from mlscorr.wording import counted

EXAMPLES = (
    "mlscorr ties survey.toml",
    "mlscorr ties survey.toml -o ties --json",
)


def ties(
    survey: SurveyArgument,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Find tie features between passes (walls, roads, poles, paint) and their misclosures."""
    out = chosen_out(out, survey, "ties")
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey)
        content = mlscorr.find_ties(recorded, progress=progress).write(out, overwrite)
    print_json(content, as_json)
    features = content["features"]
    say(
        f"{counted(content['ties'], 'tie')} between {counted(features['plane'], 'plane')}, "
        f"{counted(features['pole'], 'pole')}, {counted(features['line'], 'painted line')} and "
        f"{counted(features['dash'], 'dash')}; {content['refused']} rejected because they "
        "contradict their neighbors."
    )
    for pair in content["pairs"]:
        parts = [
            f"{axis} {1000 * statistics['rms']:.0f} mm"
            for axis, statistics in pair["misfit"].items()
            if statistics["n"]
        ]
        first, second = pair["passes"]
        if first == second:
            which = f"Within pass {first}"
        else:
            which = f"Between passes {first} and {second}"
        say(f"{which}: RMS {', '.join(parts)}.")
    say_results([("Ties", f"{out / 'ties.csv'} and {out / 'ties.json'}")])

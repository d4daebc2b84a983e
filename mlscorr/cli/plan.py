"""Command that predicts the results of a survey before it is driven."""

import mlscorr
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.terminal import (
    Effects,
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

EXAMPLES = (
    "mlscorr plan survey.toml",
    "mlscorr plan survey.toml -o plan --json",
)


def plan(
    survey: SurveyArgument,
    out: Out = None,
    effects: Effects = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Predict which errors a planned survey can detect and separate; needs no cloud."""
    out = chosen_out(out, survey, "plan")
    with work(out, overwrite, survey, planned=True) as progress:
        recorded = mlscorr.read_survey(survey, planned=True)
        progress("Predicting the effect of each error")
        planned = mlscorr.plan(recorded)
        content = planned.write(out, overwrite)
    from mlscorr.effects import lowered, parameter_title, titles
    from mlscorr.report.gap import accuracy_sentence

    print_json(content, as_json)
    say(f"{'Smallest detectable error':39s}{'':>9s}  {'unit':12s}  usual size")
    for parts in content["detectable"].values():
        for part in parts:
            if part["typical"] is None:
                usual = ""
            else:
                usual = f"{part['typical']:.3g}"
            words = f"{parameter_title(part['name']):39s}{part['detectable']:9.3g}"
            say(f"{words}  {part['unit']:12s}  {usual}")
    for members in content["classes"]:
        say(f"Not separable: {lowered(titles(members))}.")
    if content["accuracy"] is not None:
        say(accuracy_sentence(content["accuracy"]))
    for number, sentence in enumerate(content["advice"], start=1):
        say(f"{number}. {sentence}")
    say_results([("Page", out / "plan.html"), ("Numbers", out / "plan.json")])

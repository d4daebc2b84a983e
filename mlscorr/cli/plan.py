"""The command that says what a survey will show before it is driven."""

import json

from mlscorr.cli.terminal import Exit, Json, Out, Overwrite, Quiet, SurveyFile, exit_code, say


def plan(
    survey: SurveyFile,
    out: Out,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Tell which effects a planned survey can show and tell apart; it needs no cloud."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files

        check_output(out, input_files(survey, planned=True), overwrite)
    with exit_code(Exit.BAD_DATA):
        from mlscorr.io.survey_file import read_survey
        from mlscorr.pipeline import plan

        content = plan(read_survey(survey, planned=True)).write(out, overwrite)
    if as_json:
        print(json.dumps(content))
    say(f"{'Smallest effect that shows':34s}{'':>12s}  unit      usual size")
    for parts in content["detectable"].values():
        for part in parts:
            usual = "" if part["typical"] is None else f"{part['typical']:.3g}"
            say(f"{part['name']:34s}{part['detectable']:12.3g}  {part['unit']:8s}  {usual}")
    for members in content["classes"]:
        say(f"Can't be told apart: {', '.join(members)}.")
    for number, sentence in enumerate(content["advice"], start=1):
        say(f"{number}. {sentence}")
    say(f"Page:    {out / 'plan.html'}")
    say(f"Numbers: {out / 'plan.json'}")

"""The command that corrects a survey."""

import json
from typing import Annotated

import typer

from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import (
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyFile,
    exit_code,
    say,
    warn,
)


def correct(
    survey: SurveyFile,
    out: Out,
    order: Annotated[
        int, typer.Option(min=0, max=9, help="Order of the polynomial trend of the position.")
    ] = 1,
    sigma: Annotated[
        bool, typer.Option("--sigma", help="Add to each point one sigma of its E, N and H.")
    ] = False,
    fail_if: Annotated[
        list[str],
        typer.Option(
            help='A quality gate, as "check.rmse_3d > 0.05" (m); e, n, h stand for easting, '
            "northing, height. Exit code 6 if one is met; all results are written."
        ),
    ] = (),
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
):
    """Correct the cloud of a survey with its control points, and report on it."""
    with exit_code(Exit.USAGE):
        from mlscorr.io.output import check_output
        from mlscorr.io.survey_file import input_files, read_survey
        from mlscorr.quality import failures, read_gate

        gates = [read_gate(text) for text in fail_if]
        check_output(out, input_files(survey), overwrite)
    with exit_code(Exit.BAD_DATA), progress_bars() as progress:
        recorded = read_survey(survey)
        from mlscorr.pipeline import correct

        result = correct(recorded, order, progress=progress)
        report = result.write(out, overwrite, progress, sigma)
    tell(report, out, as_json)
    outside = report["coverage"]["points_outside_trajectory"]
    if outside:
        total = sum(file["points"] for file in report["files"])
        warn(
            f"{outside} of {total} points lie outside the trajectory or in its gaps "
            f"[{recorded.trajectory.gps_time[0]:.3f}, {recorded.trajectory.gps_time[-1]:.3f}] s "
            "and were left as they were."
        )
    failed = failures(gates, report)
    for sentence in failed:
        warn(f"Quality gate failed: {sentence}")
    if failed or outside:
        raise typer.Exit(Exit.QUALITY_GATE if failed else Exit.IN_PART)


def tell(report, out, as_json):
    """The misclosures' RMSE before and after, and where the results lie."""
    if as_json:
        print(json.dumps(report))
    say(f"{'RMSE of misclosures (m)':24s}{'n':>4s}  {'E before':>9s}{'N':>8s}{'H':>8s}"
         f"  {'E after':>9s}{'N':>8s}{'H':>8s}")  # fmt: skip
    rows = [
        ("control points", report["control"], "after"),
        ("  each left out in turn", report["control"], "leave_one_out"),
        ("check points", report["check"], "after"),
    ]
    for title, group, after in rows:
        if group["before"]["rmse"] is None or group[after]["rmse"] is None:
            say(f"{title:24s}{group['n']:4d}  none")
            continue
        numbers = [*group["before"]["rmse"], *group[after]["rmse"]]
        text = "".join(
            f"{'  ' * (i % 3 == 0)}{v:{9 - (i % 3 > 0)}.3f}" for i, v in enumerate(numbers)
        )
        say(f"{title:24s}{group['n']:4d}{text}")
    for target in report["targets"]:
        if not target["used"] and target["reason"] != "check point":
            say(f"Not used: {target['name']}: {target['reason']}")
    say(f"Report:    {out / 'report.html'}")
    say(f"Pictures:  {out / 'pictures'}")
    say(f"Corrected: {', '.join(str(out / file['name']) for file in report['files'])}")

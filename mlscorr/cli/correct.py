"""Command that corrects a survey."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.check import check_first, say_dry_run
from mlscorr.cli.folders import chosen_out, has_toml, inferred_survey
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.project import correct_drives
from mlscorr.cli.work import print_json, work

if TYPE_CHECKING:
    from mlscorr.pipeline import TieUse

EXAMPLES = (
    "mlscorr correct street",
    "mlscorr correct survey.toml -o corrected --exclude T07 --worst-first",
    "mlscorr correct project.toml -o city --workers 8",
)


def correct(
    survey: Annotated[
        Path,
        typer.Argument(
            help="survey.toml or project.toml, or the folder that contains it; a path or a URL. "
            "If a folder has neither, a survey.toml is inferred and written with the "
            "results.",
            parser=terminal.path_or_url,
        ),
    ],
    out: terminal.Out = None,
    order: Annotated[
        int, typer.Option(min=0, max=9, help="Order of the polynomial trend of the position.")
    ] = 0,
    sigma: Annotated[
        bool, typer.Option("--sigma", help="Add fields with the sigma of E, N and H to each point.")
    ] = False,
    no_ties: terminal.NoTies = False,
    ties_only: Annotated[
        bool, typer.Option("--ties-only", help="Align passes without any control point.")
    ] = False,
    no_report: Annotated[
        bool, typer.Option("--no-report", help="Do not write report.html and the pictures: faster.")
    ] = False,
    pdf: Annotated[
        bool,
        typer.Option("--pdf", help="Also write certificate.pdf: two A4 pages to sign."),
    ] = False,
    trajectory: Annotated[
        list[str],
        typer.Option(
            help="Additional file for the corrected trajectory, in OUT: NAME.sbet (with its "
            "smrmsg), NAME.tum, NAME.gpkg or NAME.geojson."
        ),
    ] = (),
    targets: Annotated[
        list[str],
        typer.Option(
            help="Additional file for the surveyed points, in OUT, for a GIS: NAME.gpkg (in the "
            "survey's CRS) or NAME.geojson (WGS 84)."
        ),
    ] = (),
    displacement: Annotated[
        bool,
        typer.Option(
            "--displacement", help="Add fields with the displacement in E, N, H to each point."
        ),
    ] = False,
    exclude: terminal.Exclude = (),
    include: Annotated[
        list[str],
        typer.Option(
            metavar="NAME",
            help="Use this control point even if the tests reject it. May be repeated.",
        ),
    ] = (),
    worst_first: Annotated[
        bool,
        typer.Option("--worst-first", help="Print the residual of each point, largest first."),
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Check the inputs and list the files that would be read and written; write "
            "nothing. Same exit codes as mlscorr check.",
        ),
    ] = False,
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance", help="Record version, settings and inputs in the header of each cloud."
        ),
    ] = False,
    fail_if: Annotated[
        list[str],
        typer.Option(
            help='Quality gate, as "check.rmse_3d > 0.05" (m; e, n, h are easting, northing, '
            'height), "check.n_seen < 8", "check.n_unseen > 0", '
            '"coverage.share_extrapolated > 0.1", "weak.sigma > 0.1" (m). Exit code 6 '
            "if one is met; all results are still written."
        ),
    ] = (),
    workers: Annotated[
        int,
        typer.Option(
            min=1, help="project.toml only: number of parallel processes on this machine."
        ),
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="project.toml only: address of a dask.distributed scheduler."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="project.toml only: process only what is missing or changed in OUT."
        ),
    ] = False,
    overwrite: terminal.Overwrite = False,
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
    verbose: terminal.Verbose = 0,
) -> None:
    """Correct the clouds of a survey, or all drives of a project.toml, and write a report."""
    out = chosen_out(out, survey, "correct")
    with terminal.exit_code(terminal.Exit.USAGE), progress_bars():
        from mlscorr.evaluate import failures, read_gate
        from mlscorr.io.surveys import is_project
        from mlscorr.io.trajectories import check_distinct, check_exports, check_target_exports

        check_exports(trajectory)
        check_target_exports(targets)
        check_distinct([*trajectory, *targets])
        gates = [read_gate(text) for text in fail_if]
        if no_ties and ties_only:
            raise ValueError(
                "--no-ties with --ties-only leaves nothing for the correction. "
                "Give only one of them."
            )
        ties: TieUse | None = None
        if no_ties:
            ties = "off"
        elif ties_only:
            ties = "only"
        shared = workers, scheduler, resume
        is_of_drives = is_project(survey)
        if is_of_drives:
            from mlscorr.pipeline.project import Options

            if provenance:
                raise ValueError(
                    "--provenance applies to one survey only, because a cloud of a project may "
                    "belong to several drives. The report.json of each drive lists its inputs "
                    "and their SHA-256."
                )
            if pdf:
                raise ValueError(
                    "--pdf makes the certificate of one survey, and a project has no certificate. "
                    "Correct a drive by its own survey.toml for one; the report.json of each drive "
                    "states the same numbers."
                )
            exports = tuple(trajectory), tuple(targets)
            given = order, ties, sigma, not no_report, *exports, displacement, *shared, overwrite
            options = Options(*given)
        elif shared != (1, None, False):
            raise ValueError(
                f"--workers, --scheduler and --resume need a project.toml; {survey} is a single "
                'survey. Two lines make it a project: [[drive]] and survey = "survey.toml".'
            )
    chosen = {"exclude": exclude, "include": include}
    if is_of_drives:
        if dry_run:
            say_dry_run(survey, out, (), chosen)
        else:
            correct_drives(survey, out, options, gates, as_json, chosen)
        return
    settings = {
        "sigma": sigma,
        "page": not no_report,
        "trajectories": trajectory,
        "targets": targets,
        "displacement": displacement,
        "provenance": provenance,
        "pdf": pdf,
    }
    with ExitStack() as ends:
        path = survey
        if not has_toml(survey):
            with terminal.exit_code(terminal.Exit.USAGE), progress_bars() as progress:
                from mlscorr.io.store import check_output

                check_output(out, (), overwrite)
                progress("Identifying the files of the folder")
                place = None if dry_run else out
                inferred = ends.enter_context(inferred_survey(survey, place))
            path = inferred.path
            settings["survey_toml"] = inferred.text
        if dry_run:
            say_dry_run(path, out, _written(path, settings), chosen, overwrite)
            return
        if path != survey:
            check_first(path)
        report = _corrected(path, out, overwrite, order, ties, chosen, settings)
    report_result(report, out, as_json, not no_report, pdf, worst_first)
    terminal.end(failures(gates, report), not report["coverage"]["points_untouched"])


def _corrected(survey, out, overwrite, order, ties, chosen, settings):
    """Report of a corrected survey, after all results are written."""
    from mlscorr.io.clouds import Additions, read_layout, with_additions
    from mlscorr.io.trajectories import check_exports, check_target_exports

    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey).choosing(**chosen)
        if "survey_toml" in settings:  # this name is kept
            recorded = replace(recorded, path=out / survey.name)
        for sentence in recorded.layouts:
            terminal.say(sentence)
        check_exports(settings["trajectories"], recorded.crs, is_read=True)
        check_target_exports(settings["targets"], recorded.crs, is_read=True)
        added = Additions(settings["sigma"], settings["displacement"])
        for cloud in recorded.cloud_paths if added.has_fields else ():
            with_additions(read_layout(cloud), added)  # refuses existing ones before the work
        result = mlscorr.correct(recorded, order, progress=progress, ties=ties)
        return result.write(out, overwrite, progress, **settings)


def _written(survey, settings):
    """Names of all files that a correction writes."""
    from mlscorr.io.clouds import written_name
    from mlscorr.io.surveys import files_of, read_survey_file, survey_toml

    with terminal.exit_code(terminal.Exit.USAGE):
        clouds = files_of(survey_toml(survey), read_survey_file(survey)).clouds
    names = [written_name(path) for path in clouds]
    names += ["trajectory.csv", *settings["trajectories"], "targets.csv", *settings["targets"]]
    names += ["weak.csv", "report.json", "log.txt"]
    if settings["page"]:
        names += ["report.html", "pictures"]
    if settings["pdf"]:
        names.append("certificate.pdf")
    if "survey_toml" in settings:
        names.append("survey.toml")
    return names


def report_result(
    report: dict,
    out: Path,
    as_json: bool,
    page: bool = True,
    pdf: bool = False,
    worst_first: bool = False,
) -> None:
    """Print the report's first screen, the RMSE of misclosures, and the results' location.

    Parameters
    ----------
    report : dict
        report.json.
    out : Path
        Folder of the results.
    as_json : bool
        True to print the report on stdout.
    page : bool
        True if report.html was written.
    pdf : bool
        True if certificate.pdf was written.
    worst_first : bool
        True to print the residual of each point.
    """
    from mlscorr.report import tie_sentences

    print_json(report, as_json)
    terminal.say_statements(report["statements"])
    for sentence in tie_sentences(report["ties"], report["control"]["n_scored"]):
        terminal.say(sentence)
    for row in report.get("exclusions", ()):
        terminal.say(row["sentence"])
    if worst_first:
        say_residuals(report["targets"])
    rows = [
        ("control points", report["control"], "after"),
        ("  leave-one-out", report["control"], "leave_one_out"),
        ("check points", report["check"], "after"),
    ]
    terminal.say_rmse(rows, width=24, decimals=3)
    results: list[tuple[str, object]] = []
    if page:
        results += [("Report", out / "report.html"), ("Pictures", out / "pictures")]
    if pdf:
        results.append(("Certificate", out / "certificate.pdf"))
    clouds = ", ".join(str(out / file["name"]) for file in report["files"])
    terminal.say_results([*results, ("Corrected", clouds)])


def say_residuals(targets: list[dict]) -> None:
    """Print the residual of each observation, the largest first, and points without one last.

    Parameters
    ----------
    targets : list of dict
        Rows of report.json. For control points they are leave-one-out, because the fit is not a
        test.
    """
    rows = []
    for row in targets:
        residual = row["left_out"] or row["after"]
        length = 0.0
        if residual is not None:
            length = sum(value**2 for value in residual) ** 0.5
        rows.append((length, residual, row))
    width = max([len(row["name"]) for row in targets], default=0) + 2
    head = f"{'residual (m)':{max(width, 13)}s}{'pass':>5s}  {'role':8s}"
    terminal.say(f"{head}{'E':>8s}{'N':>8s}{'H':>8s}{'3D':>8s}")
    for length, residual, row in sorted(rows, key=lambda each: -each[0]):
        numbers = "".join(f"{value:8.3f}" for value in [*(residual or ()), length][:4])
        if residual is None:
            numbers = " " * 32
        number = row["pass"] or ""
        words = f"{row['name']:{max(width, 13)}s}{number:>5}  {row['role']:8s}{numbers}"
        reason = ""
        if row["reason"] and row["role"] == "control":
            reason = f"  not used: {row['reason']}"
        terminal.say(f"{words}{reason}")

"""The command that corrects a survey."""

from pathlib import Path
from typing import Annotated, Literal

import typer

import mlscorr
from mlscorr.cli import terminal
from mlscorr.cli.project import correct_drives
from mlscorr.cli.work import print_json, work


def correct(
    survey: Annotated[
        Path,
        typer.Argument(
            help="survey.toml or project.toml, or the folder that holds it; a path or a URL.",
            parser=terminal.path_or_url,
        ),
    ],
    out: terminal.Out,
    order: Annotated[
        int, typer.Option(min=0, max=9, help="Order of the polynomial trend of the position.")
    ] = 0,
    sigma: Annotated[
        bool, typer.Option("--sigma", help="Add to each point one sigma of its E, N and H.")
    ] = False,
    no_ties: terminal.NoTies = False,
    ties_only: Annotated[
        bool, typer.Option("--ties-only", help="Bring passes together without any control point.")
    ] = False,
    no_report: Annotated[
        bool, typer.Option("--no-report", help="Leave out report.html and the pictures: faster.")
    ] = False,
    pdf: Annotated[
        bool,
        typer.Option("--pdf", help="Write certificate.pdf, too: two A4 pages to sign."),
    ] = False,
    trajectory: Annotated[
        list[str],
        typer.Option(
            help="A further file for the corrected trajectory, in OUT: NAME.sbet (with its "
            "smrmsg), NAME.tum, NAME.gpkg or NAME.geojson."
        ),
    ] = (),
    targets: Annotated[
        list[str],
        typer.Option(
            help="A further file for the surveyed points, in OUT, for a GIS: NAME.gpkg (in the "
            "survey's CRS) or NAME.geojson (WGS 84)."
        ),
    ] = (),
    displacement: Annotated[
        bool,
        typer.Option("--displacement", help="Add to each point by how much its E, N, H moved."),
    ] = False,
    provenance: Annotated[
        bool,
        typer.Option(
            "--provenance", help="State version, settings and inputs in the header of each cloud."
        ),
    ] = False,
    fail_if: Annotated[
        list[str],
        typer.Option(
            help='A quality gate, as "check.rmse_3d > 0.05" (m; e, n, h are easting, northing, '
            'height), "check.n_seen < 8", "check.n_unseen > 0", "coverage.share_extrapolated > '
            '0.1", "weak.sigma > 0.1" (m). Exit code 6 if one is met; all results are written.'
        ),
    ] = (),
    workers: Annotated[
        int, typer.Option(min=1, help="Of a project.toml: processes of this machine that share it.")
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Of a project.toml: address of a dask.distributed cluster's scheduler."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Of a project.toml: do what is missing or changed in OUT."),
    ] = False,
    overwrite: terminal.Overwrite = False,
    as_json: terminal.Json = False,
    quiet: terminal.Quiet = False,
) -> None:
    """Correct the cloud of a survey, or all drives of a project.toml, and report on it.

    mlscorr correct survey.toml -o corrected --targets targets.gpkg --trajectory drive.sbet
    """
    with terminal.exit_code(terminal.Exit.USAGE):
        from mlscorr.evaluate import failures, read_gate
        from mlscorr.io.clouds import Additions, read_layout, with_additions
        from mlscorr.io.surveys import is_project
        from mlscorr.io.trajectories import check_distinct, check_exports, check_target_exports

        check_exports(trajectory)
        check_target_exports(targets)
        check_distinct([*trajectory, *targets])
        gates = [read_gate(text) for text in fail_if]
        if no_ties and ties_only:
            raise ValueError("--no-ties and --ties-only leave nothing to correct with: give one.")
        ties: Literal["off", "only"] | None = "off" if no_ties else "only" if ties_only else None
        shared = workers, scheduler, resume
        if is_project(survey):
            from mlscorr.pipeline.project import Options

            if provenance:
                raise ValueError(
                    "--provenance is of one survey, and a cloud of a project may belong to several "
                    "drives. The report.json of each drive names its inputs and their SHA-256."
                )
            if pdf:
                raise ValueError(
                    "--pdf is of one survey. Correct each drive by itself for its certificate.pdf; "
                    "the report.json of each drive has its numbers."
                )
            exports = tuple(trajectory), tuple(targets)
            given = order, ties, sigma, not no_report, *exports, displacement, *shared, overwrite
            correct_drives(survey, out, Options(*given), gates, as_json)
            return
        if shared != (1, None, False):
            raise ValueError(
                f"--workers, --scheduler and --resume are of a project.toml, and {survey} is one "
                'survey. Two lines make a project of it: [[drive]] and survey = "survey.toml".'
            )
    with work(out, overwrite, survey) as progress:
        recorded = mlscorr.read_survey(survey)
        for sentence in recorded.layouts:
            terminal.say(sentence)
        check_exports(trajectory, recorded.crs, is_read=True)
        check_target_exports(targets, recorded.crs, is_read=True)
        added = Additions(sigma, displacement)
        for cloud in recorded.cloud_paths if added.has_fields else ():
            with_additions(read_layout(cloud), added)  # refuses one that has them, before the work
        result = mlscorr.correct(recorded, order, progress=progress, ties=ties)
        report = result.write(
            out,
            overwrite,
            progress,
            sigma,
            page=not no_report,
            trajectories=trajectory,
            targets=targets,
            displacement=displacement,
            provenance=provenance,
            pdf=pdf,
        )
    tell(report, out, as_json, not no_report, pdf)
    terminal.end(failures(gates, report), not report["coverage"]["points_untouched"])


def tell(report: dict, out: Path, as_json: bool, page: bool = True, pdf: bool = False) -> None:
    """Say what stands first in the report, the RMSE of misclosures, and where the results lie.

    Parameters
    ----------
    report : dict
        report.json.
    out : Path
        Folder of the results.
    as_json : bool
        Whether to print the report on stdout.
    page : bool
        Whether report.html was written.
    pdf : bool
        Whether certificate.pdf was written.
    """
    from mlscorr.report import tie_sentences

    print_json(report, as_json)
    terminal.say_statements(report["statements"])
    for sentence in tie_sentences(report["ties"], report["control"]["n_scored"]):
        terminal.say(sentence)
    rows = [
        ("control points", report["control"], "after"),
        ("  each left out in turn", report["control"], "leave_one_out"),
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

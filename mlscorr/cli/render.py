"""Command that draws pictures of a survey before and after its correction."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

import mlscorr
from mlscorr.cli.folders import chosen_out
from mlscorr.cli.progress import progress_bars
from mlscorr.cli.terminal import (
    Exit,
    Json,
    Out,
    Overwrite,
    Quiet,
    SurveyArgument,
    Verbose,
    exit_code,
    say,
)
from mlscorr.cli.work import print_json, work

View = StrEnum("View", ("overview", "targets", "section"))
Colour = StrEnum("Colour", ("intensity", "height", "correction", "sigma"))
Engine = StrEnum("Engine", ("zbuffer", "open3d"))

EXAMPLES = (
    "mlscorr render survey.toml --corrected survey-correct",
    "mlscorr render survey.toml -o pictures --view section --size 1280x720",
)


def render(
    survey: SurveyArgument,
    out: Out = None,
    corrected: Annotated[
        Path | None,
        typer.Option(help="Results of mlscorr correct; if omitted, the correction is estimated."),
    ] = None,
    view: Annotated[list[View], typer.Option(help="May be repeated.")] = tuple(View),
    colour: Annotated[
        Colour | None,
        typer.Option(help="Coloring of the points; by default the most informative one."),
    ] = None,
    size: Annotated[str, typer.Option(help="Width x height of each PNG in pixels.")] = "1920x1080",
    azimuth: Annotated[
        float | None, typer.Option(help="Viewing direction, in degrees clockwise from north.")
    ] = None,
    elevation: Annotated[
        float | None,
        typer.Option(
            min=-90, max=90, help="Elevation of the viewpoint, in degrees above the horizon."
        ),
    ] = None,
    view_angle: Annotated[
        float, typer.Option(min=0, max=120, help="Field of view; 0: parallel projection.")
    ] = 0.0,
    engine: Annotated[
        Engine, typer.Option(help="open3d adds the reference surface to the overview, slower.")
    ] = Engine.zbuffer,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """Draw a survey before and after its correction; needs neither display nor GPU."""
    out = chosen_out(out, survey, "render")
    with exit_code(Exit.USAGE), progress_bars():
        pixels = _read_size(size)
    with work(out, overwrite, survey) as progress:
        drawn = mlscorr.render(
            mlscorr.read_survey(survey),
            out,
            corrected,
            pixels,
            overwrite,
            progress,
            views=tuple(view),
            engine=str(engine),
            colour=colour and str(colour),
            azimuth=azimuth,
            elevation=elevation,
            view_angle=view_angle,
        )
    print_json(drawn, as_json)
    for picture in drawn["pictures"]:
        say(f"{out / picture['file']}: {picture['title']}")


def _read_size(text):
    """Width and height from a text such as 1920x1080."""
    from mlscorr.report.render import PictureOptions, check_pictures, panel_size

    width, times, height = text.lower().partition("x")
    if not (times and width.strip().isdecimal() and height.strip().isdecimal()):
        raise ValueError(
            f"The size '{text}' is not width x height in pixels. Give it as 1920x1080."
        )
    page = int(width), int(height)
    check_pictures(PictureOptions(panel_size(page)))  # before the survey is read
    return page

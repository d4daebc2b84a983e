"""All figures of a correction, by name, as SVG for the page and as PNG files."""

from functools import partial
from pathlib import Path

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report._residuals import residual_figure
from mlscorr.report._tie_map import tie_figure
from mlscorr.report._timeline import attitude_figure, correction_figure
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.style import Figures, png
from mlscorr.report.target_map import map_figure


def correction_figures(
    correction: Correction, report: CorrectionReport, ties: TieResiduals | None = None
) -> Figures:
    """Functions that draw the figures of a correction, by name.

    ``correction``, ``attitude``, ``map``, and ``residuals`` and ``ties`` where there are some.

    Parameters
    ----------
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional
    """
    figures: Figures = {
        "correction": partial(correction_figure, correction, report),
        "attitude": partial(attitude_figure, correction, report),
        "map": partial(map_figure, correction, report),
    }
    if report.control.n or report.check.n:
        figures["residuals"] = partial(residual_figure, report)
    if ties is None:
        return figures
    return figures | {"ties": partial(tie_figure, correction, ties)}


def write_pictures(
    folder: str | Path,
    correction: Correction,
    report: CorrectionReport,
    ties: TieResiduals | None = None,
) -> list[Path]:
    """Write correction.png, map.png and, where there are some, residuals.png and ties.png.

    Parameters
    ----------
    folder : path
        Which exists.
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional

    Returns
    -------
    list of Path
    """
    figures = correction_figures(correction, report, ties)
    del figures["attitude"]
    paths = [Path(folder) / f"{name}.png" for name in figures]
    for path, draw in zip(paths, figures.values(), strict=True):
        path.write_bytes(png(draw()))
    return paths

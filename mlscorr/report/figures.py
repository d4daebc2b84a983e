"""All figures of a correction, by name, as SVG for the page and as PNG files."""

from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.residuals import residual_figure
from mlscorr.report.style import png, svg
from mlscorr.report.target_map import map_figure
from mlscorr.report.tie_map import tie_figure
from mlscorr.report.timeline import attitude_figure, correction_figure


def draw_figure(
    name: str, correction: Correction, report: CorrectionReport, ties: TieResiduals | None = None
) -> Figure:
    """A figure of a correction.

    Parameters
    ----------
    name : str
        ``correction``, ``attitude``, ``map``, and ``residuals`` and ``ties`` where there are some.
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional

    Raises
    ------
    ValueError
        Where there is no such figure.
    """
    figures = _figures(correction, report, ties)
    if name not in figures:
        raise ValueError(f"There is no figure '{name}' of this correction: {', '.join(figures)}.")
    return figures[name]()


def drawings(
    correction: Correction, report: CorrectionReport, ties: TieResiduals | None = None
) -> dict[str, bytes]:
    """The page's figures by name, each as the bytes of an SVG.

    Parameters
    ----------
    correction : Correction
    report : CorrectionReport
    ties : TieResiduals, optional
    """
    return {name: svg(draw()) for name, draw in _figures(correction, report, ties).items()}


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
    figures = _figures(correction, report, ties)
    del figures["attitude"]
    paths = [Path(folder) / f"{name}.png" for name in figures]
    for path, draw in zip(paths, figures.values(), strict=True):
        path.write_bytes(png(draw()))
    return paths


def _figures(correction, report, ties):
    """Functions that draw the figures, by name."""
    figures = {
        "correction": partial(correction_figure, correction, report),
        "attitude": partial(attitude_figure, correction, report),
        "map": partial(map_figure, correction, report),
    }
    if report.control.n or report.check.n:
        figures["residuals"] = partial(residual_figure, report)
    return figures if ties is None else figures | {"ties": partial(tie_figure, correction, ties)}

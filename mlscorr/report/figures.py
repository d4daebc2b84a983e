"""All figures of a correction, by name, as SVG for the page and as PNG files."""

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

FIGURES = ("correction", "attitude", "map", "residuals", "ties")  # the last where there are ties


def draw_figure(
    name: str, correction: Correction, report: CorrectionReport, ties: TieResiduals | None = None
) -> Figure:
    """A figure of a correction.

    Parameters
    ----------
    name : str
        Of FIGURES.
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional

    Raises
    ------
    ValueError
        Where there is no such figure.
    """
    figures = {
        "correction": lambda: correction_figure(correction, report),
        "attitude": lambda: attitude_figure(correction, report),
        "map": lambda: map_figure(correction, report),
        "residuals": lambda: residual_figure(report),
    }
    if ties is not None:
        figures["ties"] = lambda: tie_figure(correction, ties)
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
    names = FIGURES if ties is not None else FIGURES[:-1]
    return {name: svg(draw_figure(name, correction, report, ties)) for name in names}


def write_pictures(
    folder: str | Path,
    correction: Correction,
    report: CorrectionReport,
    ties: TieResiduals | None = None,
) -> list[Path]:
    """Write correction.png, map.png, residuals.png, and ties.png, into a folder that exists.

    Parameters
    ----------
    folder : path
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    report : CorrectionReport
    ties : TieResiduals, optional

    Returns
    -------
    list of Path
    """
    names = ["correction", "map", "residuals", *(["ties"] if ties is not None else [])]
    paths = []
    for name in names:
        paths.append(Path(folder) / f"{name}.png")
        paths[-1].write_bytes(png(draw_figure(name, correction, report, ties)))
    return paths

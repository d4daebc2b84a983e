"""All figures of a correction, as SVG for the page and as PNG files."""

from pathlib import Path

from mlscorr.correction import Correction
from mlscorr.estimate import TieResiduals
from mlscorr.report.correction_report import CorrectionReport
from mlscorr.report.residuals import residual_figure
from mlscorr.report.style import png, svg
from mlscorr.report.target_map import map_figure
from mlscorr.report.tie_map import tie_figure
from mlscorr.report.timeline import attitude_figure, correction_figure


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
    of_ties = {} if ties is None else {"ties": svg(tie_figure(correction, ties))}
    return of_ties | {
        "correction": svg(correction_figure(correction, report)),
        "attitude": svg(attitude_figure(correction, report)),
        "map": svg(map_figure(correction, report)),
        "residuals": svg(residual_figure(report)),
    }


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
    pictures = {
        "correction.png": correction_figure(correction, report),
        "map.png": map_figure(correction, report),
        "residuals.png": residual_figure(report),
    }
    if ties is not None:
        pictures["ties.png"] = tie_figure(correction, ties)
    paths = []
    for name, figure in pictures.items():
        paths.append(Path(folder) / name)
        paths[-1].write_bytes(png(figure))
    return paths

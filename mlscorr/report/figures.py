"""All figures of a correction, as SVG for the page and as PNG files."""

from pathlib import Path

import matplotlib

from mlscorr.report.look import STYLE, svg
from mlscorr.report.plan import map_figure
from mlscorr.report.residuals import residual_figure
from mlscorr.report.timeline import attitude_figure, correction_figure

DOTS_PER_INCH = 200
PICTURES = (
    ("correction.png", correction_figure),
    ("map.png", map_figure),
    ("residuals.png", residual_figure),
)


def drawings(survey, correction, document):
    """The page's figures by name, each as the bytes of an SVG."""
    draw = {
        "correction": correction_figure,
        "attitude": attitude_figure,
        "map": map_figure,
        "residuals": residual_figure,
    }
    return {name: svg(figure(survey, correction, document)) for name, figure in draw.items()}


def write_pictures(folder, survey, correction, document):
    """Write correction.png, map.png and residuals.png into a folder that exists.

    Parameters
    ----------
    folder : path
    survey : Survey
    correction : Correction
        Its corrected trajectory may hold the sigmas after the estimate.
    document : dict
        The content of report.json.

    Returns the list of their paths.
    """
    paths = []
    for name, draw in PICTURES:
        path = Path(folder) / name
        with matplotlib.rc_context(STYLE):
            figure = draw(survey, correction, document)
            figure.savefig(path, format="png", dpi=DOTS_PER_INCH, metadata={"Software": "mlscorr"})
        paths.append(path)
    return paths

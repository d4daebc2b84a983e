"""Pictures of a cloud before and after its correction, drawn without a display or a GPU."""

from mlscorr.report.render.drawing import check_pictures, draw
from mlscorr.report.render.picture import Picture, panel_size
from mlscorr.report.render.quantities import (
    LABELS,
    colour_scale,
    colour_table,
    percentiles,
    swatches,
)
from mlscorr.report.render.section import worst_facades
from mlscorr.report.render.symbols import MARK
from mlscorr.report.render.view import PictureOptions

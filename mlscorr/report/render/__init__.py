"""Pictures of a cloud before and after its correction, drawn without a display or a GPU."""

from mlscorr.report.render.drawing import ENGINES, draw
from mlscorr.report.render.picture import Picture, panel_size
from mlscorr.report.render.quantities import COLOURS
from mlscorr.report.render.views import VIEWS, Look

__all__ = ["COLOURS", "ENGINES", "VIEWS", "Look", "Picture", "draw", "panel_size"]

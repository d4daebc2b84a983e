"""Surfaces of a cloud while it streams: cells of space and time, their planes, poles and paint.

Sums over the points of a cell are all that is kept of them (CellTable); planes and poles follow
from these (FeatureCollector), and planes alone from the points themselves, without those that lie
off them (search_planes), of moments that are whole (MomentStream).
"""

from mlscorr.surfaces._thinning import (
    direction_class,
    first_of_groups,
    kind_number,
    some_blocks,
)
from mlscorr.surfaces.cells import Cells, CellTable, covariances
from mlscorr.surfaces.features import FeatureCollector, join_features
from mlscorr.surfaces.places import block_chance, cell_corner, chance, integer_hash, place_key
from mlscorr.surfaces.planes import (
    FittedPlanes,
    PlaneSearch,
    degrees_of_freedom,
    fit_planes,
    search_planes,
)
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.surfaces.stream import MomentStream

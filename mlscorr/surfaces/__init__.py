"""Surfaces of a streamed cloud: cells of space and time, and their planes, poles and paint.

FeatureCollector finds all three for ties from the moments of cells (CellTable) only, for points in
any order. search_planes refines planes by the points of complete moments (MomentStream) for the
diagnosis, which needs these points again.
"""

from mlscorr.surfaces._thinning import direction_class, first_of_groups, kind_number
from mlscorr.surfaces.cells import Cells, CellTable
from mlscorr.surfaces.features import FeatureCollector, join_features
from mlscorr.surfaces.places import (
    BoundedChoice,
    block_chance,
    cell_corner,
    chance,
    integer_hash,
    place_key,
)
from mlscorr.surfaces.planes import degrees_of_freedom, fit_planes, search_planes
from mlscorr.surfaces.settings import SETTINGS
from mlscorr.surfaces.stream import MomentStream, pass_numbers

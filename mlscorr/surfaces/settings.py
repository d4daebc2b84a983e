"""Settings of the search for planes, poles and paint."""

from dataclasses import dataclass

from mlscorr.survey import COORDINATE_ROUNDING, PAUSE


@dataclass(frozen=True)
class Settings:
    """Limits and sizes, each with its unit and reason."""

    # Cells
    cell: float = 1.0  # m: about a hundred points of a scanner in a street, mostly flat
    moment: float = 1.0  # s: the POS error is one value over it (a POS has a bandwidth of 1 Hz)
    cells_in_memory: int = 200_000  # 38 MB: some seconds of any scanner; guard
    block_cells: int = 4  # edge of the ground blocks that a selection keeps whole
    # Planes and poles
    feature_points: int = 24  # of a feature: 21 degrees of freedom give a variance to a third
    roughest: float = 0.05  # m about a plane: asphalt and masonry have centimeters, shrubs more
    narrowest: float = 0.15  # m, one sigma along a side: half a cell (1 / sqrt(12) for a whole one)
    rounding: float = COORDINATE_ROUNDING  # m
    trims: tuple[float, ...] = (2.0, 2.5, 3.0, 3.5)  # sigmas; the last takes 0.05 % of the noise
    least_plane_sine: float = 0.05  # of beam to plane: a road 50 m from a scanner 2.5 m above it
    thickest: float = 0.18  # m: radius of a pole or young trunk; people are wider
    largest_lean: float = 0.2  # rad: of a pole, branches lean more; of a road, ramps lean less
    roundness: float = 0.1  # of the radius, one sigma: a square mast's axis is 1 - pi/4 deeper
    # Paint
    widest_paint: float = 0.75  # m along a scan line: a stop line of 0.5 m, crossed at 45 deg
    contrast: float = 5.0  # sigmas of the road's intensity, of 15 %: worn paint has twice it
    crossings: int = 6  # of a line: 4 degrees of freedom give the scatter to a third
    pause: float = PAUSE  # s in which a line is continued
    # Thinning
    features: int = 32  # of a second and direction of a pass: two blocks of a wall or road
    thinning_block: float = 4.0  # m: neighbors are kept together, so that passes keep the same


SETTINGS = Settings()

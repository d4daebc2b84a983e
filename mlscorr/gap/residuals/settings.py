"""Settings of the compared data, with their reasons."""

from dataclasses import dataclass

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class Settings:
    """Patches, pairing of patches, and limits of differences.

    Sizes suit street scenes, and some are those of ties; ``python benchmarks/gap_study.py`` shows
    their effect.
    """

    # patches
    cell: float = SURFACES.cell  # m
    moment: float = SURFACES.moment  # s
    plane_points: int = SURFACES.feature_points  # of a plane
    samples: int = 12  # pulses per patch: their mean has a third of their scatter
    trims: tuple[float, ...] = SURFACES.trims  # sigmas
    rule: float = 0.9  # share from which a part represents the whole: of points, of pauses
    roughest: float = SURFACES.roughest  # m about a plane
    narrowest_patch: float = 0.12  # m, one sigma across: a normal to 1 deg from noise of 2 mm
    rounding: float = SURFACES.rounding  # m
    file_step: float = 1e-3  # m: the usual scale factor of LAS coordinates
    patches: int = 1000  # on surfaces, of up to three rows; 200 were enough in gap_study
    patch_pulses: int = 400  # of a patch, replayed: a mean to a twentieth of the noise
    longest_miss: float = 4.5  # pulses: longer pauses, at a loss of 30 %, are 1 % (0.3^4)
    line_pause: float = 20.5  # pulses: a longer pause is another scan line
    # what is compared
    surface_gate_sigmas: float = 4.0  # of the stated 3D sigma: 1 in 1 000 normal errors is larger
    least_surface_gate: float = 0.5  # m: the POS's sigma excludes the mounting; cars are farther
    outlier_interval: float = 5.0  # s, the longest time over which a POS error is one shift
    odd_distance: float = 0.03  # m: more than attitude errors within an interval
    odd_sigmas: float = 6.0  # of the scatter within an interval
    spread_bins: int = 8  # of each covariate, over which a choice is spread
    pause: float = TIES.pause  # s between two visits of one pass
    pair_distance: float = 0.7  # cells between the middles of two patches of one plane
    parallel: float = TIES.parallel  # rad
    surface_sigma: float = TIES.surface_sigma  # m; facets of static scans are not planes either
    facet_share: float = 0.75  # of a patch's beams that must meet one plane of the reference
    overlap: float = 0.01  # of the patches on the reference; fewer are chance: it is elsewhere
    same_time: float = 1e-6  # s: of one pulse in two files; a scanner of 1 MHz is as fast
    # channels
    least_loss: float = 0.002  # share that any scanner loses: no loss in 100 pulses is no proof
    largest_ripple: float = 1.5  # of Patches: 19 of 20 flat ones have less, by chance
    fired: int = 20  # pulses between points of a patch, to compute a share of them
    thinned: float = 0.6  # median share of returns: below it the cloud was thinned
    # covariates
    location_reach: float = 50.0  # m from the first pass, up to which it defines the location
    motion_step: float = 0.25  # s to each side, over which speed and turn rate are computed
    on_target: float = 0.45  # of a target's size from its center: on a disc, and on a plate

    @property
    def pool(self) -> int:
        """Patches in memory: six for each chosen one, so that the choice can be spread."""
        return 6 * self.patches


SETTINGS = Settings()

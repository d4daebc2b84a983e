"""Numbers of what is compared, with their reasons."""

from dataclasses import dataclass

from mlscorr.surfaces import SETTINGS as SURFACES
from mlscorr.ties import SETTINGS as TIES


@dataclass(frozen=True)
class Settings:
    """How patches are made, when two of them are one plane, and what is too far off.

    Sizes are those of street scenes, some of them those of ties;
    ``python benchmarks/gap_study.py`` shows what they give.
    """

    # patches
    cell: float = SURFACES.cell  # m
    moment: float = SURFACES.moment  # s
    plane_points: int = SURFACES.feature_points  # of a plane
    samples: int = 12  # pulses that stand for a patch: their mean has a third of their scatter
    trims: tuple[float, ...] = SURFACES.trims  # sigmas
    rule: float = 0.9  # share from which on a part stands for the whole: of points, of pauses
    roughest: float = SURFACES.roughest  # m about a plane
    narrowest_patch: float = 0.12  # m, one sigma across: a normal to 1 deg from noise of 2 mm
    rounding: float = SURFACES.rounding  # m
    file_step: float = 1e-3  # m: the usual scale factor of LAS coordinates
    patches: int = 1000  # on surfaces, of up to three rows; 200 were enough in gap_study
    patch_pulses: int = 400  # of a patch, fired again: a mean to a twentieth of the noise
    longest_miss: float = 4.5  # pulses: of longer pauses a loss of 30 % makes 1 % (0.3^4)
    line_pause: float = 20.5  # pulses: a longer pause is another scan line
    # what is compared
    surface_gate_sigmas: float = 4.0  # of the stated 3D sigma: 1 in 1 000 normal errors lies beyond
    least_surface_gate: float = 0.5  # m: the POS's sigma lacks the mounting; cars stand off
    outlier_interval: float = 5.0  # s at most, over which a POS error is one shift
    odd_distance: float = 0.03  # m: more than attitude errors make within a window
    odd_sigmas: float = 6.0  # of a window's own scatter
    spread_bins: int = 8  # of each covariate, over which a choice is spread
    pause: float = TIES.pause  # s between two visits of one pass
    pair_distance: float = 0.7  # cells between the middles of two patches of one plane
    parallel: float = TIES.parallel  # rad
    surface_sigma: float = TIES.surface_sigma  # m; facets of static scans are no planes either
    facet_share: float = 0.75  # of a patch's beams that must meet one plane of the reference
    overlap: float = 0.01  # of the patches on the reference; fewer are chance: it lies elsewhere
    same_time: float = 1e-6  # s: of one pulse in two files; a scanner of 1 MHz fires as often
    # channels
    least_loss: float = 0.002  # share that any scanner loses: no loss in 100 pulses proves nothing
    largest_ripple: float = 1.5  # of Patches: 19 of 20 flat ones have less, by chance
    fired: int = 20  # pulses between points of a patch, to speak of a share of them
    thinned: float = 0.6  # median share of returns: below it the cloud was thinned
    # covariates
    beside: float = 50.0  # m from the first pass, up to which a place has a location along it
    motion_step: float = 0.25  # s to each side, over which speed and turn rate are taken
    on_target: float = 0.45  # of a target's size from its centre: on a disc, and on a plate

    @property
    def pool(self) -> int:
        """Patches in memory: six for each that is chosen, so that a choice can be spread."""
        return 6 * self.patches


SETTINGS = Settings()

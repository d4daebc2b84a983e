"""Settings of the extraction of targets."""

from dataclasses import dataclass

from mlscorr.survey import COORDINATE_ROUNDING


@dataclass(frozen=True)
class Settings:
    """Limits, resolutions and sigmas; sizes are a target's diameter or edge.

    If no source is given, ``benchmarks/ablation.py targets`` shows the effect on recall, center
    errors and false targets.
    """

    # Candidates and visits
    near_radius: float = 2.0  # m; a post supports the target; plates are searched first within it
    piece_points: int = 20_000  # points; bounds the time for one piece; guard
    turn_step: float = 0.5  # m; a vehicle that moved less may stand and shake instead of reversing

    # Clusters and seeds
    smallest_count: int = 20  # points; fewer do not determine plane and outline
    smallest_levels: int = 4  # intensities; fewer are a flag or a class, not an intensity; guard
    link_shares: tuple[float, float] = (0.2, 0.4)  # size; near a bright post; wide scan lines
    thickness: float = 0.03  # m; from a plane: less than the depth of a post or frame
    plane_trials: int = 100  # triples; they find a plane of a third of the points with 0.98
    size_guesses: tuple[float, float, float] = (0.2, 0.4, 0.8)  # m; each covers half to twice of it
    smallest_length: float = 0.7  # size; along the visible part of a target
    smallest_width: float = 0.33  # size; across it: a post may hide part of a target
    bloom: float = 1.35  # size; of a disc that saturates the receiver
    plane_patches: int = 10  # patches; road, walls, then plates; and gaps in a patch
    least_crossing_sine: float = 0.1  # sine; of a beam to a plane that it crosses

    # Outlines
    trials: int = 600  # outlines; in each round, half of them in a rough fit
    rough_rounds: int = 5  # rounds; to detect an outline; the exact fit needs five times as many
    least_effective_share: float = 0.1  # trials; below it the likelihood is flattened
    proposal_width: float = 1.35  # sigma; of the posterior, for the next trials
    hidden_share: float = 0.45  # size; from the seed to the center: half of it may be hidden
    first_blur: float = 8.0  # size over blur; wide at first, so that no outline is lost
    rough_blur: float = 0.025  # size; of a rough fit
    wrong_side: float = 0.01  # beams; on the wrong side at any distance (mixed returns)
    divergence: float = 0.35e-3  # rad; four sigmas of a beam's width (RIEGL VQ-250 data sheet)
    rounding: float = COORDINATE_ROUNDING  # m
    intensity_spread: float = 0.2  # intensity; relative spread if it is unknown
    same_surface: float = 0.7  # dark over bright; from this ratio they may be one
    outside_middle: float = 0.65  # diameter; from a seed's middle, itself off by a seventh of it
    contradiction: float = 0.05  # beams; share of those without a return, well inside the outline
    core: float = 0.2  # size; around the center: in the dark disc of a ring of at least 0.4

    # Assessment
    smallest_overlap: float = 0.8  # Jaccard index; of outline and beams
    close_overlap: float = 0.93  # Jaccard index; settles the position, or hides a part
    smallest_support: float = 0.35  # outline; with beams on both sides: half may be hidden
    hole_support: float = 0.75  # outline; of a hole: other gaps are open or have corners
    largest_sigma: float = 0.08  # size; beyond it the center is free in one direction
    good_support: float = 0.6  # outline; above it a target is beyond doubt
    good_contrast: float = 0.3  # bright to dark; difference over sum, beyond doubt
    bush: float = 0.8  # tolerance; sigma about the plane: as thick as a bush
    rim_places: int = 48  # places; along an outline
    rough_play: float = 0.1  # overlap or size; tolerance of a rough fit

    # Search without control
    largest_size: float = 1.5  # m; larger targets are not portable; guard
    largest_carry: float = 0.25  # chunk; points searched again with the next one; guard
    largest_fits: int = 150  # regions; bounds time and memory of a chunk full of reflections; guard
    rim: tuple[float, float] = (1.15, 1.6)  # half diagonal; end of the rim, and of its test
    smallest_likeness: float = 0.75  # Jaccard index; a ring has a dark quarter
    largest_ratio: float = 1.6  # width; length of a partly hidden target


SETTINGS = Settings()

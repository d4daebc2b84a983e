"""Settings of pages, figures and pictures."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Sizes and limits of the report's contents.

    None of them changes a result. If no other source is named, they were chosen from the pages of
    wuhan_drive and of the practice surveys, on screen and on paper. Sizes of letters and lines in
    figures are in ``mlscorr.report.style.STYLE``.
    """

    # words and figures
    difference: float = 0.002  # m; accuracy of a surveyed target, and thus finest axis
    figure_width: float = 7.6  # inch: A4 without its margins
    dots_per_inch: int = 200  # of PNGs: letters of 8.5 pt stay sharp on paper
    curve_epochs: int = 3000  # rows of a curve: two for each dot of a figure's width
    locator_width: float = 4.4  # inch, of the small map on the first screen
    longest_arrow: float = 0.12  # of the map's width
    axis_names: int = 60  # more names under an axis would touch each other

    # targets, as found
    ellipse_scale: float = 10.0  # one sigma itself is too small to see
    low_score: float = 0.9  # most true targets have more; lower ones need a check, not refusal
    target_figure: tuple[float, float] = (1.85, 2.15)  # inch

    # samples of the cloud
    sample_points: int = 1_000_000  # of each part; up to twice as many are collected; guard
    plan_cell: float = 2.0  # m, of the grid to find points near targets and walls
    framing_points: int = 100_000  # that frame the whole survey; more do not change a pixel
    viewer_points: tuple[int, int] = (36_000, 24_000)  # even and near targets: 3 MB of a page
    shown_points: int = 300_000  # of a page of clouds alone: 6 MB
    shown_extent: float = 100_000.0  # m; float32, in which views draw, resolves 4 mm there
    close_ups: int = 24  # targets: 15 MB of a page
    panel: tuple[int, int] = (640, 480)  # pixels
    close_up: tuple[int, int] = (440, 330)  # pixels, as shown on the page, and so are its letters

    # how pictures are taken of it
    darkest_median: float = 0.35  # of a scale, where the darker picture has its median
    strongest_power: float = 4.0  # of the scale, lest noise near zero fill it
    canvas_bytes: float = 400e6  # B: as many views as fit are drawn at once; guard
    finest_picture: float = 40e6  # pixels of a picture while marks are drawn: 120 MB; guard
    picture_sizes: tuple[int, int] = (64, 8192)  # pixels, least and largest width and height; guard
    page_margins: tuple[float, float, float, float] = (0.012, 0.105, 0.11, 0.045)
    # of width or height: next to the panels, above and below them, between stacked ones
    open3d_timeout: float = 60.0  # s for a pair of pictures; a software driver takes 5 s; guard
    largest_street: float = 250.0  # m; larger ones are viewed from above, without overlaps
    sideways_angle: float = 50.0  # deg, at most, to see all of a target's misclosure
    visible: float = 0.01  # m, a misclosure that is viewed from the side
    section_half_width: tuple[float, float] = (1.0, 6.0)  # m, at least and at most
    wall_height: float = 1.5  # m, of the smallest wall
    wall_flatness: float = 0.05  # m, the largest standard deviation of its points from a plane
    facades: int = 20  # of ties, with the largest misclosures: some of them are well covered
    normal_points: int = 15  # required to determine the orientation of a wall or target


SETTINGS = Settings()

"""Dimensions and reflectances of objects along a way, with a dataclass for each kind.

Lengths are in m; reflectances are ratios at the wavelengths of scanners, 905 to 1550 nm. Pairs are
ranges from which each object draws its own value. Values without a source are usual in towns; they
make a scene realistic, and no estimate uses them.
"""

from dataclasses import dataclass

from numpy.random import Generator

ROOT = 0.3  # m, depth of posts, trunks and lamps in the ground, which may slope
ON_WALL = 0.02  # m, from a target to the wall behind it
ON_GROUND = 0.01  # m, from a target to the road or slope below it
WALL_ENDS = 0.4  # m, between a target and the ends of its front


@dataclass(frozen=True)
class LampSize:
    """A street lamp.

    Parameters
    ----------
    height, width : float
        Of its mast, a square one. Units: m.
    arm, arm_width, arm_depth : float
        Length, width and height of the arm with the light. Units: m.
    arm_drop : float
        From the mast's top down to the arm's lower side. Units: m.
    reflectance : float
        Of galvanized steel.
    """

    height: float = 6.0
    width: float = 0.14
    arm: float = 1.2
    arm_width: float = 0.2
    arm_depth: float = 0.12
    arm_drop: float = 0.1
    reflectance: float = 0.3


@dataclass(frozen=True)
class CarSize:
    """A parked car, a mid-size hatchback of 4.2 m.

    Parameters
    ----------
    width : float
        Units: m.
    ahead, above : tuple of float
        Corners of its outline as seen from the side: forward of its middle, above the ground, from
        the lower rear corner on. Units: m.
    middle : float
        Height of the place from which the sides' triangles spread. Units: m.
    reflectance : tuple of float
        Of dark to bright paint.
    """

    width: float = 1.7
    ahead: tuple[float, ...] = (-2.1, 2.1, 2.1, 1.15, 0.45, -1.1, -1.8, -2.1)
    above: tuple[float, ...] = (0.25, 0.25, 0.65, 0.85, 1.4, 1.42, 0.95, 0.85)
    middle: float = 0.7
    reflectance: tuple[float, float] = (0.1, 0.5)


@dataclass(frozen=True)
class TreeSize:
    """A tree, and the leaves of any crown.

    Parameters
    ----------
    trunk : tuple of float
        Height below the crown, which a vehicle passes. Units: m.
    thickness : tuple of float
        Of the trunk, a square one. Units: m.
    bark : float
        Reflectance.
    density : tuple of float
        Leaves per product of the crown's half axes. Units: 1/m^3.
    most_leaves : int
        So that a scene's size stays bounded.
    leaf : float
        Mean distance of a leaf's corners from its middle before `leaf_scale`: a bunch of real ones,
        so that hundreds fill a crown. Units: m.
    leaf_scale : float
        About 1 / sqrt(3), from the edge of an equilateral triangle to the distance of its corners.
    hollow : float
        Share of the crown's volume about its middle that is without leaves.
    leaf_reflectance : tuple of float
        Of green leaves at 905 nm.
    """

    trunk: tuple[float, float] = (2.9, 3.4)
    thickness: tuple[float, float] = (0.18, 0.3)
    bark: float = 0.25
    density: tuple[float, float] = (150.0, 320.0)
    most_leaves: int = 1500
    leaf: float = 0.2
    leaf_scale: float = 0.58
    hollow: float = 0.1
    leaf_reflectance: tuple[float, float] = (0.35, 0.6)


@dataclass(frozen=True)
class BushSize:
    """A bush on a slope.

    Parameters
    ----------
    size : tuple of float
        Of `axes`, `height` and `leaves`.
    axes : tuple of float
        Half axes along the shore, across it and upright. Units: m.
    height : float
        Of its middle above its foot. Units: m.
    leaves : float
        Number of leaves of a bush of size 1.
    scatter : float
        Distance of bushes from their row, to each side. Units: m.
    """

    size: tuple[float, float] = (0.5, 1.0)
    axes: tuple[float, float, float] = (1.2, 1.0, 0.8)
    height: float = 0.6
    leaves: float = 500
    scatter: float = 2.0


@dataclass(frozen=True)
class HouseSize:
    """A house with a gable roof, and its front of recessed windows; or a plain wall.

    Parameters
    ----------
    lowest : float
        Eaves above the ground, below which it is a wall. Units: m.
    depth, wall_depth : float
        From front to back, of a house and of a wall. Units: m.
    ridge : float
        Of the roof above the eaves. Units: m.
    base : float
        Depth below the lower corner of its front. Units: m.
    ground_floor : float
        Height without windows, above the higher corner. Units: m.
    storey, bay : float
        Height and width of the wall around a window. Units: m.
    frame, window : float
        Share of a bay and story to each side of a window, and of the window itself.
    recess : float
        Of a window behind the front. Units: m.
    reflectance : tuple of float
        Of plaster and brick.
    roof, glass : float
        Reflectance of tiles, and of a pane off its mirror direction.
    """

    lowest: float = 5.0
    depth: float = 8.0
    wall_depth: float = 0.3
    ridge: float = 2.5
    base: float = 0.5
    ground_floor: float = 3.2
    storey: float = 3.0
    bay: float = 2.6
    frame: float = 0.25
    window: float = 0.5
    recess: float = 0.18
    reflectance: tuple[float, float] = (0.2, 0.5)
    roof: float = 0.3
    glass: float = 0.1


@dataclass(frozen=True)
class HouseRow:
    """Houses along a way.

    Parameters
    ----------
    width : tuple of float
        Of a front. Units: m.
    gap : tuple of float
        Between two fronts. Units: m.
    setback : tuple of float
        By which fronts vary. Units: m.
    """

    width: tuple[float, float]
    gap: tuple[float, float]
    setback: tuple[float, float]


@dataclass(frozen=True)
class Furniture:
    """Positions of objects of one kind.

    Parameters
    ----------
    across : float
        From the curb away from the road, or from the water's edge inland. Units: m.
    extent : float
        Half length along the way that remains free of other objects. Units: m.
    """

    across: float
    extent: float


@dataclass(frozen=True)
class TargetHeight:
    """Heights of targets on a support.

    Parameters
    ----------
    least : float
        Of the center. Units: m.
    below : float
        Smallest clearance below the target. Units: m.
    span : float
        Range of the heights. Units: m.
    """

    least: float
    below: float
    span: float

    def draw(self, half: float, rng: Generator, extra_height: float = 0.0) -> float:
        """Draw the height of a target's center above its foot. Units: m.

        Parameters
        ----------
        half : float
            From the center to the edge of the target. Units: m.
        rng : Generator
        extra_height : float
            Additional height. Units: m.
        """
        low = max(self.least, half + self.below) + extra_height
        return rng.uniform(low, low + self.span)


@dataclass(frozen=True)
class TargetPostSize:
    """Post of a target, and the slat that hides a part of some targets.

    Parameters
    ----------
    width : float
        Of a square post. Units: m.
    reflectance : float
        Of both.
    slat_distance, slat_depth : float
        Of the slat before the target, and of itself. Units: m.
    slat_circle, slat_square : tuple of float
        Width of the slat before a target of either kind: it hides 20 to 40 % of it. Unit: its size.
    slat_offset : float
        To each side of the target's middle. Unit: its size.
    slat_over : float
        By which it reaches above the target. Units: m.
    """

    width: float = 0.06
    reflectance: float = 0.3
    slat_distance: float = 0.15
    slat_depth: float = 0.02
    slat_circle: tuple[float, float] = (0.17, 0.25)
    slat_square: tuple[float, float] = (0.23, 0.33)
    slat_offset: float = 0.06
    slat_over: float = 0.1


LAMP = LampSize()
CAR = CarSize()
TREE = TreeSize()
BUSH = BushSize()
HOUSE = HouseSize()
TARGET_POST = TargetPostSize()

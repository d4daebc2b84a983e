"""Vehicle of the scanner: height, turning radius, vibrations."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Vehicle:
    """Motion of a vehicle.

    Parameters
    ----------
    pos_height : float
        Of the POS above road or water. Units: m.
    turning_radius : float
        Of a U-turn. Units: m.
    tightest_bend : float
        Smallest radius of bends. Units: m.
    vibration : (3,) tuple
        RMS of roll, pitch, heading. Units: deg.
    heave : float
        RMS in height. Units: m.
    frequencies : tuple
        Of both. Units: Hz.
    calm_speed : float
        Speed at which it vibrates half as much as at full speed; 0 for constant vibration. Units:
        m/s.
    weave : float
        Lateral deviation to each side, because nobody drives a straight line. Units: m.
    weave_length, weave_time : float
        Smallest length and time of a radian of it, which limits it to 0.2 m/s^2. Units: m, s.
    """

    pos_height: float
    turning_radius: float
    tightest_bend: float
    vibration: tuple[float, float, float]
    heave: float
    frequencies: tuple[float, ...]
    calm_speed: float
    weave: float = 0.25
    weave_length: float = 9.0
    weave_time: float = 1.2


CAR = Vehicle(  # a van with the POS on its roof, on its springs: road to body resonance
    pos_height=1.8,
    turning_radius=6.0,
    tightest_bend=25.0,
    vibration=(0.25, 0.15, 0.05),
    heave=0.012,
    frequencies=(0.13, 0.37, 0.9, 1.6),
    calm_speed=1.5,
)
BOAT = Vehicle(  # in small waves of a few meters
    pos_height=2.5,
    turning_radius=8.0,
    tightest_bend=150.0,
    vibration=(1.0, 0.5, 0.2),
    heave=0.04,
    frequencies=(0.11, 0.23, 0.38, 0.55),
    calm_speed=0.0,
)
VEHICLES = {"street": CAR, "mesh": CAR, "river": BOAT}  # by the kind of scene

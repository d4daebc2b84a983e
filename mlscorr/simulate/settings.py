"""Settings of the simulator that belong to no scenario, vehicle, street, receiver or sensor."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Assumptions of a simulation in addition to its scenario, each with unit and reason."""

    # Targets
    board_edge: float = 1.5  # in disc diameters: edge of a circle's dark board
    white: float = 0.9  # reflectance of white target paint
    black: float = 0.06  # reflectance of black target paint
    run_in: float = 6.0  # m from the ends to the first and last target: oblique beams reach them
    jitter: float = 0.25  # of the spacing, so that spacing is not perfectly regular
    largest_target: float = 1.2  # m: a board of 1.8 m fits a lane and a pavement; guard
    target_clearance: float = 0.1  # m at least between two targets
    eye_height: float = 2.2  # m above the way from where targets must be visible: a car's roof
    sight_distance: float = 3.5  # m before and after a target from where it must be visible, too

    # The way
    margin: float = 40.0  # m of way before the start and after the end of the drive
    comfort: float = 2.0  # m/s^2, limit for sideways acceleration and braking
    cornering: float = 1.5  # m/s^2 sideways in a U-turn, at walking pace
    lateral_limit: float = 100.0  # m beside the center line, beyond which there is no scene
    path_quiet: float = 0.08  # s, smoothing of a recorded path: vehicles move below 2 Hz
    course_speed: float = 1.0  # m/s, below which course does not give the heading
    course_time: float = 0.3  # s, over which a heading from the course is smoothed
    trajectory_margin: float = 0.05  # s before the first and after the last pulse of a pass

    # The POS
    filter_rate: float = 10.0  # Hz at least; in 0.1 s the better sensors add 0.1 mm/s, 0.0005 deg
    mistuning: float = 1.3  # software's noise values are within this factor of the truth
    # Factor by which software increases sensor noise to cover unmodeled states, as i2Nav-WHU's
    # KF-GINS does for the ADIS16465 (0.24 instead of the data sheet's 0.15 deg/sqrt(h)).
    unmodelled: float = 1.6
    error_window: float = 30.0  # s of a given series whose RMS is its sigma, as in software
    smallest_position_sigma: float = 0.005  # m, the least that such software reports
    smallest_attitude_sigma: float = np.radians(0.005)  # rad
    aligning_before: float = 120.0  # s: a filter's heading settles in one to two minutes of driving
    aligning_after: float = 60.0  # s, for the smoother
    aligning_speed: float = 8.0  # m/s by which the speed swings meanwhile
    aligning_speed_period: float = 20.0  # s: at most 1.3 m/s^2, a car in traffic
    aligning_turn: float = np.pi / 2  # rad by which the heading swings meanwhile
    aligning_turn_period: float = 40.0  # s: at most 7 deg/s, turns at crossings
    # One sigma at the start of the alignment: a first fix (m), a first velocity (m/s), leveling on
    # the move, the course over ground as heading (rad).
    aligning_sigma: tuple = (0.02, 0.05, np.radians(0.3), np.radians(1.0))

    # Scanners
    no_return_cosine: float = 0.01  # cosine of incidence below which nothing returns
    fading: float = 10.0  # m at which the strength is one half; the near field is flat
    pulse_length: float = 0.6  # m of range within which echoes merge: c / 2 times the usual 4 ns
    speckle: float = 0.08  # relative, one sigma: some 150 speckles a footprint, averaged
    weak: float = 0.01  # of full strength, where a scenario states the share of lost returns
    block_rays: int = 1 << 17  # cast at a time: a block's arrays stay in cache; guard
    hiding_depth: float = 0.03  # m in front of a target's plane, beyond which an object hides it
    hole_board: float = 2.0  # edge of the board around a hole, in its diameters

    # The reference surface
    static_range: float = 50.0  # m from the drive's line, well visible from a tripod scanner
    static_sigma: float = 0.001  # m of each corner: stations agree to 1 mm, noise averages out


SETTINGS = Settings()

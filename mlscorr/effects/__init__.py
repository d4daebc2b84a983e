"""Imperfections of a survey as values: each turns the true value into the recorded one.

An effect has a magnitude in a unit, a source for its usual size, and acts at one stage of the
measurement, on that stage's value:

=========  =====================================  ===========================================
stage      value                                  changed
=========  =====================================  ===========================================
beam       full divergence, rad                   it
clock      Returns                                gps_time
range      Returns                                range
angle      Returns                                angle
return     Returns                                kept
pos        Trajectory, as recorded                position or attitude
mounting   Mounting                               lever_arm or boresight
control    ControlPoints                          position (map_rotation: normal too)
=========  =====================================  ===========================================

Recorded = true + effect, except for the mounting, whose magnitude is the missing correction: true =
recorded + magnitude.

One class defines all of one effect: the change of its stage, its parameters with unit, limits and
sources, its role in an observation, and its words in a report. ``register`` adds a user's own
class.
"""

from mlscorr.effects._quantity import SizeEstimate, quantity
from mlscorr.effects.catalogue import (
    EFFECTS,
    apply_effects,
    effect_class,
    effect_streams,
    effects_by_name,
    in_order,
    known_effects,
    make_effect,
    register,
    register_file,
    run_file,
)
from mlscorr.effects.effect import Effect
from mlscorr.effects.labels import OTHERS, family, lowered, meaning, parameter_title, title, titles
from mlscorr.effects.mounting import Boresight, LeverArm
from mlscorr.effects.ranging import Dropout
from mlscorr.effects.stages import STAGES, Reference, Returns
from mlscorr.effects.vehicle import PositionNoise

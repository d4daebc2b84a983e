"""Second run of the simulator with the effect: reduction of the gap."""

from mlscorr.gap.closure._systematic import LoneEffect, lone_effects
from mlscorr.gap.closure.beams import Beams, collect_beams
from mlscorr.gap.closure.closure import Closure, close_gap
from mlscorr.gap.closure.folds import FoundCause, cause_for_simulator
from mlscorr.gap.closure.rerun import BeamSimulator
from mlscorr.gap.closure.surroundings import Surroundings

"""The simulator once more with the effect in it: how far the gap shrinks."""

from mlscorr.gap.close.ablation import LoneEffect, lone_effects
from mlscorr.gap.close.beams import Beams, collect_beams
from mlscorr.gap.close.closure import Closure, close_gap
from mlscorr.gap.close.folds import cause_for_simulator
from mlscorr.gap.close.found_cause import FoundCause
from mlscorr.gap.close.rerun import BeamSimulator
from mlscorr.gap.close.surroundings import Surroundings

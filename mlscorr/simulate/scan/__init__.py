"""Beams, echoes and their noise; and recorded pulses that are fired again."""

from mlscorr.simulate.scan.echoes import Surfaces
from mlscorr.simulate.scan.noise import noise_streams
from mlscorr.simulate.scan.rays import Platform
from mlscorr.simulate.scan.recorded import RecordedPulses, aim, recorded_platform, recorded_pulses
from mlscorr.simulate.scan.replay import Draws, Met, Replay, true_targets
from mlscorr.simulate.scan.scanner import MeasuredPulses, Shots, pulses_of_a_pass, shoot
from mlscorr.simulate.scan.threads import pool
from mlscorr.simulate.scan.worlds import FORMS, HOLE, Boards, MeshWorld, Planes, TargetWorld, paints

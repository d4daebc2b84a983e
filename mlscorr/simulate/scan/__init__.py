"""Beams, echoes and their noise, and replay of recorded pulses."""

from mlscorr.simulate.scan.echoes import Surfaces
from mlscorr.simulate.scan.rays import Platform
from mlscorr.simulate.scan.replay import (
    Draws,
    Met,
    RecordedPulses,
    Replay,
    aim,
    recorded_platform,
    recorded_pulses,
    true_targets,
)
from mlscorr.simulate.scan.scanner import (
    MeasuredPulses,
    Shots,
    noise_streams,
    pulses_of_a_pass,
    shoot,
)
from mlscorr.simulate.scan.threads import pool
from mlscorr.simulate.scan.worlds import FORMS, HOLE, Boards, MeshWorld, Planes, TargetWorld, paints

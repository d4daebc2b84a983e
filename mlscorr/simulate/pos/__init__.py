"""Data recorded by a position and orientation system."""

from mlscorr.simulate.pos.errors import given_error, pos_error, record
from mlscorr.simulate.pos.navigation import PosError, interpolate

"""What a position and orientation system records of the truth."""

from mlscorr.simulate.pos.errors import given_error, pos_error, record
from mlscorr.simulate.pos.navigation import PosError, interpolate

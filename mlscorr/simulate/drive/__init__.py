"""How the vehicle moves."""

from mlscorr.simulate.drive.passes import drive

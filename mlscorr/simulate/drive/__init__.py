"""Motion of the vehicle."""

from mlscorr.simulate.drive.passes import drive

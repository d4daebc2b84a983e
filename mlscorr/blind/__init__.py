"""Blind check of the diagnosis on surveys with sealed labels."""

from mlscorr.blind._mix import mix
from mlscorr.blind.cases import make_case, outside_mechanisms
from mlscorr.blind.scoring import score

"""Assumptions about the POS, defined once for all rooms.

The POS states a sigma per epoch and component; if its file has none, survey.toml's ``[pos]`` or the
default replaces it. Stated sigmas are a hypothesis: searches allow for more, and estimates scale
them. The recorded path gives further information: a filtered POS that regains GNSS is corrected
within moments, by a step that no vehicle drives. At the step drift restarts, and its size is that
of the drift before it.
"""

from mlscorr.pos.errors import PosErrors
from mlscorr.pos.history import drift_history, runs
from mlscorr.pos.prior import (
    EXCURSIONS,
    HUMP,
    RISE,
    Predictive,
    Process,
    excursion_profile,
    stated_processes,
)
from mlscorr.pos.settings import SETTINGS
from mlscorr.pos.signals import SignalParameters, drift_signals, pose_signals
from mlscorr.pos.stated import StatedSigma
from mlscorr.pos.steps import Steps, find_steps

"""What is believed of the POS, once for everybody.

The POS states a sigma per epoch and component; where its file has none, survey.toml's ``[pos]`` or
the default stands in. What is stated is a hypothesis: searches look farther than it says, and
estimates scale it. The recorded path itself tells more: a filtered POS that regains GNSS falls back
within moments, by a step that no vehicle drives. Across it drift starts anew, and the step is what
the drift had grown to.
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

"""Number of tested faults: some in ``make test``, all of them in ``make faults``.

MLSCORR_FAULTS is the share of the full numbers, 1 in ``make faults``; without it time is not judged
either, as other tests may run beside these.
"""

import os

SHARE = float(os.environ.get("MLSCORR_FAULTS", "0"))
IS_FULL = SHARE > 0


def tries(few, many):
    "Number of faults to try"
    if IS_FULL:
        return max(few, round(SHARE * many))
    return few

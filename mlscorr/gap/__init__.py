"""Which effect explains the difference between a survey and its simulation.

The story, a room each:

- observe: rows of observed minus simulated, from targets, surfaces and planes that passes share
- contrast: channels beside geometry, of a real and a simulated cloud
- signatures: what each effect does to these rows, and the simulator as it is believed
- infer: the verdict, causes with their parameters, where the gap lies, what can be told apart
- close: the simulator with the cause in it, on data that were not used to find it
- plan: what to measure next, and what a survey will show before it is driven
- document: all of it as plain numbers and words
"""

from mlscorr.gap.agreement import agreements
from mlscorr.gap.close import (
    Beams,
    BeamSimulator,
    Closure,
    FoundCause,
    Surroundings,
    cause_for_simulator,
    close_gap,
    collect_beams,
)
from mlscorr.gap.document import gap_document, map_document, separability_document
from mlscorr.gap.infer import (
    Costs,
    Inference,
    Observations,
    Separability,
    compare_signatures,
    infer_causes,
)
from mlscorr.gap.observe import PatchCollector, Rows, background, build_rows
from mlscorr.gap.observe.absence import Absence, find_absence
from mlscorr.gap.plan import NextData, event_sizes, next_data, planned_rows
from mlscorr.gap.signatures import as_believed, with_cause, without_effects

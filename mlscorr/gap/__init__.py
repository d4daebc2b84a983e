"""Which effect explains the difference between a survey and its simulation.

The story, a room each:

- residuals: observed minus simulated, at targets, surfaces and planes that passes share
- contrast: channels beside geometry, of a real and a simulated cloud
- signatures: what each effect does to residuals, and the simulator as the survey states it
- evidence: the verdict, causes with their parameters, where the gap lies, what is separable
- closure: the simulator with the cause in it, on data that were not used to find it
- plan: what to measure next, and what a survey will show before it is driven
- advice, wording, document: what to do about it, its sentences, and all of it as plain numbers
  and words
"""

from mlscorr.gap.document import (
    assumed_document,
    cause_document,
    gap_document,
    map_document,
    separability_document,
    windows_document,
)
from mlscorr.gap.evidence import Costs
from mlscorr.gap.open_scale import likely_scale, open_sigmas, with_scale
from mlscorr.gap.wording import headline, left_out_sentences, no_cause

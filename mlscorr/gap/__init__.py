"""Diagnosis of the difference between a survey and its simulation.

The packages, in order:

- residuals: observed minus simulated, at targets, surfaces and planes in overlaps
- contrast: non-geometric channels of a real and a simulated cloud
- signatures: effects of the library in the residuals, and the simulator stated by the survey
- evidence: verdict, causes with parameters, location of the gap, separability
- closure: the simulator with the cause, on data not used to find it
- plan: next measurements, and expected results of a planned survey
- advice, wording, document: recommended actions, sentences, and the document of all results
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

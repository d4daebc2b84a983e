"""
Match targets and look at the misclosures
=========================================

Targets found near surveyed points get their names: all matches are decided together, as misclosures
(surveyed - observed) change smoothly along the drive. Inspect them before you correct.
"""

from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
targets = mlscorr.find_targets(survey)
targets

# %%
# Surveyed points without an observation are listed in ``matches.refused``, with the reason.

matches = mlscorr.match_targets(targets, survey)
matches

# %%
# A data frame has a row for each observation. Units: m.

matches.to_frame()[["name", "role", "misclosure_easting", "misclosure_northing"]]

# %%
# Misclosures over time, in which the drift of the POS shows.

matches.plot().savefig(out / "misclosures.png", dpi=110)

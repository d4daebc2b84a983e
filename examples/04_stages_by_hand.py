"""
Run the stages by hand
======================

Each stage takes and returns a value that you can inspect, filter or replace. Here targets with a
low score are removed before matching, and the cloud is corrected with laspy.
"""

import laspy
from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
targets = mlscorr.find_targets(survey)
good = targets[targets.score > 0.8]
print(f"{len(good)} of {len(targets)} targets have a score above 0.8")

# %%
# The estimate knows the correction of every epoch, and which targets contradict the others.

matches = mlscorr.match_targets(good, survey)
estimate = mlscorr.estimate_pos_error(survey, matches)
estimate

# %%
# ``apply`` moves points by their gps_time: chunks of a cloud, Open3D clouds, arrays, laspy points.

las = laspy.read(survey.clouds[0].path)
las.points = estimate.correction.apply(las.points)
las.write(out / "corrected.laz")

# %%
# RMSE at control and check points, on each axis.

scores = mlscorr.score(estimate, matches)
scores.plot().savefig(out / "scores.png", dpi=110)
scores

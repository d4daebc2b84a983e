"""
Tie two passes
==============

Planes, poles and paint observed in two passes tie the passes together without control. Ties enter
the estimate together with the control points.
"""

import matplotlib.pyplot as plt
import numpy as np
from small_surveys import output_folder, two_passes

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(two_passes())
ties = mlscorr.find_ties(survey)
ties

# %%
# With ties the sigma of the corrected trajectory is smaller, above all far from control points.

matches = mlscorr.match_targets(mlscorr.find_targets(survey), survey)
figure, panel = plt.subplots(figsize=(8, 3.4), layout="constrained")
for label, tied in (("control points alone", None), ("control points and ties", ties)):
    estimate = mlscorr.estimate_pos_error(survey, matches, tied)
    corrected = estimate.correction.corrected
    time = corrected.gps_time - corrected.gps_time[0]
    sigma = 1000 * np.linalg.norm(corrected.position_sigma, axis=1)
    panel.plot(time, sigma, ".", markersize=2, label=label)
panel.set(xlabel="Time since the start (s)", ylabel="3D sigma of the position (mm)")
panel.legend(markerscale=5)
figure.savefig(out / "sigma.png", dpi=110)

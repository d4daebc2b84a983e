"""
Correct a survey
================

``correct`` runs all stages: it finds and matches the targets, estimates the POS error over time and
gives a result that writes the corrected clouds. Check points are not used in the estimate.
"""

from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
result = mlscorr.correct(survey)
result

# %%
# The folder holds the corrected clouds under their own names, the trajectory with its sigmas, a
# table of the targets and report.json; with ``page=True`` also report.html.

report = result.write(out / "corrected", overwrite=True, page=False)
print("3D RMSE at check points, m:")
print(f"{report['check']['before']['rmse_3d']:.3f} before")
print(f"{report['check']['after']['rmse_3d']:.3f} after")

# %%
# The correction over time, with one sigma.

result.plot("correction").savefig(out / "correction.png", dpi=110)

"""
Extract targets from a LAS file
===============================

``extract`` reads a cloud and lists every object that looks like a target, surveyed or not, with
its center, its covariance and a score. A survey.toml names the LAS file and its trajectory.
"""

import numpy as np
from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
survey

# %%
# Each target has its kind, its size in m, its center and the number of points on it.

found = mlscorr.extract(survey)
found.to_frame()[["name", "kind", "size", "points", "score"]]

# %%
# Targets from above, over a sample of the cloud.

cloud = next(mlscorr.read_cloud(survey.clouds[0]))
centers = np.array([target["observed"] for target in found.targets])
figure = cloud.plot()
figure.axes[0].plot(*centers[:, :2].T, "o", color="#D55E00", fillstyle="none", label="Target")
figure.axes[0].legend()
figure.savefig(out / "targets.png", dpi=110)

"""
Make a survey from arrays
=========================

No file is needed: points, trajectory and control points may be arrays. Coordinates are in m,
gps_time in s in one time system, angles in degrees.
"""

import numpy as np
from small_surveys import output_folder, street

import mlscorr

out = output_folder()
folder = street()
point = next(mlscorr.read_cloud(folder / "pass-1.laz"))
epoch = np.genfromtxt(folder / "trajectory.csv", delimiter=",", skip_header=1)
control = np.genfromtxt(
    folder / "control.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
)

# %%
# Three nouns are made of arrays, and a survey of these.

cloud = mlscorr.PointCloud.from_arrays(point.xyz, point.gps_time, point.intensity)
trajectory = mlscorr.Trajectory.from_arrays(epoch[:, 0], epoch[:, 1:4], epoch[:, 4:7])
place = np.column_stack([control[axis] for axis in ("easting", "northing", "height")])
points = mlscorr.ControlPoints.from_arrays(
    control["name"], place, [0.003] * 3, control["kind"], control["size"]
)
is_check = control["role"] == "check"
survey = mlscorr.Survey.from_arrays(cloud, trajectory, points[~is_check], points[is_check])
survey

# %%
# From here on it is a survey like any other.

result = mlscorr.correct(survey)
result.plot("residuals").savefig(out / "residuals.png", dpi=110)
result

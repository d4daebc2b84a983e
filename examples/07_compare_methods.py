"""
Compare collocation with ICP and affine
=======================================

``compare`` corrects one survey by every method and scores them at the same check points. A rigid
motion, ICP or an affine transformation moves the cloud as a whole: none can follow a drift over
time.
"""

from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
compared = mlscorr.compare(survey)

# %%
# Some of the methods: 3D RMSE in m. ``raw`` is the cloud as recorded, ``lsc`` the collocation.

for name in ("raw", "icp", "affine", "linear", "lsc"):
    print(f"{name:8s} {compared.row(name)['check']['rmse_3d']:.3f}")

# %%
# Each method has a correction that moves points.

cloud = next(mlscorr.read_cloud(survey.clouds[0]))
moved = compared.corrections["icp"].apply(cloud)
print(f"ICP moves the first point by {moved.xyz[0] - cloud.xyz[0]} m")

# %%
# All methods on each axis, the best at the top.

compared.plot().savefig(out / "methods.png", dpi=110)

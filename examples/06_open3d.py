"""
Correct an Open3D cloud, and look
=================================

A cloud becomes an ``open3d.t.geometry.PointCloud`` with its own origin, so that float32 loses no
precision. The correction takes and returns such clouds. Pictures need no display.
"""

import matplotlib.pyplot as plt
from small_surveys import output_folder, street

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(street())
result = mlscorr.correct(survey)
before = next(mlscorr.read_cloud(survey.clouds[0])).to_open3d()
before

# %%
# The corrected cloud has the same points, attributes and origin.

after = result.estimate.correction.apply(before)
moved = (after.point.positions - before.point.positions).numpy()
print(f"Points moved by up to {1000 * (moved**2).sum(axis=1).max() ** 0.5:.0f} mm")

# %%
# ``render`` draws before and after off-screen, with Open3D where its renderer works.

written = result.write(out / "corrected", overwrite=True, page=False)
mlscorr.render(
    survey,
    out / "pictures",
    corrected=out / "corrected",
    views=["overview"],
    engine="open3d",
    overwrite=True,
)
plt.imsave(out / "before-after.png", plt.imread(out / "pictures" / "overview.png"))

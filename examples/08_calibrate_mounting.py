"""
Calibrate lever arm and boresight
=================================

Unlike a drift of the POS, a wrong mounting moves points with the vehicle, not with time. Two passes
in opposite directions separate the two. Here the lever arm is wrong by 3 cm and the boresight by
0.2 deg.
"""

import matplotlib.pyplot as plt
from small_surveys import WRONG_MOUNTING, output_folder, wrong_mounting

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(wrong_mounting())
result = mlscorr.calibrate(survey)
result

# %%
# Corrections of the recorded mounting, with 2 sigma, against the simulated truth.

figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
table = result.to_frame()
for panel, effect, unit in zip(panels, WRONG_MOUNTING, ("m", "deg"), strict=True):
    part = table[table.unit == unit]
    panel.errorbar(range(3), part.lsc_correction, 2 * part.lsc_sigma, fmt="o", capsize=4)
    panel.plot(effect["magnitude"], "k_", markersize=24, label="truth")
    panel.set_xticks(range(3), ["right", "forward", "up"])
    panel.set(title=effect["name"], ylabel=f"correction ({unit})", xlim=(-0.5, 2.5))
    panel.legend()
figure.savefig(out / "mounting.png", dpi=110)

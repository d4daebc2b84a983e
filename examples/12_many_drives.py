"""
Correct many drives together
============================

A project.toml names many drives and one control list; ``mlscorr correct`` corrects them together.
"""

import json
import subprocess
import sys

import matplotlib.pyplot as plt
from small_surveys import output_folder, street, street_next_day

out = output_folder()
drives = {"monday": street(), "tuesday": street_next_day()}
blocks = [f'[[drive]]\nname = "{k}"\nsurvey = "{v / "survey.toml"}"' for k, v in drives.items()]
control = f'[control]\nfile = "{drives["monday"] / "control.csv"}"'
pos = "[pos]\nposition_sigma = 0.03"  # m
(out / "project.toml").write_text("\n".join(['name = "old town"', control, pos, *blocks]))

# %%
# ``--workers 1`` uses one process; on a workstation take one for each core.
command = [sys.executable, "-m", "mlscorr", "correct", out / "project.toml"]
command += ["-o", out / "corrected", "--workers", "1", "--overwrite", "--no-report"]
subprocess.run(command, check=True, capture_output=True)
project = json.loads((out / "corrected" / "project.json").read_text())
for drive in project["drives"]:
    print(drive["name"], drive["state"])

# %%
# 3D RMSE of each drive, before and after.
figure, panel = plt.subplots(figsize=(6, 3), layout="constrained")
for number, state in enumerate(("before", "after")):
    rmse = [100 * drive[state] for drive in project["drives"]]
    panel.bar([k + 0.4 * number for k in range(len(rmse))], rmse, 0.4, label=state)
panel.set_xticks([0.2, 1.2], list(drives))
panel.set_ylabel("3D RMSE (cm)")
panel.legend()
figure.savefig(out / "drives.png", dpi=110)

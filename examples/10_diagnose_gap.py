"""
Diagnose why a survey differs from its simulation
=================================================

``diagnose`` tests every known error against the observations of the targets, and names the cause
with a probability. In this survey the clock of the scanner is 20 ms off.
"""

from small_surveys import output_folder, wrong_clock

import mlscorr

out = output_folder()
survey = mlscorr.read_survey(wrong_clock())
gap = mlscorr.diagnose(survey)
gap

# %%
# Size of the cause, with its sigma and the smallest detectable size.

gap.to_frame().head(3)

# %%
# The effect is added to the simulator, as simulator.toml shows.

gap.write(out / "gap", overwrite=True)
simulator = mlscorr.read_simulator(out / "gap" / "simulator.toml")
print(simulator.effects)

# %%
# Evidence of each effect.

gap.plot("evidence").savefig(out / "evidence.png", dpi=110)

"""Simulated surveys: a street, a drive, scanners, a POS, and their errors.

>>> import numpy as np
>>> from mlscorr.simulate import Scenario, simulate
>>> short = Scenario(drive={"duration": 8.0}, targets={"control": 4, "check": 1})
>>> len(simulate(short, np.random.default_rng(1)).targets)
5
"""

import lazy_loader

# __init__.pyi lists the public names, also for type checkers
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

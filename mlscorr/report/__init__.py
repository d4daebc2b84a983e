"""The report of a correction: figures and one self-contained page."""

import lazy_loader

# __init__.pyi lists the public names, also for type checkers
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

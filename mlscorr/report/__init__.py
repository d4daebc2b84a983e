"""The report of a correction: figures and one self-contained page."""

import lazy_loader

# __init__.pyi lists what is offered, for type checkers too
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

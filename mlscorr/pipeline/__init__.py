"""The story from files to files, one module a command, each loaded when it is used."""

import lazy_loader

# __init__.pyi lists what is offered, for type checkers too
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

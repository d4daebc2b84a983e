"""The report of a correction: figures and one self-contained page."""

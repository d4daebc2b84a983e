"""Run the command line by ``python -m mlscorr``."""

from mlscorr.cli import main

main()

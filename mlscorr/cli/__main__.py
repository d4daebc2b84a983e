"""Run the command line by ``python -m mlscorr.cli``."""

from mlscorr.cli import main

main()

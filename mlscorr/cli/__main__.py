"""python -m mlscorr.cli"""

from mlscorr.cli import main

main()

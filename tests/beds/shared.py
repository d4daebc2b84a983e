"""Location of test data that is not part of the repository."""

import os
from pathlib import Path

import pytest

ROOT = Path(os.environ.get("MLSCORR_SHARED") or Path(__file__).parents[3] / "shared")


def shared(*parts):
    """Path of a shared file or folder; where it is missing the test is skipped and says so."""
    path = ROOT.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is missing (set MLSCORR_SHARED to the shared folder)")
    return path

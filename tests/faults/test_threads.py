"""The same bytes with any number of threads."""

import os
import subprocess

import pytest

from tests.beds.places import MLSCORR
from tests.faults.sizes import IS_FULL
from tests.faults.stage import content


@pytest.mark.skipif(not IS_FULL, reason="in make faults: three whole runs")
def test_a_correction_is_the_same_with_any_number_of_threads(street, tmp_path, record_property):
    "1, 2 and 4 threads of the decoder, of BLAS and of compiled loops: every file but the page"
    outputs = []
    for number in ("1", "2", "4"):
        names = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
        subprocess.run(
            [MLSCORR, "correct", street, "-o", tmp_path / number, "-q"],
            env=os.environ | dict.fromkeys(names, number),
            check=True,
        )
        outputs.append(content(tmp_path / number))
        outputs[-1].pop("report.html")  # it says when it was written
    assert outputs[0] == outputs[1] == outputs[2]
    record_property("threads", f"1, 2, 4: {len(outputs[0])} files the same")

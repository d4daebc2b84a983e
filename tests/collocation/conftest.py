"""Settings common to all tests of the collocation."""

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    "The matrices are small: on a busy machine threads would wait longer than they work"
    with threadpool_limits(1, "blas"):
        yield

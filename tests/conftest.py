import gc
import os

# As the command does: matrices are small here, and further threads of BLAS, one for each core in
# each worker, only wait for work. Read when numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from mbody.core.selection import chosen

# Comparisons that several files share say what differs, as those of the tests themselves do.
pytest.register_assert_rewrite(
    *(
        f"tests.support.{name}"
        for name in ("batches", "invariance", "oracle_runs", "picture_reader")
    )
)

# The first example of a test may compile a kernel: seconds, not milliseconds.
settings.register_profile("mbody", deadline=None)
settings.load_profile("mbody")


def pytest_report_header():
    """Which core all results are of."""
    return f"core: {chosen().name}, {chosen().reason}"


@pytest.fixture(scope="module", autouse=True)
def few_objects_to_collect():
    """Thousands of tests, and what modules before keep, are a million objects: tests that collect
    garbage many times, as those of memory and of benchmarks, need not look at them each time.
    """
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Tests in a browser are slow ones; those of the compiler itself run where numba is the core:
    ``MBODY_CORE=numba pytest``.
    """
    reason = pytest.mark.skip(reason="of the compiler: runs with MBODY_CORE=numba")
    compiled_by_numba = chosen().name == "numba"
    for item in items:
        if item.get_closest_marker("browser"):
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("numba") and not compiled_by_numba:
            item.add_marker(reason)

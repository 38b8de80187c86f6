import pytest
from hypothesis import settings

# Comparisons that several files share say what differs, as those of the tests themselves do.
pytest.register_assert_rewrite(
    *(f"tests.{name}" for name in ("batches", "invariance", "oracle_runs", "picture_reader")),
)

# The first example of a test may compile a kernel: seconds, not milliseconds.
settings.register_profile("mbody", deadline=None)
settings.load_profile("mbody")

"""The decorators, the linking of compiled code and the door to users' Python."""

from pathlib import Path

import numpy as np
import pytest
from llvmlite import binding

import mbody
import mbody.compiler.cache as cache
import mbody.compiler.install  # noqa: F401  the file can be run alone
import mbody.compiler.jit as jit
import mbody.core.callbacks as user
from mbody.core.callbacks import call_user as door

pytestmark = pytest.mark.numba


@jit.njit
def call_user(handle, x, y):
    """The door, as compiled code calls it."""
    return door(handle, x, y)


class Library:
    """What `link_into` needs of a library of numba."""

    def __init__(self, name: str, code: str) -> None:
        self.name, self.code = name, code

    def _get_module_for_linking(self):
        return binding.parse_assembly(self.code)


def test_code_is_linked_whatever_the_order():
    from mbody.compiler.linking import link_into

    whole = "declare i64 @f()\ndefine i64 @main() { %x = call i64 @f() ret i64 %x }"
    needs_g = "declare i64 @g()\ndefine linkonce_odr i64 @f() { %x = call i64 @g() ret i64 %x }"
    f = Library("f", needs_g)
    g = Library("g", "define linkonce_odr i64 @g() { ret i64 42 }")

    def missing(module):
        return {function.name for function in module.functions if function.is_declaration}

    # LLVM alone leaves out g, which nothing needs when it comes
    module = binding.parse_assembly(whole)
    for library in (g, f):
        module.link_in(library._get_module_for_linking(), preserve=True)
    assert missing(module) == {"g"}
    for libraries in ([g, f], [f, g]):
        module = binding.parse_assembly(whole)
        link_into(module, libraries)
        assert not missing(module)
    # what no library has is numba's or the C library's
    module = binding.parse_assembly(whole)
    link_into(module, [f])
    assert missing(module) == {"g"}


def test_the_collector_goes_on_after_a_compilation():
    import gc

    @jit.kernel
    def local(x):
        return x + 1

    assert gc.isenabled() and local(1) == 2 and gc.isenabled()
    gc.disable()
    try:
        assert local(1.5) == 2.5 and not gc.isenabled()
    finally:
        gc.enable()


# --- Users' functions --------------------------------------------------------------------------


def test_user_functions():
    x, y = np.array([1.0, 2.0]), np.array([5.0, 6.0])
    kept = []

    def good(x, y):
        kept.append((x, y))
        y[0] += x.sum()

    def bad(x, y):
        y[:] = 0.0
        raise ValueError("not today")

    handle, bad_handle = user.register(good), user.register(bad)
    assert call_user(handle, x, y) == 0
    np.testing.assert_array_equal(y, [8.0, 6.0])
    x[:] = 0.0
    np.testing.assert_array_equal(kept[0][0], [1.0, 2.0])  # what a user keeps is the user's

    assert call_user(bad_handle, x, y) == 1
    np.testing.assert_array_equal(y, [8.0, 6.0])
    assert user.failure(handle) is None
    with pytest.raises(ValueError, match="not today"):
        user.raise_failure()
    user.raise_failure()

    assert call_user(bad_handle, x, y) == 1
    user.release(bad_handle)
    assert user.failure() is None
    assert call_user(bad_handle, x, y) == 1
    number, error = user.failure(bad_handle)
    assert number == bad_handle
    assert isinstance(error, LookupError)
    user.release(handle)
    user.release(handle)

    with pytest.raises(TypeError, match="not a function"):
        user.register(3)


# --- Decorators --------------------------------------------------------------------------------


def test_division_by_zero_gives_infinity():
    @jit.njit(cache=False)
    def inverse(x):
        return 1.0 / x

    with np.errstate(divide="ignore"):
        assert inverse(np.float64(0.0)) == np.inf


def test_functions_from_elsewhere_are_not_kept():
    @jit.njit
    def local(x):
        return x + 1

    assert local(1) == 2
    assert local.stats.cache_path is None


def test_a_changed_interface_of_numba_costs_only_the_cache(monkeypatch):
    monkeypatch.setattr(cache, "PACKAGE", Path(__file__).resolve().parent)

    def broken():
        raise AttributeError("no longer there")

    monkeypatch.setattr(cache, "_cache_type", broken)

    @jit.njit
    def local(x):
        return x + 1

    assert local(1) == 2


def test_what_a_symbol_cannot_describe_is_refused():
    from mbody.compiler.linking import identity

    table = [1.0]

    def reads(x):
        return table[0] * x

    with pytest.raises(TypeError, match="encloses table, a list"):
        identity(reads)


def test_two_functions_of_one_line_have_two_symbols():
    from mbody.compiler.linking import identity

    one, other = (lambda x, y: x / y), (lambda x, y: y / x)
    assert identity(one) != identity(other)

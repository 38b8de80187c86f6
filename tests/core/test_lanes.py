"""Numbers of many lanes against NumPy."""

import copy
import pickle

import numpy as np
import pytest

from mbody.compiler.jit import inline, kernel, njit
from mbody.core.bundle import Bundle, Ints, Rows, Stacks
from mbody.core.lanes import (
    LANES,
    aligned,
    count,
    highest,
    larger,
    ld,
    lowest,
    select_le,
    sincos,
    smaller,
    st,
    st_varying,
    wide,
)

pytestmark = pytest.mark.numba


@inline
def operations(rows, w):
    a = ld(rows, 0, w)
    b = ld(rows, np.int32(1), w)
    st(rows, 2, a + b, w)
    st(rows, 3, a - 2 * b, w)
    st(rows, 4, a * b + 3, w)
    st(rows, 5, 2.5 / a - b / 4, w)
    st(rows, 6, -a, w)
    st(rows, 7, np.sqrt(np.abs(a)) + abs(b), w)
    c = 1.0 * a
    c += b
    c -= 1
    c *= 3.0
    c /= b
    st(rows, 8, c, w)
    st(rows, 9, select_le(a, b, a, 7), w)
    st(rows, 10, smaller(a, b), w)
    st(rows, 11, larger(a, 0), w)
    total = 0
    for row in range(3):
        total = total + ld(rows, row, w)
    st(rows, 12, total, w)
    st(rows, 13, 1, w)
    st(rows, 14, count(w), w)
    sine, cosine = sincos(a)
    st(rows, 15, sine, w)
    st(rows, 16, cosine, w)
    return lowest(a), highest(b)


@kernel
def operations_one(rows):
    return operations(rows, 0.0)


@kernel
def operations_wide(rows):
    return operations(rows, wide())


def _rows(lanes):
    rows = aligned(17, lanes)
    rows[:2] = np.random.default_rng(3).normal(scale=3.0, size=(2, lanes))
    return rows


@pytest.mark.parametrize("lanes", [1, LANES])
def test_operations_agree_with_numpy(lanes):
    rows = _rows(lanes)
    a, b = rows[:2].copy()
    low, high = (operations_one if lanes == 1 else operations_wide)(rows)
    expected = [
        a,
        b,
        a + b,
        a - 2 * b,
        a * b + 3,
        2.5 / a - b / 4,
        -a,
        np.sqrt(np.abs(a)) + np.abs(b),
        (a + b - 1) * 3 / b,
        np.where(a <= b, a, 7.0),
        np.minimum(a, b),
        np.maximum(a, 0.0),
        a + b + (a + b),
        np.ones(lanes),
        np.full(lanes, float(lanes)),
        np.sin(a),
        np.cos(a),
    ]
    np.testing.assert_allclose(rows, expected, rtol=1e-14, atol=3e-16)
    assert low == a.min()
    assert high == b.max()


def test_plain_python_runs_the_same_source_on_rows_of_any_length():
    rows = _rows(LANES)
    other = rows.copy()
    plain = getattr(operations, "py_func", operations)
    low, high = plain(rows, np.zeros(LANES))
    assert operations_wide(other) == (low, high)
    np.testing.assert_allclose(other, rows, rtol=1e-14, atol=3e-16)
    five = rows[:, :5].copy()
    plain(five, np.zeros(5))
    np.testing.assert_array_equal(five[2:14], rows[2:14, :5])


def test_plain_python_carries_complex_steps():
    rows = np.zeros((17, 3), dtype=complex)
    rows[0], rows[1] = [0.3, 1.2, -2.0], [2.0, -0.5, 0.7]
    rows[0] += 1e-30j
    x = rows[0].real.copy()
    getattr(operations, "py_func", operations)(rows, np.zeros(3, dtype=complex))
    np.testing.assert_allclose(rows[15].imag / 1e-30, np.cos(x), rtol=1e-15)
    np.testing.assert_allclose(rows[16].imag / 1e-30, -np.sin(x), rtol=1e-15)
    np.testing.assert_allclose(rows[9].imag / 1e-30, np.where(x <= rows[1].real, 1.0, 0.0))
    np.testing.assert_allclose(rows[11].imag / 1e-30, np.where(x > 0.0, 1.0, 0.0))


def test_aligned():
    for rows, lanes in ((3, 1), (5, 32), (2, 8), (1, 3)):
        array = aligned(rows, lanes)
        assert array.shape == (rows, lanes)
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        assert array.flags.writeable
        assert array.ctypes.data % 64 == 0
        assert not array.any()


# --- NaN ---------------------------------------------------------------------------------------


@inline
def choices(rows, results, w):
    a = ld(rows, 0, w)
    b = ld(rows, 1, w)
    st(results, 0, select_le(a, b, 1.0, 2.0), w)
    st(results, 1, smaller(a, b), w)
    st(results, 2, larger(a, b), w)
    st(results, 3, lowest(a), w)
    st(results, 4, highest(a), w)
    sine, cosine = sincos(a)
    st(results, 5, sine, w)
    st(results, 6, cosine, w)


@kernel
def choices_one(rows, results):
    choices(rows, results, 0.0)


@kernel
def choices_wide(rows, results):
    choices(rows, results, wide())


def _by_lanes(rows):
    results = aligned(7, LANES)
    choices_wide(rows, results)
    return results


def _one_by_one(rows):
    columns = []
    for lane in range(LANES):
        column = aligned(7, 1)
        choices_one(np.ascontiguousarray(rows[:, lane : lane + 1]), column)
        columns.append(column)
    results = np.hstack(columns)
    results[3], results[4] = np.min(results[3]), np.max(results[4])
    return results


def _in_plain_python(rows):
    results = aligned(7, LANES)
    getattr(choices, "py_func", choices)(rows, results, np.zeros(LANES))
    return results


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("run", [_by_lanes, _one_by_one, _in_plain_python])
def test_not_a_number_is_never_lost(run):
    nan, infinity = np.nan, np.inf
    a = np.tile([1.0, nan, 1.0, nan, 2.0, infinity, -infinity, 0.0], LANES // 8)
    b = np.tile([2.0, 1.0, nan, nan, 2.0, 1.0, infinity, nan], LANES // 8)
    results = run(np.array([a, b]))
    np.testing.assert_array_equal(results[0], np.tile([1, 2, 2, 2, 1, 2, 1, 2], LANES // 8))
    np.testing.assert_array_equal(results[1], np.minimum(a, b))
    np.testing.assert_array_equal(results[2], np.maximum(a, b))
    assert np.isnan(results[3:5]).all()
    unknown = ~np.isfinite(a)
    assert np.isnan(results[5:, unknown]).all()
    assert np.isfinite(results[5:, ~unknown]).all()


@pytest.mark.parametrize("lane", [0, 1, LANES // 2 - 1, LANES // 2, LANES - 1])
def test_one_bad_lane_shows_in_the_reductions(lane):
    rows, results = np.ones((2, LANES)), aligned(7, LANES)
    rows[0] = np.arange(LANES)
    rows[0, lane] = 99.0
    choices_wide(rows, results)
    assert results[4, 0] == 99.0
    rows[0, lane] = -99.0
    choices_wide(rows, results)
    assert results[3, 0] == -99.0
    rows[0, lane] = np.nan
    choices_wide(rows, results)
    assert np.isnan(results[3:5]).all()


# --- Sine and cosine ---------------------------------------------------------------------------


@kernel
def turn_wide(angles, sines, cosines):
    w = wide()
    for row in range(angles.shape[0]):
        sine, cosine = sincos(ld(angles, row, w))
        st(sines, row, sine, w)
        st(cosines, row, cosine, w)


@kernel
def turn_one(angles, sines, cosines):
    for row in range(angles.shape[0]):
        sine, cosine = sincos(ld(angles, row, 0.0))
        st(sines, row, sine, 0.0)
        st(cosines, row, cosine, 0.0)


def _angles(limit):
    angles = np.random.default_rng(5).uniform(-limit, limit, size=800 * LANES)
    quarters = np.arange(-2000, 2000) * (np.pi / 4)
    special = np.concatenate(
        [quarters, np.nextafter(quarters, 9e9), 10.0 ** np.arange(-320.0, 0.0), [0.0, -0.0]]
    )
    special = special[np.abs(special) <= limit]
    angles[: special.size] = special
    return angles


def _error(values, function, angles):
    exact = function(angles.astype(np.longdouble))
    return float(np.max(np.abs(values.ravel() - exact)))


# Where long double is no longer than double, the comparison has an error of its own.
TOLERANCE = 2e-16 if np.finfo(np.longdouble).eps < 1e-18 else 4e-16


@pytest.mark.parametrize("limit", [4.0, 400.0, 1e5, 1e6])
def test_sine_and_cosine(limit):
    angles = _angles(limit)
    for lanes, turn in ((LANES, turn_wide), (1, turn_one)):
        block = angles.reshape(-1, lanes)
        sines, cosines = np.zeros_like(block), np.zeros_like(block)
        turn(block, sines, cosines)
        assert _error(sines, np.sin, angles) <= TOLERANCE
        assert _error(cosines, np.cos, angles) <= TOLERANCE


# --- Use in kernels ----------------------------------------------------------------------------


@inline
def first(x, y):
    return x + y, x - y, x * y


@inline
def second(x, y):
    s, c = sincos(x)
    return s * y, c * y, x


@inline
def put(rows, row, values, w):
    st(rows, row, values[0], w)
    st(rows, row + 1, values[1], w)
    st(rows, row + 2, values[2], w)


@inline
def add_to(rows, row, extra, w):
    if extra is not None:  # with None the store below would not even compile
        st(rows, row, ld(rows, row, w) + ld(extra, 0, w), w)


@kernel
def dispatch(kinds, state, rows, extra):
    w = wide()
    for element in range(kinds.shape[0]):
        x, y = ld(state, 2 * element, w), ld(state, 2 * element + 1, w)
        if kinds[element] == 0:
            put(rows, 3 * element, first(x, y), w)
        elif kinds[element] == 1:
            put(rows, 3 * element, second(x, y), w)
        add_to(rows, 3 * element, extra, w)


def test_branches_by_kind_and_absent_arrays():
    kinds = np.array([0, 1, 1, 0])
    state = aligned(8, LANES)
    state[:] = np.random.default_rng(1).normal(size=state.shape)
    for extra in (None, np.full((1, LANES), 2.0)):
        rows = aligned(12, LANES)
        dispatch(kinds, state, rows, extra)
        for element, kind in enumerate(kinds):
            x, y = state[2 * element : 2 * element + 2]
            expected = np.array(
                [x + y, x - y, x * y] if kind == 0 else [np.sin(x) * y, np.cos(x) * y, x]
            )
            expected[0] += 0.0 if extra is None else 2.0
            np.testing.assert_allclose(
                rows[3 * element : 3 * element + 3], expected, rtol=1e-13, atol=1e-15
            )


@kernel
def store_what_varies(rows, narrow):
    w = wide()
    st_varying(rows, 0, 1.0, w)
    st_varying(rows, 1, 2.0 * ld(rows, 3, w), w)
    st_varying(rows, 2, 3, w)
    st_varying(narrow, 0, 1.0, 0.0)
    st_varying(narrow, 1, ld(narrow, 1, 0.0) + 1.0, 0.0)


def test_constants_are_not_stored_in_lanes():
    rows, narrow = _rows(LANES)[:4].copy(), np.zeros((2, 1))
    before = rows.copy()
    store_what_varies(rows, narrow)
    np.testing.assert_array_equal(rows[[0, 2, 3]], before[[0, 2, 3]])
    np.testing.assert_array_equal(rows[1], 2.0 * before[3])
    np.testing.assert_array_equal(narrow[:, 0], [1.0, 1.0])


class Memory(Bundle):
    rows: "Rows"
    scale: "float"
    count: "int"
    kinds: "Ints"
    results: "Rows"
    boxes: "Stacks"


@njit
def fill(M, w):
    for row in range(M.rows.shape[0]):
        st(M.results, row, M.scale * ld(M.rows, row, w), w)
        st(M.boxes[M.kinds[row]], 1, ld(M.rows, row, w), w)
    return M.rows.size + M.count


def fill_all(M):
    return fill(M, wide())


def test_a_bundle(monkeypatch, tmp_path):
    rows = _rows(LANES)
    kinds = np.arange(len(rows))[::-1]
    given = {"rows": rows, "scale": 1.5, "count": 3, "kinds": kinds}
    first, second = (
        Memory(**given, results=np.zeros_like(rows), boxes=np.zeros((len(rows), 2, LANES)))
        for _ in range(2)
    )
    # Files outside the package get no place in its cache: numba's own serves here.
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))
    for memory, hits in ((first, 0), (second, 1)):
        function = kernel(fill_all)
        function.enable_caching()
        assert function(memory) == rows.size + 3
        np.testing.assert_array_equal(memory.results, 1.5 * rows)
        np.testing.assert_array_equal(memory.boxes[::-1, 1], rows)
        assert not memory.boxes[:, 0].any()
        assert sum(function.stats.cache_hits.values()) == hits


def test_a_bundle_is_made_whole():
    rows = np.arange(6.0).reshape(2, 3)
    given = {"scale": 1.5, "count": 3, "kinds": [1, 0], "results": rows, "boxes": rows[None]}
    memory = Memory(rows=np.asfortranarray(rows), **given)
    assert memory.rows.flags.c_contiguous
    for other in (pickle.loads(pickle.dumps(memory)), copy.deepcopy(memory)):
        np.testing.assert_array_equal(other.rows, rows)
        assert other.address != memory.address and other.scale == 1.5
    assert memory.replaced(scale=2.5).scale == 2.5 and memory.scale == 1.5
    with pytest.raises(
        AttributeError, match="the fields of a Memory cannot change: make a new one"
    ):
        memory.rows = rows
    with pytest.raises(TypeError, match="Memory: missing or unknown: kinds, more"):
        Memory(rows=rows, **{"more" if k == "kinds" else k: v for k, v in given.items()})
    with pytest.raises(TypeError, match=r"Memory\.kinds has 1 axes"):
        Memory(rows=rows, **{**given, "kinds": rows})


def test_misuse_does_not_compile():
    from numba.core.errors import TypingError

    @njit(cache=False)
    def outcome(rows):
        x = ld(rows, 0, wide())
        if x < 0.0:
            return 1
        return 0

    @njit(cache=False)
    def narrow(rows):
        st(rows, 0, wide(), 0.0)

    for function, rows in (
        (outcome, np.zeros((1, LANES))),
        (narrow, np.zeros((1, 1))),
        (turn_one, np.zeros((3, 1, 1))),
        (turn_one, np.zeros((4, 4))[::2, ::2]),
    ):
        with pytest.raises(TypingError):
            function(*[rows] * (3 if function is turn_one else 1))

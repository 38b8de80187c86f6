"""`close_rows`: one position or a stack, rows that depend on each other, singular positions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from mbody.system.rank import close_rows


def circles(distance):
    """A point on two unit circles whose centres are so far apart, and an angle of 0.3 rad; where
    the point is (5, 5) nothing has a value.
    """

    def rows(x):
        px, py = x[..., 0], x[..., 1]
        one, other = 0.5 * (px**2 + py**2 - 1.0), 0.5 * ((px - distance) ** 2 + py**2 - 1.0)
        none = 0.0 * px
        G = [[px, py, none], [px - distance, py, none], [none, none, none + 1.0]]
        phi = np.stack([one, other, x[..., 2] - 0.3], axis=-1)
        G = np.moveaxis(np.array(G), (0, 1), (-2, -1))
        lost = (px == 5.0) & (py == 5.0)
        return np.where(lost[..., None], np.nan, phi), np.where(lost[..., None, None], np.nan, G)

    return rows


def test_a_stack_closes_as_one_by_one():
    """The circles cross at (1/2, ±√3/2); what has no value is not closed, and disturbs no other."""
    starts = np.array([[0.7, 0.9, 0.0], [5.0, 5.0, 0.0], [0.4, -1.1, 1.2]])
    found = close_rows(circles(1.0), starts)
    assert found.good.tolist() == [True, False, True]
    root = np.sqrt(0.75)
    assert_allclose(found.x[[0, 2]], [[0.5, root, 0.3], [0.5, -root, 0.3]], rtol=0, atol=4e-16)
    for n, start in enumerate(starts):
        one = close_rows(circles(1.0), start)
        assert bool(one.good) == bool(found.good[n])
        assert_allclose(one.x, found.x[n], rtol=0, atol=4e-16)


def test_circles_that_touch_close_to_half_the_digits():
    """Each step halves the distance to a double root, y² = 0 at (1, 0): Φ is rounding, below 1e-16,
    where y is below 1e-8, some 24 halvings of 0.1 away.
    """
    found = close_rows(circles(2.0), np.array([1.0, 0.1, 0.0]))
    assert found.good
    assert_allclose(found.x, [1.0, 0.0, 0.3], rtol=0, atol=1e-7)


@pytest.mark.parametrize("count", [1, 2])
def test_a_row_that_repeats_another_but_for_rounding_has_no_say(count):
    """y = 0 twice, once with 1e-12 (x − 4) more: solved exactly that is x = 4, of least norm x
    stays, in a stack as well as alone.
    """

    def rows(x):
        phi = np.stack([x[:, 1], x[:, 1] + 1e-12 * (x[:, 0] - 4.0), x[:, 2]], axis=-1)
        G = np.array([[0.0, 1.0, 0.0], [1e-12, 1.0, 0.0], [0.0, 0.0, 1.0]])
        return phi, np.broadcast_to(G, (len(x), 3, 3))

    found = close_rows(rows, np.tile([0.5, 0.25, 0.125], (count, 1)))
    assert found.good.all()
    assert_allclose(found.x, np.tile([0.5, 0.0, 0.0], (count, 1)), rtol=0, atol=1e-11)


def test_held_directions_keep_their_values():
    """With x = 0.8 held one circle leaves y = 0.6; two circles leave nothing that could be held."""
    frame, start = np.array([[1.0, 0.0, 0.0]]), np.array([0.8, 0.5, 0.1])

    def first(x):
        phi, G = circles(1.0)(x)
        return phi[[0, 2]], G[[0, 2]]

    found = close_rows(first, start, (frame, frame @ start))
    assert found.good
    assert_allclose(found.x, [0.8, 0.6, 0.3], rtol=0, atol=4e-16)
    assert not close_rows(circles(1.0), start, (frame, frame @ start)).good

"""The branch monitor: no step of a driven motion may pass a position at which branches meet.

Let S = G W⁻¹ Gᵀ, G = Φ_q. Elimination leaves of the determinant of a node of rows the part

    p = det(pivot of the node) / det(its diagonal block of S),    0 < p ≤ 1,

the square of the sine of the angle between these rows and those eliminated before (in the metric
W⁻¹: S = L D Lᵀ is the Gram–Schmidt process on the rows). All parts are smooth along a motion, and
one of them vanishes where rows become dependent, which is where branches meet.

Near such a place p = κ (w² + x²), x being the way from the nearest place and w how far apart the
branches stay. A step from one branch to another leads from one side of that place to the other, so
that it is at least |x₁| + |x₂| long, and the second difference of p over it,

    p₂ − p₁ − (p₁ − p₀) h/back ≈ κ h² (1 + back/h) ≥ κ h²,

is then at least four times the smaller p at its ends (h = 2|x|, w → 0). A step is accepted where
for every node it is no greater than that p: so steps shrink with the distance to other branches,
and an even number of changes within one step is excluded like a single one, whichever groups of
links change. Near a meeting the rate of p at the end of the step is compared as well: where two
meetings follow each other closely, p is concave between them, and three places alone would let a
step pass that ends behind the second.

On lanes the LU of the square Φ_q gives the determinant of each diagonal block (Assur group) with
its sign. There a step is accepted where no sign changes and the second difference of each
determinant is smaller than the determinant.

W.monitor holds three pages: the place before the last one, the last one, the new one; and which
rows are redundant. Numbers are inverse, so that nothing is divided: with d = 1/e a second
difference of d times e₀ e₁ e₂ is a sum of products of two.
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import larger, ld, select_le, smaller, st
from mbody.kernels.constraints import rows, turns
from mbody.kernels.layout import Layout, Work
from mbody.kernels.schur_ldl import VANISHED, factor

__all__ = [
    "CHANGE_AHEAD",
    "MIDDLE",
    "NEAR_SINGULAR",
    "SOUND",
    "UNSURE",
    "branch_distance",
    "judge_step",
    "mark_redundant",
    "rates_fit",
    "restart_after_change",
    "shift_pages",
    "signs_kept",
    "store_earlier_parts",
    "store_parts",
]

#: Greatest second difference of a part over a step, as a part of the smaller one at its ends. Four
#: would be a step across, 1 is one of half the width w.
SHARP = 1.0
#: The same for h times what the rate of a part at the end of a step h differs from its mean over
#: the step: again four would be a step across; what `SHARP` lets pass has 1 on a parabola.
SHARP_END = 2.0
#: The rate at the end is compared where a part is less than this.
NEAR_SINGULAR = 1e-2
#: A part below this belongs to a change point, if the parabola through three places has its least
#: value ahead and that is below the part `EXACT` of the last one: the branches are then less than
#: 2e-6 apart (as sines), which is what rounding leaves of positions there.
CHANGE, EXACT = 1e-10, 0.02
#: The same where rows are redundant: their regularization (1e-9) keeps all parts above zero.
CHANGE_SOFT = 1e-7
#: Part of a step across a change point at which that may be: places on both sides are about as far.
MIDDLE = 0.3
#: Way [model lengths and radians] to a place before the first one.
BEFORE = 1e-6
#: A pivot of a redundant row is its regularization, times less than this.
REDUNDANT = 1e4
#: Product of numbers of one sign, at least.
TINY = 1e-300
#: What `judge_step` returns.
UNSURE, CHANGE_AHEAD, SOUND = 0, 1, 2


@njit
def store_parts(L, W, page, regularization):
    """Put the inverse parts of all nodes, by the present factor, on a page; returns the greatest,
    where rows are redundant that of the others.
    """
    o, most = page * L.nodes, 1.0
    for k in range(L.nodes):
        a, c, b = W.diagonal[2 * k, 0], W.diagonal[2 * k + 1, 0], W.cross[k, 0]
        e = (a * c - b * b) * (W.pivot[3 * k, 0] * W.pivot[3 * k + 2, 0])
        W.monitor[o + k, 0] = e
        if regularization != 0.0:
            marked = W.monitor[3 * L.nodes + k, 0]
            if marked >= 2.0:
                e = a * W.pivot[3 * k, 0] if marked == 2.0 else 1.0
            elif marked == 1.0:
                e = c * W.pivot[3 * k + 2, 0]
        most = max(most, e)
    return most


@njit
def mark_redundant(L, W, regularization):
    """Note the redundant rows of the present factor: 1 for the first of a node, 2 for the second,
    their sum for both.
    """
    for k in range(L.nodes):
        W.monitor[3 * L.nodes + k, 0] = 0.0
        for row in range(2):
            greatest = REDUNDANT * regularization * W.regularization_weight[2 * k + row, 0]
            if W.pivot[3 * k + 2 * row, 0] * greatest > 1.0:
                W.monitor[3 * L.nodes + k, 0] += 1.0 + row


@kernel
def branch_distance(L: Layout, W: Work, regularization: float) -> float:
    """Least part that elimination leaves of a node of rows at the position W.q."""
    turns(L, W, 0.0)
    rows(L, W, 0.0, True, None)
    factor(L, W, 0.0, regularization, VANISHED)
    if regularization != 0.0:
        mark_redundant(L, W, regularization)
    return 1.0 / store_parts(L, W, 1, regularization)


@inline
def shift_pages(L, W):
    """The new place becomes the last one, the last one that before it."""
    for k in range(2 * L.nodes):
        W.monitor[k, 0] = W.monitor[L.nodes + k, 0]


@njit
def store_earlier_parts(L, W, w, regularization, last):
    """Fill the page of the place before from one a little behind the last place, which is at row
    `last` of W.past; returns how far behind it is. W.q stays there.
    """
    size = W.q.shape[0]
    far = greatest_rate(L, W, W.past, last + size)
    back = BEFORE / far if far > 0.0 else 1.0
    for n in range(3 * L.bodies):
        W.q[n, 0] = W.past[last + n, 0] - back * W.past[last + size + n, 0]
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, VANISHED)
    store_parts(L, W, 0, regularization)
    return back


@inline
def greatest_rate(L, W, v, o):
    """Greatest rate of a coordinate, in model lengths and radians; rates from row o of v on."""
    far = 0.0
    for b in range(L.bodies):
        for n in range(3):
            rate = abs(v[o + 3 * b + n, 0])
            far = max(far, rate if n == 2 else rate / W.size[0, 0])
    return far


@njit
def rates_fit(L, W, w, h, regularization):
    """Whether the rate of every part at the end of a step h fits its mean over the step.

    The end is the place W.q with the rates W.v and the new page; the factor is made again there.
    """
    far = greatest_rate(L, W, W.v, 0)
    if not far * abs(h) > 2.0 * BEFORE:
        return True
    back = math.copysign(BEFORE / far, h)
    for n in range(3 * L.bodies):
        W.q[n, 0] -= back * W.v[n, 0]
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, VANISHED)
    smooth = True
    for k in range(L.nodes):
        a, c, b = W.diagonal[2 * k, 0], W.diagonal[2 * k + 1, 0], W.cross[k, 0]
        e = (a * c - b * b) * (W.pivot[3 * k, 0] * W.pivot[3 * k + 2, 0])
        e1, e2 = W.monitor[L.nodes + k, 0], W.monitor[2 * L.nodes + k, 0]
        if not (e > 0.5 and e1 > 0.5 and e2 > 0.5):
            continue
        p1, p2 = 1.0 / e1, 1.0 / e2
        bend = (p2 - 1.0 / e) * (h / back) - (p2 - p1)
        smooth = smooth and abs(bend) <= SHARP_END * min(p1, p2)
    for n in range(3 * L.bodies):
        W.q[n, 0] += back * W.v[n, 0]
    turns(L, W, w)
    rows(L, W, w, True, None)
    factor(L, W, w, regularization, VANISHED)
    return smooth


@njit
def judge_step(L, W, h, back, regularization):
    """Judge a step h, the one before being `back`, by the three pages: `SOUND`; `UNSURE`, it may
    have left its branch; `CHANGE_AHEAD`, there is a change point at the part of it that is
    returned, which may be beyond its end.

    With p = 1/e the second difference of p, p₂ − p₁ − x (p₁ − p₀), x = h/back, times e₀ e₁ e₂ is
    e₀ e₁ + e₂ (x e₁ − (1 + x) e₀).
    """
    x = h / back
    least = 1.0 / (CHANGE if regularization == 0.0 else CHANGE_SOFT)
    found, place = SOUND, 0.0
    for k in range(L.nodes):
        e0, e1, e2 = W.monitor[k, 0], W.monitor[L.nodes + k, 0], W.monitor[2 * L.nodes + k, 0]
        bend = e0 * e1 + e2 * (x * e1 - (1.0 + x) * e0)
        # no part is above one; a pivot that was dropped gives zero
        if abs(bend) <= SHARP * e0 * min(e1, e2) and e2 > 0.5:
            continue
        if not (e2 > 0.5 and e1 > least):
            return UNSURE, 0.0
        part, value = lowest_of_parabola(x, e1 / e0, e1 / e2)
        if not (part > 0.0 and value <= EXACT):
            return UNSURE, 0.0
        found, place = CHANGE_AHEAD, part
    return found, place


@njit
def restart_after_change(L, W, regularization):
    """Instead of the place before a change point one on this side of it, half as far from it as the
    last place: there the small parts are a quarter.
    """
    least = 1.0 / (CHANGE if regularization == 0.0 else CHANGE_SOFT)
    for k in range(L.nodes):
        e = W.monitor[L.nodes + k, 0]
        W.monitor[k, 0] = 4.0 * e if e > least else e


@inline
def lowest_of_parabola(x, before, ahead):
    """Where on the step the parabola is lowest that is `before` one step of 1/x back, 1 at the
    beginning and `ahead` at the end; and its value there.
    """
    first, second = (1.0 - before) * x, ahead - 1.0
    bend = (second - first) * x / (1.0 + x)
    slope = second - bend
    if not bend > 0.0:
        return -1.0, 1.0
    return -0.5 * slope / bend, 1.0 - 0.25 * slope * slope / bend


@njit
def signs_kept(S, W, w, F, step, failed):
    """`failed`, set to one where the determinant of a block has another sign than at the instant
    before, or bends more over the last steps than it is great; and the greatest inverse of one.

    S, F: the LU and its workspace; step: the last step and the one before, and whether there are
    such, one or zero. The second difference is that of `judge_step`.
    """
    zero = 0.0 * failed
    one = zero + 1.0
    h, back, seen, seen_twice = step
    count = S.scale.shape[0]
    x = h / select_le(larger(back, -back), 0.0 * back, 0.0 * back + 1.0, back)
    most = one
    for g in range(count):
        e2 = zero + S.scale[g]
        for n in range(S.group_start[g], S.group_start[g + 1]):
            e2 = e2 * ld(F.factor, S.group[n], w)
        great = larger(e2, -e2)
        most = larger(most, great)
        e1, e0 = ld(W.monitor, count + g, w), ld(W.monitor, g, w)
        failed = larger(failed, seen * select_le(zero + TINY, e1 * e2, zero, one))
        bend = e0 * e1 + e2 * (x * e1 - (1.0 + x) * e0)
        small = smaller(e1 * e2, smaller(e0 * e1, e0 * e2))
        bend = larger(bend, -bend)
        failed = larger(failed, seen_twice * select_le(bend, SHARP * small, zero, one))
        st(W.monitor, g, e1, w)
        st(W.monitor, count + g, e2, w)
    return failed, most

"""Impulses of all contacts of a step: Coulomb's cones and complementarity.

With γ = W v the relative velocities (γ_N, γ_T) of the contacts and u the velocities that impulses
change, the problem of a step is

    γ_N⁺ + b ≥ 0 ⊥ P_N ≥ 0,   |P_T| ≤ μ P_N, against γ_T⁺ where it slides,   u⁺ = u + Y P,

the same as a problem on the cone K of |P_T| ≤ μ P_N, after de Saxcé:

    K ∋ P ⊥ (γ_N⁺ + b + s, γ_T⁺) ∈ K*,   s = μ |γ_T⁺|.

With s of the beginning of the step it is convex, and all of Coulomb's law holds but this: a contact
that slides comes nearer, or leaves, by what the sliding changed in the step. Of few contacts s
follows the sliding until it stays, of many only where that would be more than a small part of their
size in this step, which the next one takes back: within each sweep it would not converge.

Sweeps of Gauss and Seidel go over the contacts to and fro, one after the other, each with the
velocities that the others have changed, and put its impulse onto its cone; they begin with the
impulses of the step before. Between sweeps the change is extrapolated by the nonlinear conjugate
gradients of Silcowitz, Niebe, Erleben (2010), begun anew where it grows. In piles that friction
holds they do not converge; then, and of many contacts of bodies that joints tie, the interior-point
method solves the step (`mbody.kernels.contact_interior`).

Positions are corrected by a problem of the same kind in the normals alone, which changes no
velocity. Jean: The non-smooth contact dynamics method (1999).
"""

from __future__ import annotations

import math

from mbody.core.decorators import inline, njit
from mbody.kernels.contact_geometry import FOUND
from mbody.kernels.contact_interior import WAITING, interior
from mbody.kernels.contact_rows import apply, apply_all, onto_cone, rates, takes_part

__all__ = ["correct_positions", "solve_few", "solve_many"]

#: Positions: overlap in parts of the size that is left alone, the part of the rest that one step
#: takes away, sweeps at most, and the part of the greatest impulse at which they end.
LEFT_ALONE, CORRECTED, SWEEPS, ENOUGH = 1e-6, 0.2, 30, 1e-2
#: Sweeps after which velocities are computed anew from the impulses.
RENEWED = 50
#: Of few contacts, the part of the change of s to which sweeps go at first.
PART = 0.1
#: After so many times s goes half the way, then a third, and so on: it may jump to and fro.
DAMPED = 6
#: Part of its limit below which friction holds a contact.
INSIDE = 1.0 - 1e-6
#: Of many contacts: how often s follows the sliding, and how far, in parts of its size, a contact
#: may come nearer in a step because it has not.
FOLLOWED, SLACK = 3, 1e-3
#: Sweeps before the interior-point method, and for how many steps it is taken alone after them.
TRIED, ALONE = 160, 8


@njit
def within_cones(B):
    """Impulses within the cones, which the coefficient may have made narrower."""
    for c in range(B.counts[FOUND]):
        bound = B.effect[c, 3] * B.impulse[c, 0]
        B.impulse[c, 1] = min(max(B.impulse[c, 1], -bound), bound)
        if not takes_part(B, c):
            B.impulse[c, 0] = B.impulse[c, 1] = 0.0


@njit
def solve_few(B, tolerance, most):
    """B.impulse and B.velocity ← the impulses of the step, s of the sliding itself. Returns the
    sweeps that it took, and what is left: the last change, and what the present sliding would
    change, as a part of the greatest impulse.
    """
    count = B.counts[FOUND]
    within_cones(B)
    apply_all(B)
    if count == 0:
        return 0, 0.0
    wanted, again = tolerance, 0
    done = relax(B, count, tolerance, most - most // 4)
    while True:
        change, opened = B.progress[0], follow_sliding(B, count, 1.0 / (1 + again // DAMPED))
        exact = max(change, opened)
        # what is not solved for these cones says nothing of the next ones
        if exact <= tolerance or change > wanted or done >= most:
            return done, exact
        wanted, again = max(tolerance, PART * opened), again + 1
        done += relax(B, count, wanted, most - done)


@njit
def solve_many(W, B, N, tolerance, tied, h):
    """The same of many contacts, `tied` where joints tie bodies of them; h the length of the step.
    Returns sweeps, iterations of the interior-point method, what is left as a part of the greatest
    impulse, and how much nearer, in parts of its size, a contact comes because s has not followed.
    −1 iterations where there is no memory.
    """
    count, sweeps, iterations, waiting = B.counts[FOUND], 0, 0, N.count[WAITING]
    within_cones(B)
    again = 0
    while True:
        change = math.inf
        if waiting > 0:
            waiting -= 1 if again == 0 else 0
        elif not tied:
            apply_all(B)
            sweeps += relax(B, count, tolerance, TRIED)
            change = B.progress[0]
            waiting = ALONE if change > tolerance else 0
        if change > tolerance:
            more, change = interior(W, B, N, tolerance)
            if more < 0:
                return sweeps, -1, change, 0.0
            iterations += more
            if change > tolerance:
                change = from_afar(W, B, N, tolerance, change)
            if not tied:
                apply_all(B)
        nearer = h * unfollowed(W, B, count)
        if nearer <= SLACK or again == FOLLOWED:
            N.count[WAITING] = waiting
            return sweeps, iterations, change, nearer
        follow_sliding(B, count, 1.0)
        again += 1


@njit
def from_afar(W, B, N, tolerance, before):
    """The interior-point method once more, from no impulses; those that B.impulse has stay where
    they are better. Returns what is left.
    """
    count = B.counts[FOUND]
    for c in range(count):
        B.ahead[c, 0], B.ahead[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        B.impulse[c, 0] = B.impulse[c, 1] = 0.0
    _, change = interior(W, B, N, tolerance)
    if change < before:
        return change
    for c in range(count):
        B.impulse[c, 0], B.impulse[c, 1] = B.ahead[c, 0], B.ahead[c, 1]
    return before


@njit
def relax(B, count, tolerance, most):
    """Sweeps to and fro, at most so many, until impulses change by no more than that part of the
    greatest one, which B.progress becomes; the cones stay as they are opened. Returns how many.
    """
    for c in range(count):
        B.ahead[c, 0] = B.ahead[c, 1] = 0.0
    done, before, change = 0, 0.0, 1.0
    while True:
        for c in range(count):
            B.kept[c, 0], B.kept[c, 1] = B.impulse[c, 0], B.impulse[c, 1]
        sweep(B, count, False)
        sweep(B, count, True)
        done += 2
        greatest, furthest, square = 0.0, 0.0, 0.0
        for c in range(count):
            x, y = B.impulse[c, 0] - B.kept[c, 0], B.impulse[c, 1] - B.kept[c, 1]
            square += x * x + y * y
            furthest = max(furthest, abs(x), abs(y))
            greatest = max(greatest, B.impulse[c, 0])
        change = furthest / greatest if greatest > 0.0 else 0.0
        B.progress[0], B.progress[1] = change, greatest
        if change <= tolerance or done >= most:
            return done
        if done % RENEWED == 0:
            apply_all(B)  # rounding of velocities that were changed so often
        part = square / before if before > 0.0 else 0.0
        extrapolate(B, count, part)
        before = square


@inline
def opening_of(B, c, along):
    """s of a contact by its sliding."""
    opening = B.effect[c, 3] * abs(along)
    if abs(B.impulse[c, 1]) < INSIDE * B.effect[c, 3] * B.impulse[c, 0]:
        opening = 0.0  # it sticks: what is left of its rate is what is not solved
    return opening


@njit
def follow_sliding(B, count, part):
    """Open the cones by the present sliding, or go that part of the way. Returns the greatest
    change of what that asks of an impulse, as a part of the greatest one.
    """
    furthest = 0.0
    for c in range(count):
        if takes_part(B, c):
            normal, along = rates(B, c, B.velocity)
            opening = opening_of(B, c, along)
            if B.impulse[c, 0] > 0.0 or normal + B.effect[c, 4] < 0.0:
                furthest = max(furthest, abs(opening - B.effect[c, 6]) / B.effect[c, 0])
            B.effect[c, 6] += part * (opening - B.effect[c, 6])
    return furthest / B.progress[1] if B.progress[1] > 0.0 else 0.0


@njit
def unfollowed(W, B, count):
    """How fast contacts that press come nearer, or leave, because s has not followed the sliding:
    the greatest, in parts of their size.
    """
    fastest = 0.0
    for c in range(count):
        if takes_part(B, c) and B.impulse[c, 0] > 0.0:
            _, along = rates(B, c, B.velocity)
            fastest = max(fastest, abs(opening_of(B, c, along) - B.effect[c, 6]) / size_of(W, B, c))
    return fastest


@njit
def sweep(B, count, backward):
    """One pass over all contacts: each impulse onto its cone, by its own effect."""
    u = B.velocity
    for n in range(count):
        c = count - 1 - n if backward else n
        if takes_part(B, c):
            p, t = B.impulse[c, 0], B.impulse[c, 1]
            x, y = onto_cone(B, c, p, t, u)
            if x != p or y != t:
                apply(B, c, x - p, y - t, u)
                B.impulse[c, 0], B.impulse[c, 1] = x, y


@njit
def extrapolate(B, count, part):
    """Go on along `part` of the direction before the last change, and add this to it; where changes
    grow, begin with no direction.
    """
    for c in range(count):
        if part > 1.0:
            B.ahead[c, 0] = B.ahead[c, 1] = 0.0
            continue
        x, y = B.impulse[c, 0] - B.kept[c, 0], B.impulse[c, 1] - B.kept[c, 1]
        ahead, aside = part * B.ahead[c, 0], part * B.ahead[c, 1]
        B.ahead[c, 0], B.ahead[c, 1] = ahead + x, aside + y
        if ahead != 0.0 or aside != 0.0:
            B.impulse[c, 0] += ahead
            B.impulse[c, 1] += aside
            apply(B, c, ahead, aside, B.velocity)


@inline
def size_of(W, B, c):
    """The size of the smaller shape of a contact, that of the model where both are points."""
    size = B.geometry[c, 7]
    return size if size < math.inf else W.size[0, 0]


@njit
def correct_positions(W, B, h, shift):
    """shift (coordinates + 3,) ← the motion that takes away a part of the overlap which is beyond
    rounding and would be there after the next step too; B.velocity holds the velocities at the end
    of this one, of length h. Returns whether there is any.
    """
    count, any_deep = B.counts[FOUND], False
    for n in range(shift.shape[0]):
        shift[n] = 0.0
    for c in range(count):
        normal, _ = rates(B, c, B.velocity)
        deep = -(B.geometry[c, 6] + 1.5 * h * normal) - LEFT_ALONE * size_of(W, B, c)
        B.shift[c] = 0.0
        # what is open may close by as much as it is open
        B.effect[c, 5] = -(CORRECTED if deep > 0.0 else 1.0) * deep
        any_deep = any_deep or deep > 0.0
    if not any_deep:
        return False
    for n in range(SWEEPS):
        greatest, furthest = 0.0, 0.0
        for m in range(count):
            c = count - 1 - m if n % 2 == 1 else m
            if not B.effect[c, 0] > 0.0:
                continue
            normal, _ = rates(B, c, shift)
            p = max(0.0, B.shift[c] - (normal + B.effect[c, 5]) / B.effect[c, 0])
            if p != B.shift[c]:
                furthest = max(furthest, abs(p - B.shift[c]))
                apply(B, c, p - B.shift[c], 0.0, shift)
                B.shift[c] = p
            greatest = max(greatest, p)
        if furthest <= ENOUGH * greatest:
            break
    return True

"""Generalised forces of all loads, each by the physics in its own file."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from mbody.core.decorators import inline, kernel, njit
from mbody.core.lanes import entry, highest, lane_at, larger, ld, put_entry, rounds, select_le, st
from mbody.core.tolerances import ALGEBRAIC_LOOP_SINGULAR, PIVOT_VANISHED
from mbody.kernels.constraints import (
    body_rotations,
    clear,
    driver_formulas,
    law_at,
    measured_formulas,
    multipliers,
    rows,
    side,
    steps,
    user_numbers,
    weigh,
)
from mbody.kernels.friction import (
    add_sliding,
    any_sliding,
    friction_changes,
    friction_sizes,
    responses,
    store_sliding,
    viscous_friction,
)
from mbody.kernels.layout import Layout, Work, keep_primitives
from mbody.kernels.schur_ldl import apply_g, apply_gt, factor, solve
from mbody.laws.kernels import POLYNOMIAL
from mbody.model.loads import LOADS
from mbody.model.loads.centrifugal_field import centrifugal, spin
from mbody.model.loads.gravity import gravity
from mbody.model.loads.pressure import piston, within_cycle
from mbody.model.loads.reciprocating_cylinder import charge, travel

#: Kinds of physics; the number of a kind is its place. Those of `mbody.model.loads` in its order,
#: then a user's own.
KINDS = (*LOADS, "user")
CHAMBER = KINDS.index("chamber")


@njit
def signals(L, W, w, number):
    """Evaluate the first `number` laws of time, in every lane at its own time, and what drivers
    follow of them, of inputs and of auxiliary states.
    """
    for n in range(number):
        m, o = L.signal_law[n], L.signal_row[n]
        if L.law_kind[m] == POLYNOMIAL:
            polynomial(L, W, w, m, o)
            continue
        for k in range(rounds(W.time, w)):
            lane = lane_at(k, w)
            f, f1, f2 = law_at(L, W, m, lane, entry(W.time, 0, lane))
            put_entry(W.signal, o, f, lane)
            put_entry(W.signal, o + 1, f1, lane)
            put_entry(W.signal, o + 2, f2, lane)
    driver_formulas(L, W, w)


@inline
def polynomial(L, W, w, m, o):
    """A polynomial of time in all lanes at once: most laws are one."""
    t = ld(W.time, 0, w)
    f, f1, f2 = 0.0 * t, 0.0 * t, 0.0 * t
    last = L.law_par[m] + L.law_count[m] - 1
    for n in range(L.law_count[m]):
        f2 = f2 * t + 2.0 * f1
        f1 = f1 * t + f
        f = f * t + ld(W.par, last - n, w)
    st(W.signal, o, f, w)
    st(W.signal, o + 1, f1, w)
    st(W.signal, o + 2, f2, w)


@njit
def all_loads(L, W, w):
    """Sum of all loads, with their formulas, as if what algebraic loops give them were zero."""
    for n in range(L.loop_row.shape[0]):
        st(W.signal, L.loop_row[n], 0.0, w)
    forces(L, W, w, -1)


@njit
def forces(L, W, w, cause):
    """Sum of all loads on the coordinates; of the one of that cause, if it is not negative. Unless
    cause is −1 the formulas of measured quantities are as they were evaluated last.
    """
    if cause == -1:
        measured_formulas(L, W, w)
    for n in range(3 * (L.bodies + 1)):
        st(W.force, n, 0.0, w)
    for e in range(L.action_kind.shape[0]):
        if cause >= 0 and L.action_cause[e] != cause:
            continue
        every_kind(L, W, w, e, L.action_kind[e])


@inline
def weights(L, W, w, e, kind):
    """Form "every mass": a force on every body by its mass and two signals."""
    f = L.action_signal[e]
    gx, gy = ld(W.signal, f, w), ld(W.signal, f + 3, w)
    for b in range(L.bodies):
        fx, fy = gravity(ld(W.mass, 3 * b, w), gx, gy)
        add(W, w, b, fx, fy, 0.0)


@inline
def field(L, W, w, e, kind):
    """Form "spinning plane": the centrifugal load of all bodies, whose second moments follow the
    parameters of the plane.
    """
    p, o = parameters(L, W, w, e), L.action_par[e] + 6
    given = ld(W.signal, L.action_signal[e], w)
    J = p[5]
    for b in range(L.bodies):
        J = J + centrifugal(side(W, b, w), ld(W.mass, 3 * b, w), p, moments(W, w, o + 3 * b))[3]
    speed = spin(given, J, p[4])
    square = speed * speed
    for b in range(L.bodies):
        fx, fy, t, _ = centrifugal(side(W, b, w), ld(W.mass, 3 * b, w), p, moments(W, w, o + 3 * b))
        add(W, w, b, square * fx, square * fy, square * t)


@inline
def moments(W, w, o):
    """Three parameters from o on."""
    return ld(W.par, o, w), ld(W.par, o + 1, w), ld(W.par, o + 2, w)


@inline
def press(L, W, w, e, kind):
    """Form "piston": the pressure of a chamber, +f u on j and −f u on i, on one line."""
    i, j, p = L.action_i[e], L.action_j[e], parameters(L, W, w, e)
    first, second = side(W, i, w), side(W, j, w)
    u, arm, d = piston(first, second, p)
    if kind == CHAMBER:
        s, rate = travel(first, second, u, arm, d)
        st(W.scratch, 0, s, w)
        st(W.scratch, 2, rate, w)
        chamber(W, w, L.action_par[e] + 6)
    else:
        n = L.action_law[e]
        if n < 0:
            st(W.scratch, 1, ld(W.signal, signal_of(n), w), w)
        else:
            st(W.scratch, 0, ld(W.q, 3 * L.action_by[e] + 2, w) + p[5], w)
            cycle_law(L, W, w, n)
    f = p[4] * ld(W.scratch, 1, w)
    fx, fy = f * u[0], f * u[1]
    add(W, w, i, -fx, -fy, d[1] * fx - d[0] * fy)
    add(W, w, j, fx, fy, arm[0] * fy - arm[1] * fx)


@inline
def cycle_law(L, W, w, n):
    """Law n of an angle within one turn: scratch row 0, into row 1."""
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        f, _, _ = law_at(L, W, n, lane, within_cycle(entry(W.scratch, 0, lane)))
        put_entry(W.scratch, 1, f, lane)


@inline
def chamber(W, w, o):
    """Pressure at coordinate and rate in scratch rows 0 and 2, into row 1; par from o on."""
    p = W.par
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        sign = entry(p, o + 1, lane)
        pressure = charge(
            sign * (entry(W.scratch, 0, lane) - entry(p, o, lane)),
            sign * entry(W.scratch, 2, lane),
            entry(p, o + 2, lane),
            entry(p, o + 3, lane),
            entry(p, o + 4, lane),
            entry(p, o + 5, lane),
            entry(p, o + 6, lane),
            entry(p, o + 7, lane),
            entry(p, o + 8, lane),
            1.0,
        )
        put_entry(W.scratch, 1, pressure, lane)


@inline
def add(W, w, b, fx, fy, t):
    """Add a force at the mass centre and a torque to body b."""
    o = 3 * b
    st(W.force, o, ld(W.force, o, w) + fx, w)
    st(W.force, o + 1, ld(W.force, o + 1, w) + fy, w)
    st(W.force, o + 2, ld(W.force, o + 2, w) + t, w)


@inline
def act(W, w, b, wrench):
    """Add a wrench (Fx, Fy, T) at the mass centre of body b, if there is one."""
    if wrench is not None:
        fx, fy, t = wrench
        add(W, w, b, fx, fy, t)


@inline
def parameters(L, W, w, e):
    """Parameters of action e; those beyond its own are never read by its physics."""
    o = L.action_par[e]
    return (
        ld(W.par, o, w),
        ld(W.par, o + 1, w),
        ld(W.par, o + 2, w),
        ld(W.par, o + 3, w),
        ld(W.par, o + 4, w),
        ld(W.par, o + 5, w),
    )


@inline
def own_law(L, W, w, e, x):
    """The element's own law at x, lane by lane; a formula of measured quantities has its value."""
    n = L.action_law[e]
    if n < 0:
        return ld(W.signal, signal_of(n), w)
    st(W.scratch, 0, x, w)
    lanes_law(L, W, w, n)
    return ld(W.scratch, 1, w)


@inline
def signal_of(n):
    """The signal row of an own law that is a formula of measured quantities, whose number is
    −1 less the row.
    """
    return -1 - n


@inline
def lanes_law(L, W, w, n):
    """Law n at scratch row 0, into row 1."""
    for m in range(rounds(W.scratch, w)):
        lane = lane_at(m, w)
        f, _, _ = law_at(L, W, n, lane, entry(W.scratch, 0, lane))
        put_entry(W.scratch, 1, f, lane)


@njit(forceinline=True)
def last_kind(L, W, w, e, kind):
    """Forces of a load that the user defines."""
    i, j, first = L.action_i[e], L.action_j[e], L.action_par[e]
    user_numbers(W, w, L.action_handle[e], i, j, first, L.action_count[e], 6)
    s = W.scratch
    add(W, w, i, ld(s, 0, w), ld(s, 1, w), ld(s, 2, w))
    add(W, w, j, ld(s, 3, w), ld(s, 4, w), ld(s, 5, w))


#: Loads that act otherwise than by a wrench on i and on j.
FORMS = {"every mass": weights, "spinning plane": field, "piston": press}


def branch(otherwise, number):
    """Compiled ``if kind == number: … else: otherwise(…)``, as of constraints."""
    one: Any = LOADS[KINDS[number]]
    form: Any = FORMS.get(one.form)
    physics, argument = one.function, one.argument

    @njit(forceinline=True, cache=False)
    def by_form(L, W, w, e, kind):
        if kind == number:
            form(L, W, w, e, kind)
        else:
            otherwise(L, W, w, e, kind)

    @njit(forceinline=True, cache=False)
    def of_time(L, W, w, e, kind):
        if kind == number:
            i, j = L.action_i[e], L.action_j[e]
            p, f = parameters(L, W, w, e), ld(W.signal, L.action_signal[e], w)
            on_i, on_j = physics(side(W, i, w), side(W, j, w), p, f)
            act(W, w, i, on_i)
            act(W, w, j, on_j)
        else:
            otherwise(L, W, w, e, kind)

    @njit(forceinline=True, cache=False)
    def of_state(L, W, w, e, kind):
        if kind == number:
            i, j = L.action_i[e], L.action_j[e]
            first, second, p = side(W, i, w), side(W, j, w), parameters(L, W, w, e)
            x, known = argument(first, second, p)
            on_i, on_j = physics(first, second, p, own_law(L, W, w, e, x), known)
            act(W, w, i, on_i)
            act(W, w, j, on_j)
        else:
            otherwise(L, W, w, e, kind)

    if form is not None:
        return by_form
    return of_state if argument else of_time


#: The branch of the first kind is the outermost one.
every_kind = functools.reduce(branch, reversed(range(len(LOADS))), last_kind)


# -- Accelerations and multipliers of free motion, from one factor of the Schur complement -----
#
# The equations of motion with the constraints differentiated twice are the augmented system
#
#     [M  Gᵀ] [a]   [f]
#     [G  0 ] [λ] = [γ],
#
# where γ is what Φ̈ = G a − γ has of velocities and time. Its first row gives a = M⁻¹ (f − Gᵀ λ);
# put into the second,
#
#     S λ = G M⁻¹ f − γ,   S = G M⁻¹ Gᵀ  (the Schur complement, `mbody.kernels.schur_ldl`).
#
# A body with several slots is the sum of its slots, each with a share of its mass and of its load,
# tied by weld rows. Where W.weight = W⁻¹ is not M⁻¹ (massless bodies have a small mass there) or S
# is regularised (redundant rows), (a, λ) is refined by the residuals of both rows,
#
#     r = f − M a − Gᵀ λ,   c = G (a + W⁻¹ r) − γ,
#     S δλ = c,             a ← a + W⁻¹ r − W⁻¹ Gᵀ δλ,   λ ← λ + δλ,
#
# which is one step of iterative refinement with [W Gᵀ; G 0] in place of the augmented matrix.
#
# Formulas of accelerations and reactions follow. Where loads follow them, s = g(a(s), λ(s)) is
# linear (`mbody.system.formula_steps`): a solution more a loop gives a column of I − ∂g/∂s, then s
# follows.

#: Solutions with friction as a load, at most: one as a rule, more where rows are redundant.
FRICTION_PASSES = 6
#: Solutions of an algebraic loop after that of its matrix: the second corrects rounding.
LOOP_PASSES = 2
#: In the place of a number of refinements: the accelerations are known, the multipliers follow.
KNOWN_MOTION = -1


@njit
def free_accelerations(L, W, w, regularization, refinements):
    """a and λ at W.q, W.v, W.time, with W.weight the inverse masses; see `augmented_solution`."""
    signals(L, W, w, L.varying)
    body_rotations(L, W, w)
    rows(L, W, w, True, True)
    factor(L, W, w, regularization, PIVOT_VANISHED)
    augmented_solution(L, W, w, refinements)


@njit
def augmented_solution(L, W, w, refinements):
    """W.a and W.lam ← a and λ by the present rows and their factor, refined so many times, and the
    formulas that measure them.
    """
    all_loads(L, W, w)
    loaded_motion(L, W, w, refinements)
    if L.force_steps < L.formula_step.shape[0]:
        measure_solution(L, W, w, refinements)


@njit
def measure_solution(L, W, w, refinements):
    """Evaluate what measures the accelerations and reactions that are in W.a and W.lam, and solve
    the algebraic loops of it. refinements: those of the solution, or `KNOWN_MOTION`.
    """
    formulas_of_forces(L, W, w)
    if L.loop_row.shape[0] > 0:
        algebraic_loops(L, W, w, L.loop_row.shape[0], refinements)


@njit
def formulas_of_forces(L, W, w):
    """Evaluate the formulas that measure accelerations and reactions, at W.a and W.lam."""
    keep_primitives(L, W, w, W.reaction, 0)
    steps(L, W, w, L.force_steps, L.formula_step.shape[0])


@njit
def loops_again(L, W, w, refinements):
    """a and λ by the present signals of loops, and what their formulas give there."""
    forces(L, W, w, -2)
    if refinements == KNOWN_MOTION:
        if L.friction_kind.shape[0] > 0:
            viscous_friction(L, W, w)
        multipliers(L, W, w)
    else:
        loaded_motion(L, W, w, refinements)
    formulas_of_forces(L, W, w)


@njit
def algebraic_loops(L, W, w, count, refinements):
    """a, λ and the signals s of loops with s = g(a, λ); the signals are g of s = 0 to begin with.
    NaN where these equations have no unique solution.
    """
    # W.loop: I − ∂g/∂s, its inverse, what each of its numbers was summed of; g − s; s
    one = 0.0 * ld(W.size, 0, w) + 1.0
    magnitude, rest = 2 * count * count, 3 * count * count
    # g is straight: a step no less than all forces leaves their rounding out of its differences
    unit = one
    for n in range(3 * L.bodies):
        unit = larger(unit, larger(ld(W.force, n, w), -ld(W.force, n, w)))
    for n in range(2 * L.nodes):
        unit = larger(unit, larger(ld(W.lam, n, w), -ld(W.lam, n, w)))
    for k in range(count):
        g = ld(W.signal, L.loop_row[k], w)
        st(W.loop, rest + k, g, w)
        st(W.loop, rest + count + k, 0.0 * one, w)
        unit = larger(unit, larger(g, -g))
    for c in range(count):
        for k in range(count):
            st(W.signal, L.loop_row[k], (1.0 if k == c else 0.0) * unit, w)
        loops_again(L, W, w, refinements)
        for k in range(count):
            rate = (ld(W.signal, L.loop_row[k], w) - ld(W.loop, rest + k, w)) / unit
            same = (1.0 if k == c else 0.0) * one
            st(W.loop, count * k + c, same - rate, w)
            st(W.loop, magnitude + count * k + c, same + larger(rate, -rate), w)
    invert_loops(W, w, count)
    for _ in range(LOOP_PASSES):
        for k in range(count):
            s = ld(W.loop, rest + count + k, w)
            for n in range(count):
                s = s + ld(W.loop, count * (count + k) + n, w) * ld(W.loop, rest + n, w)
            st(W.loop, rest + count + k, s, w)
            st(W.signal, L.loop_row[k], s, w)
        loops_again(L, W, w, refinements)
        for k in range(count):
            s = ld(W.loop, rest + count + k, w)
            st(W.loop, rest + k, ld(W.signal, L.loop_row[k], w) - s, w)
            st(W.signal, L.loop_row[k], s, w)


@njit
def invert_loops(W, w, count):
    """The inverse of the matrix in W.loop by Gauss and Jordan, with the greatest pivot of each
    column in every lane; NaN where a pivot is the rounding of what it was summed of.
    """
    inverse, magnitude = count * count, 2 * count * count
    one = 0.0 * ld(W.size, 0, w) + 1.0
    for k in range(count):
        for n in range(count):
            st(W.loop, inverse + count * k + n, (1.0 if k == n else 0.0) * one, w)
    for c in range(count):
        for r in range(c + 1, count):
            x, y = ld(W.loop, count * r + c, w), ld(W.loop, count * c + c, w)
            x, y = larger(x, -x), larger(y, -y)
            for part in range(3):
                o = part * count * count
                for n in range(count):
                    p, q = ld(W.loop, o + count * r + n, w), ld(W.loop, o + count * c + n, w)
                    st(W.loop, o + count * r + n, select_le(x, y, p, q), w)
                    st(W.loop, o + count * c + n, select_le(x, y, q, p), w)
        pivot = ld(W.loop, count * c + c, w)
        least = ALGEBRAIC_LOOP_SINGULAR * ld(W.loop, magnitude + count * c + c, w)
        per = 1.0 / select_le(larger(pivot, -pivot), least, np.nan * one, pivot)
        scale_loop(W, w, count, c, c, per, 0.0)
        for r in range(count):
            if r != c:
                scale_loop(W, w, count, r, c, one, ld(W.loop, count * r + c, w))


@inline
def scale_loop(W, w, count, r, c, per, part):
    """Row r ← per · row r − part · row c, of the matrix and its inverse; sums of magnitudes."""
    for n in range(2 * count):
        o = count * count * (n // count) + n % count
        x = per * ld(W.loop, o + count * r, w) - part * ld(W.loop, o + count * c, w)
        st(W.loop, o + count * r, x, w)
    o = 2 * count * count
    size, other = larger(per, -per), larger(part, -part)
    for n in range(count):
        x = size * ld(W.loop, o + count * r + n, w) + other * ld(W.loop, o + count * c + n, w)
        st(W.loop, o + count * r + n, x, w)


@njit
def loaded_motion(L, W, w, refinements):
    """W.a and W.lam ← a and λ for the loads in W.force, with friction."""
    if L.friction_kind.shape[0] == 0:
        balanced_motion(L, W, w, refinements)
        return
    viscous_friction(L, W, w)
    balanced_motion(L, W, w, refinements)
    if highest(any_sliding(L, W, w)) > 0.0:
        responses(L, W, w)
        friction_sizes(L, W, w)
        for _ in range(FRICTION_PASSES):
            add_sliding(L, W, w)
            balanced_motion(L, W, w, refinements)
            if not friction_changes(L, W, w):
                break
    store_sliding(L, W, w)


@njit
def balanced_motion(L, W, w, refinements):
    """W.a and W.lam ← a and λ for the loads in W.force; see `augmented_solution`."""
    # u = M⁻¹ f on slots
    clear(W.u, w)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            st(W.u, 3 * s + n, share * ld(W.force, o + n, w) * ld(W.weight, 3 * s + n, w), w)
    # S λ = G u − γ
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.x, n, w), w)
    # a = u − M⁻¹ Gᵀ λ
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(3 * L.slots):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)
    for _ in range(refinements):
        refine(L, W, w)
    for b in range(L.bodies):
        for n in range(3):
            st(W.a, 3 * b + n, ld(W.u, 3 * L.body_slot[b] + n, w), w)


@njit
def refine(L, W, w):
    """One refinement of (a, λ) in (W.u, W.lam) by the residuals of both equations."""
    # r = W⁻¹ (f − M a − Gᵀ λ)
    clear(W.r, w)
    apply_gt(L, W, w, W.lam, W.r)
    for s in range(L.slots):
        o, share = 3 * L.slot_body[s], ld(W.share, s, w)
        for n in range(3):
            f = ld(W.force, o + n, w) - ld(W.mass, o + n, w) * ld(W.u, 3 * s + n, w)
            st(W.r, 3 * s + n, share * f - ld(W.r, 3 * s + n, w), w)
    weigh(L, W, w, W.r)
    # S δλ = G (a + r) − γ: one solve serves both residuals
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) + ld(W.r, n, w), w)
    apply_g(L, W, w, W.u, W.x)
    for n in range(2 * L.nodes):
        st(W.x, n, ld(W.x, n, w) - ld(W.gamma, n, w), w)
    solve(L, W, w)
    for n in range(2 * L.nodes):
        st(W.lam, n, ld(W.lam, n, w) + ld(W.x, n, w), w)
    # a ← a + r − W⁻¹ Gᵀ δλ
    clear(W.r, w)
    apply_gt(L, W, w, W.x, W.r)
    weigh(L, W, w, W.r)
    for n in range(W.u.shape[0]):
        st(W.u, n, ld(W.u, n, w) - ld(W.r, n, w), w)


@kernel
def free_motion(L: Layout, W: Work, regularization: float, refinements: int) -> None:
    """W.a and W.lam ← accelerations and multipliers at W.q, W.v and W.time."""
    w = 0.0
    signals(L, W, w, L.signal_law.shape[0])
    free_accelerations(L, W, w, regularization, refinements)


@kernel
def repeat(L: Layout, W: Work, times: int) -> float:
    """Evaluate `times` times at positions that differ a little, for measurements of speed."""
    total = 0.0
    for _ in range(times):
        W.q[2, 0] += 1e-9
        free_accelerations(L, W, 0.0, 0.0, 0)
        total += W.a[0, 0]
    return total

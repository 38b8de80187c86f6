"""Generalised forces of all loads, each by the physics in its own file."""

from __future__ import annotations

import functools
from typing import Any

from mbody.core.decorators import inline, njit
from mbody.core.duals import entry, lane_at, put_entry, rounds
from mbody.core.lanes import ld, st
from mbody.kernels.constraints import driver_formulas, law_at, measured_formulas, side, user_numbers
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

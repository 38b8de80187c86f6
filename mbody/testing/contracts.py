"""The contracts of joints, drivers and loads, and the bench in other units."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mbody.core.tolerances import CONTRACT_TOLERANCE, SINGULAR_VALUE_ZERO, TINY, USER_POWER_NONE
from mbody.laws import Cam, Function, Law, Table
from mbody.model.driver import Driver
from mbody.model.element import Element
from mbody.model.joints import Joint
from mbody.model.loads import Load
from mbody.model.numbers import dimension_named
from mbody.quantities.units import DIMENSIONS, Dimension
from mbody.testing.bench import (
    STEPS,
    Array,
    Bench,
    BenchState,
    ElementRows,
    Frames,
    Ledger,
    Report,
    Shifts,
    about_origin,
    check_value,
    derivative,
    make_bench,
    mentioned,
    rotation,
    with_ground,
)

#: Units of length, mass and time, as parts of the old ones, that no product of small powers undoes.
UNITS = (7.3, 0.31, 1.9)


class OtherUnits:
    """A bench with every number in other units of length, mass and time.

    `missing`: Why it cannot be made: numbers that have no dimension. Empty where it can.
    """

    def __init__(self, bench: Bench) -> None:
        self.missing = _missing(bench.element)
        self.own = any(f.metadata.keys() & {"dimension", "law"} for f in _fields(bench.element))
        if self.missing:
            return
        machine = bench.system.mechanism
        dimensions = {name: dimension_named(machine, name) for name in bench.system.values}
        if None in dimensions.values():
            self.missing = "a law of it has numbers without a dimension"
            return
        values = {
            name: value / _size(dimensions[name] or Dimension())
            for name, value in bench.system.values.items()
        }
        self.bench = dataclasses.replace(bench)
        self.bench.__dict__["system"] = bench.system.with_values(values)

    def require(self, ledger: Ledger, name: str, error: float, what: str) -> None:
        """Require it of an element that declares what its numbers measure, note it of others."""
        text = f"in other units of length, mass and time {what}: what do its numbers measure?"
        if self.own:
            ledger.require(name, error, text)
        else:
            ledger.record(name, error, "it is right in any units", "it is right in one unit system")

    def state(self, state: BenchState) -> BenchState:
        """The state in the other units."""
        length, time = _size(DIMENSIONS["length"]), _size(DIMENSIONS["time"])
        unit = np.tile([length, length, 1.0], len(state.q) // 3)
        return BenchState(state.t / time, state.q / unit, state.v / unit * time)

    def forces(self, forces: Array) -> Array:
        """Forces (bodies, 3) in the other units."""
        force, torque = _size(DIMENSIONS["force"]), _size(DIMENSIONS["torque"])
        found: Array = forces / np.array([force, force, torque])
        return found

    def rows(self, phi: Array, kinds: str) -> Array:
        """Φ (rows,) in the other units."""
        sizes = [_size(DIMENSIONS["length"]) if kind == "l" else 1.0 for kind in kinds]
        found: Array = phi / np.array(sizes)
        return found


def _fields(element: Element) -> list[Any]:
    return list(dataclasses.fields(element))


def _size(dimension: Dimension) -> float:
    """The new unit of a dimension as a part of the old one."""
    powers = dimension.length, dimension.mass, dimension.time
    return float(np.prod([unit ** float(p) for unit, p in zip(UNITS, powers, strict=True)]))


def _missing(element: Element) -> str:
    for field in _fields(element):
        law = getattr(element, field.name)
        if isinstance(law, (Function, Table, Cam)):
            return f"a {type(law).__name__} cannot be taken to other units here"
        if "law" in field.metadata and isinstance(law, Law) and not law.numbers():
            return f"a {type(law).__name__} has no numbers"
    return ""


# -- The contract of joints and drivers --------------------------------------------------------


def check_joint(
    element: Joint | Driver,
    *,
    states: int = 20,
    seed: int = 0,
    tolerance: float = CONTRACT_TOLERANCE,
    length: float = 1.0,
    times: tuple[float, float] = (0.0, 1.0),
) -> Report:
    """Prove a joint or a driver: derivatives, reactions, rank, frames, copies.

    Φ_q = ∂Φ/∂q, ν = −∂Φ/∂t and γ = Φ_q a − d²Φ/dt² are compared with differences; the reactions
    that a solution would report sum to zero on both bodies and do no work on allowed velocities;
    nothing depends on the axes in which bodies are drawn, on their mass centres, or on the world's
    place, or on the units of its numbers; the rows are independent; the element is frozen, copies
    and pickles.

    Parameters
    ----------
    element : Joint or Driver
        Between any bodies: they are made for it, with the named points that it refers to.
    states : int
        How many random states to try.
    seed : int
        Of the random numbers.
    tolerance : float
        Greatest relative error.
    length : float
        Size of the bodies [length]: about that of the element's own lengths.
    times : pair of float
        Interval of the states' times: where the element's laws are defined.

    Returns
    -------
    Report
        Every check with its greatest error.

    Raises
    ------
    AssertionError
        Where the element fails: the sentence has what was found and expected, and at which state.

    Notes
    -----
    When a body is drawn in other axes, its angle changes, and so do the angles of the markers on
    it: physics that uses an angle of a body must count the marker's. About 0.1 s an element.

    Examples
    --------
    >>> from mbody import Revolute
    >>> check_joint(Revolute("A", "crank.A", "coupler.A")).worst < 1e-8
    True
    """
    if not isinstance(element, Joint | Driver):
        raise TypeError(f"check_joint takes a joint or a driver, not {element!r}")
    rng = np.random.default_rng(seed)
    ledger = Ledger(element, states, tolerance)
    bench = make_bench(element, rng, length, pushed=True)
    axes, centres, world = bench.other_axes(rng), bench.other_centres(rng), bench.other_world(rng)
    redrawn, moved = bench.redrawn(axes, centres), bench.redrawn(world)
    tried = [bench.state(rng, times) for _ in range(states)]
    units = OtherUnits(bench)
    with ledger:
        if units.missing:
            ledger.skip("units", units.missing)
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            _derivatives(ledger, bench, state, rng, times[1] - times[0])
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            _description(ledger, bench, state, redrawn, axes, centres)
            if not units.missing:
                _units(ledger, bench, state, units)
        for n, state in enumerate(tried):
            ledger.where = bench.words(n, seed, state)
            closed = bench.closed(state, rng)
            if closed is None:
                ledger.fail(f"closed: no place with Φ = 0 found; is length={length:g} apt?")
            ledger.where = bench.words(n, seed, closed)
            r = bench.rows(closed)
            _rank(ledger, bench, r)
            _reactions(ledger, bench, closed)
            _power(ledger, bench, closed, r, rng)
            _joint_in_moved_world(ledger, bench, closed, moved, world)
        check_value(ledger, bench)
    return ledger.report()


def _derivatives(
    ledger: Ledger, bench: Bench, state: BenchState, rng: np.random.Generator, span: float
) -> None:
    """Φ_q, ν and γ against differences of Φ and of dΦ/dt = Φ_q v − ν."""
    t, q, v = state
    r, unit = bench.rows(state), bench.unit
    for name, part in (("Φ", r.phi), ("Φ_q", r.G), ("ν", r.nu), ("γ", r.gamma)):
        ledger.finite(part, name)
    text = "beyond its own rows Φ, Φ_q, ν and γ must be zeros"
    ledger.require("padding", r.padding, text)
    stationary = bench.rows(BenchState(t, q, 0.0 * v))
    drift = np.abs(
        np.column_stack([r.phi - stationary.phi, r.nu - stationary.nu, r.G - stationary.G])
    ).max(axis=1)
    text = "Φ, Φ_q and ν of row {row} change with velocities; rows are of position"
    ledger.require("position only", drift, text)

    size = np.maximum(np.abs(r.G * unit).max(axis=1), np.abs(r.phi))
    for m in range(len(q)):
        move = np.zeros_like(q)
        move[m] = unit[m]

        def shifted(s: float, move: Array = move) -> Array:
            return bench.rows(BenchState(t, q + s * move, v)).phi

        what = f"∂Φ/∂{'xyθ'[m % 3]} of '{bench.bodies[m // 3].name}'"
        ledger.differ("Φ_q", what, r.G[:, m] * unit[m], shifted, size, unit[m])

    def later(s: float) -> Array:
        there: Array = bench.rows(BenchState(t + span * s, q, v)).phi
        return -there

    ledger.differ("ν", "−∂Φ/∂t", r.nu * span, later, size, span)

    a = rng.normal(size=len(q)) * unit / span**2

    def rate(s: float) -> Array:
        s = span * s
        there = bench.rows(BenchState(t + s, q + s * v + 0.5 * s * s * a, v + s * a))
        left: Array = span * (r.G @ a * s - there.G @ (v + s * a) + there.nu)
        return left

    terms = np.abs(r.G * a), np.abs(r.G * v) / span, np.abs(r.gamma)[:, None]
    size = span**2 * np.column_stack(terms).max(axis=1)
    ledger.differ("γ", "Φ_q a − d²Φ/dt²", r.gamma * span**2, rate, size, span**2)


def _description(
    ledger: Ledger, bench: Bench, state: BenchState, redrawn: Bench, axes: Frames, centres: Shifts
) -> None:
    """Other link axes and mass centres of the same bodies: Φ, ν and the forces of λ = 1 stay."""
    there = bench.carried(state, axes, centres)
    old, new = bench.rows(state), redrawn.rows(there)
    text = " of row {row} must not change when the bodies get other axes and mass centres"
    size = np.maximum(np.abs(old.G * bench.unit).max(axis=1), np.abs(old.phi))
    ledger.require("description", np.abs(old.phi - new.phi) / size, "Φ" + text)
    ledger.require("description", np.abs(old.nu - new.nu) / size, "ν" + text)
    # a row of Φ_q is a force (−λ) on each body; moments about one point compare
    before, after = (
        about_origin(r.G.reshape(-1, 3), np.tile(s.q.reshape(-1, 3), (len(r.G), 1)))
        for r, s in ((old, state), (new, there))
    )
    change, size = (np.abs(x).reshape(len(old.G), -1).max(axis=1) for x in (after - before, before))
    ledger.require("description", change / size, "the reaction" + text)


def _units(ledger: Ledger, bench: Bench, state: BenchState, units: OtherUnits) -> None:
    """Φ with all numbers in other units."""
    r, there = bench.rows(state), units.bench.rows(units.state(state))
    kinds = "".join(bench.system.row_kinds)
    size = np.maximum(np.abs(r.G * bench.unit).max(axis=1), np.abs(r.phi))
    error = np.abs(units.rows(r.phi, kinds) - there.phi) / units.rows(size, kinds)
    units.require(ledger, "units", float(error.max()), "Φ does not go along")


def _rank(ledger: Ledger, bench: Bench, r: ElementRows) -> None:
    """The dimensionless rows are independent."""
    kinds = "".join(bench.system.row_kinds)
    scale = np.array([1.0 / bench.length if kind == "l" else 1.0 for kind in kinds])
    sizes = np.linalg.svd(scale[:, None] * r.G * bench.unit, compute_uv=False)
    rank = int((sizes > SINGULAR_VALUE_ZERO * sizes[0]).sum())
    text = f"of its {len(r.G)} rows only {rank} are independent"
    ledger.require("full rank", float(len(r.G) - rank), text)


def _reactions(ledger: Ledger, bench: Bench, state: BenchState) -> None:
    """The reaction reported on j at its place, and that on i: together nothing."""
    _, on_j, on_i, place = bench.reactions(state)
    L = bench.system.layout
    if (L.primitive_i == L.bodies).all() and not on_i.any():
        return ledger.skip("action = reaction", "the ground's side is all zeros, nobody reads it")
    at_i = with_ground(state.q)[L.primitive_i]
    both = np.concatenate([about_origin(on_j, place), about_origin(on_i, at_i)])
    unbalanced(ledger, both, bench.length)


def unbalanced(ledger: Ledger, forces: Array, length: float) -> None:
    """Forces (·, 3) with moments about the world's origin must sum to zero."""
    total, size = forces.sum(axis=0), np.abs(forces).max(axis=0)
    force = max(size[0], size[1], size[2] / length)
    moment = max(size[2], length * force)
    text = "what it does to its bodies leaves a {} of {:.3g}; it must sum to zero"
    for what, left, whole in (
        ("force", math.hypot(total[0], total[1]), force),
        ("moment about the world's origin", abs(total[2]), moment),
    ):
        ledger.require("action = reaction", left / max(whole, TINY), text.format(what, left))


def _power(
    ledger: Ledger, bench: Bench, state: BenchState, r: ElementRows, rng: np.random.Generator
) -> None:
    """No work on velocities with Φ_q v = 0; that of a driver's effort where Φ_q v = ν."""
    lam, on_j, _, place = bench.reactions(state)
    L, q = bench.system.layout, with_ground(state.q)
    size = float(np.abs(on_j * [bench.length, bench.length, 1.0]).max())

    def power(u: Array) -> tuple[float, float]:
        w, parts = with_ground(u), []
        for e, (i, j) in enumerate(zip(L.primitive_i, L.primitive_j, strict=True)):
            for sign, b in ((1.0, j), (-1.0, i)):
                x, y = place[e] - q[b, :2]
                rates = w[b, 0] - w[b, 2] * y, w[b, 1] + w[b, 2] * x, w[b, 2]
                parts += list(sign * on_j[e] * rates)
        return sum(parts), max(TINY, size * float(np.abs(u / bench.unit).max()))

    inverse = bench.unit[:, None] * np.linalg.pinv(r.G * bench.unit)
    anything = rng.normal(size=len(q) * 3 - 3) * bench.unit
    allowed = anything - inverse @ (r.G @ anything)
    if np.abs(allowed / bench.unit).max() > USER_POWER_NONE:
        given, whole = power(allowed)
        text = f"its reactions give the power {given:.3g} at velocities that it allows"
        ledger.require("no work", abs(given) / whole, text)
    else:
        ledger.skip("no work", "it allows no velocity")
    if ledger.element.role == "driver":
        given, whole = power(anything - inverse @ (r.G @ anything - r.nu))
        effort = -float(lam[0, 0] * r.nu[0])
        text = f"it gives the power {given:.3g}, its effort times its rate is {effort:.3g}"
        ledger.require("power of effort", abs(given - effort) / whole, text)


def _joint_in_moved_world(
    ledger: Ledger, bench: Bench, state: BenchState, moved: Bench, world: Frames
) -> None:
    """The whole world elsewhere: still closed, and the reactions have gone along."""
    there, angle = bench.carried(state, world), world["ground"][0]
    note = "" if angle else "moved, not turned: it measures angles from the world's x axis"
    gap = np.abs(moved.rows(there).phi) / bench.length
    text = "with the whole world moved, row {row} of Φ is no longer zero"
    ledger.require("world", gap, text, note)
    old, new = bench.reactions(state)[1], moved.reactions(there)[1]
    off = new - np.column_stack([old[:, :2] @ rotation(angle).T, old[:, 2]])
    scale = np.array([bench.length, bench.length, 1.0])
    error = float(np.abs(off * scale).max() / max(TINY, np.abs(old * scale).max()))
    text = "with the whole world moved, its reaction does not go along"
    ledger.require("world", error, text, note)


# -- The contract of loads ---------------------------------------------------------------------


def check_load(
    element: Load,
    *,
    states: int = 20,
    seed: int = 0,
    tolerance: float = CONTRACT_TOLERANCE,
    length: float = 1.0,
    times: tuple[float, float] = (0.0, 1.0),
) -> Report:
    """Prove a load: action and reaction, frames, conservation, dissipation, copies.

    The forces on both bodies sum to zero; they do not depend on the axes in which bodies are drawn,
    and go along when the whole world is moved, and when its numbers are in other units: a load that
    has numbers by `number_field` must have declared what they measure. A load that is
    `conservative`, as springs and gravity, must have a symmetric stiffness, one that is
    `dissipative` must never give power; of other loads the report notes whether they do.

    Parameters
    ----------
    element : Load
        Between any bodies: they are made for it, with the named points that it refers to.
    states, seed, tolerance, length, times
        As of `check_joint`.

    Returns
    -------
    Report
        Every check with its greatest error.

    Raises
    ------
    AssertionError
        Where the element fails: the sentence has what was found and expected, and at which state.

    Notes
    -----
    A load by the ground must give the force and the torque on the ground too, as on any body: about
    its mass centre, which is the origin of the world.

    Examples
    --------
    >>> from mbody import Spring
    >>> report = check_load(Spring("spring", "ground.C", "arm.B", stiffness=20.0))
    >>> report["conservative"].error < 1e-8
    True
    """
    if not isinstance(element, Load):
        raise TypeError(f"check_load takes a load, not {element!r}")
    rng = np.random.default_rng(seed)
    ledger = Ledger(element, states, tolerance)
    bench = make_bench(element, rng, length, pushed=False)
    axes, world = bench.other_axes(rng), bench.other_world(rng)
    redrawn, moved, units = bench.redrawn(axes), bench.redrawn(world), OtherUnits(bench)
    with ledger:
        if units.missing:
            ledger.skip("units", units.missing)
        for n in range(states):
            state = bench.state(rng, times)
            ledger.where = bench.words(n, seed, state)
            forces = bench.forces(state)
            ledger.finite(forces, "the force")
            if len(mentioned(element)) < 2:
                ledger.skip("action = reaction", "it acts from outside the mechanism")
            else:
                unbalanced(ledger, about_origin(forces, with_ground(state.q)), length)
            there = redrawn.forces(bench.carried(state, axes))
            text = "its forces must not change when the bodies get other axes"
            ledger.require("description", _change(bench, forces, there), text)
            _load_in_moved_world(ledger, bench, state, forces, moved, world)
            _energy(ledger, bench, state, forces)
            if not units.missing:
                there = units.bench.forces(units.state(state))
                error = _change(bench, units.forces(forces), there)
                units.require(ledger, "units", error, "its forces do not go along")
        check_value(ledger, bench)
    return ledger.report()


def _change(bench: Bench, before: Array, after: Array) -> float:
    """Greatest change of the forces on moving bodies, as a part of the greatest force."""
    scale = np.array([bench.length, bench.length, 1.0])
    size = max(float(np.abs(before * scale).max()), TINY)
    return float(np.abs((after - before) * scale)[:-1].max()) / size


def _load_in_moved_world(
    ledger: Ledger, bench: Bench, state: BenchState, forces: Array, moved: Bench, world: Frames
) -> None:
    """The whole world elsewhere: the forces have gone along."""
    angle = world["ground"][0]
    note = "" if angle else "moved, not turned: it has to do with the world's axes"
    expected = np.column_stack([forces[:, :2] @ rotation(angle).T, forces[:, 2]])
    error = _change(bench, expected, moved.forces(bench.carried(state, world)))
    text = "with the whole world moved, its forces do not go along"
    ledger.require("world", error, text, note)


def _energy(ledger: Ledger, bench: Bench, state: BenchState, forces: Array) -> None:
    """Dependence on velocity, symmetric stiffness, power."""
    t, q, v = state
    unit = bench.unit
    element: Any = ledger.element
    moving = _change(bench, forces, bench.forces(BenchState(t, q, 0.0 * v)))
    good, bad = "its forces do not depend on velocities", "its forces depend on velocities"
    ledger.record("velocity", moving, good, bad)

    def work(step: float) -> Array:
        """Work [force·length] of unit motion m' for unit motion m: symmetric with a potential."""
        lines = []
        for m in range(len(q)):
            move = np.zeros_like(q)
            move[m] = unit[m]

            def shifted(s: float, move: Array = move) -> Array:
                there: Array = bench.forces(BenchState(t, q + s * move, v))[:-1].ravel() * unit
                return there

            lines.append(derivative(shifted, step))
        return np.array(lines)

    found = [work(step) for step in STEPS]
    size = max(TINY, *(float(np.abs(x).max()) for x in (found[0], forces[:-1].ravel() * unit)))
    curl = float(np.min([np.abs(k - k.T) for k in found], axis=0).max()) / size
    if element.conservative:
        text = "its stiffness is not symmetric, so that its work depends on the path"
        ledger.require("conservative", max(curl, moving), text)
    else:
        ledger.record(
            "conservative", max(curl, moving), "it has a potential", "it has no potential"
        )
    parts = forces[:-1].ravel() * v
    power = float(parts.sum())
    given = max(0.0, power) / max(float(np.abs(parts).max()), TINY)
    if element.dissipative:
        text = f"it gives the power {power:.3g} to its bodies; a damper only takes"
        ledger.require("dissipation", given, text)
    else:
        ledger.record("dissipation", given, "it never gives power", "it gives power at times")

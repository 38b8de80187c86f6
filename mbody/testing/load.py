"""The contract of loads."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbody.model.loads import Load
from mbody.testing.bench import (
    Bench,
    BenchState,
    Frames,
    about_origin,
    check_value,
    make_bench,
    mentioned,
    rotation,
    with_ground,
)
from mbody.testing.joint import unbalanced
from mbody.testing.report import STEPS, Array, Ledger, Report, slope
from mbody.testing.units import OtherUnits

__all__ = ["check_load"]


def check_load(
    element: Load,
    *,
    states: int = 20,
    seed: int = 0,
    tolerance: float = 1e-8,
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
            _world(ledger, bench, state, forces, moved, world)
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
    size = max(float(np.abs(before * scale).max()), 1e-300)
    return float(np.abs((after - before) * scale)[:-1].max()) / size


def _world(
    ledger: Ledger, bench: Bench, state: BenchState, forces: Array, moved: Bench, world: Frames
) -> None:
    """The whole world elsewhere: the forces have gone along."""
    turn = world["ground"][0]
    note = "" if turn else "moved, not turned: it has to do with the world's axes"
    expected = np.column_stack([forces[:, :2] @ rotation(turn).T, forces[:, 2]])
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

            lines.append(slope(shifted, step))
        return np.array(lines)

    found = [work(step) for step in STEPS]
    size = max(1e-300, *(float(np.abs(x).max()) for x in (found[0], forces[:-1].ravel() * unit)))
    curl = float(np.min([np.abs(k - k.T) for k in found], axis=0).max()) / size
    if element.conservative:
        text = "its stiffness is not symmetric, so that its work depends on the way"
        ledger.require("conservative", max(curl, moving), text)
    else:
        ledger.record(
            "conservative", max(curl, moving), "it has a potential", "it has no potential"
        )
    parts = forces[:-1].ravel() * v
    power = float(parts.sum())
    given = max(0.0, power) / max(float(np.abs(parts).max()), 1e-300)
    if element.dissipative:
        text = f"it gives the power {power:.3g} to its bodies; a damper only takes"
        ledger.require("dissipation", given, text)
    else:
        ledger.record("dissipation", given, "it never gives power", "it gives power at times")

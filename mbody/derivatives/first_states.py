"""First states of free motions, with derivatives by numbers and by what is prescribed of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.dynamics.interruptions import held_inputs
from mbody.analysis.dynamics.own_states import first_own_states
from mbody.analysis.initial.initial_state import start_drivers, state_of
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.errors import ModelError
from mbody.laws import ConstantSpeed
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker, listed
from mbody.quantities import Formula
from mbody.solution.places import link_poses
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble, with_numbers_of
from mbody.system.system import System

__all__ = ["FirstState", "first_state"]

#: Rates of what is prescribed, by place.
RATES = {"angle": "omega", "x": "vx", "y": "vy"}


@dataclass(frozen=True, eq=False)
class FirstState:
    """Where a motion begins.

    Attributes
    ----------
    t : float
    y : array (numbers,)
        Coordinates, rates, own states.
    tangents : array (numbers, names)
    accelerations : array (coordinates,)
        For sizes alone.
    way : Way
    """

    t: float
    y: np.ndarray
    tangents: np.ndarray
    accelerations: np.ndarray
    way: Way


def first_state(run: Solution, names: Sequence[str], given: bool) -> FirstState:
    """The first state of a motion of `simulate`; `given`: that of another result, which is held.

    Raises
    ------
    ModelError
        For a motion that has no derivatives, or a beginning that the numbers do not determine.
    """
    _refuse_motion(run)
    begun = run.begun[0]
    system, start = run.system, begun.start
    t, q, v = state_of(system, start)
    n = system.coordinates
    y = np.concatenate([q, v, first_own_states(system, start)])
    tangents = np.zeros((len(y), len(names)))
    for k, state in enumerate(system.mechanism.states):
        if state.start_number in names:
            tangents[2 * n + k, names.index(state.start_number)] = 1.0
    if not given:
        tangents[: 2 * n] = _prescribed(system, start, names)
    a = run.record.table(slice(2 * n, 3 * n))[0]
    return FirstState(t, y, tangents, a, begun.request.way)


def _refuse_motion(run: Solution) -> None:
    """Refuse motions that jump, or whose modes change."""
    what = _without_derivatives(run)
    if what:
        raise ModelError(
            f"gradient: a motion with {what}, as that of '{run.mechanism.name}', is not "
            "differentiated: compare designs by sweep"
        )


def _without_derivatives(run: Solution) -> str:
    """What a motion has that jumps, or changes its mode; empty where it has nothing of these."""
    system, machine = run.system, run.mechanism
    if len(system.layout.switched) or machine.contacts or machine.groups:
        return "contacts and stops"
    if len(system.layout.friction_kind):
        return "friction in joints"
    if machine.controllers or held_inputs(system):
        return "inputs that are held"
    if run.released or len(run.begun) > 1:
        return "drivers that are released, or of several parts"
    if run.ending != "completed":
        return "an end at an event, whose time changes with the numbers"
    return ""


def _prescribed(system: System, start: Solution, names: Sequence[str]) -> np.ndarray:
    """Derivatives of position and velocity, where the description prescribes all of both."""
    settings = system.mechanism.simulation
    n = system.coordinates
    imposed = [] if settings is None else start_drivers(system, settings, rates=False, poses={})
    if settings is None or system.rows + len(imposed) != n or start.regularization:
        missing = n - system.rows - len(imposed)
        raise ModelError(
            f"gradient: how the motion of '{system.mechanism.name}' begins is not determined: "
            f"{max(missing, 0)} of its coordinates follow from guesses, which are no numbers: "
            "prescribe as many as are free in the start of its simulation, or give start, a result"
        )
    depends = [
        f"start.{body}.{key}"
        for body, state in settings.start.items()
        for key, value in state.items()
        if isinstance(value, Formula) and value.names & set(names)
    ]
    if depends:
        raise ModelError(
            f"gradient: {listed(depends)} is made of a parameter in by: take the derivative by the "
            "number of the start, and give it a value of its own"
        )
    fast = start_drivers(system, settings, rates=True, poses={})
    rates = {name: speed for name, *_, speed in fast}
    machine = system.mechanism.copied()
    places: dict[str, str] = {}
    for name, (body, place, direction), value, _ in imposed:
        law = ConstantSpeed(float(value), float(rates.get(name, 0.0)))
        places[f"start.{body}.{place}"] = f"{name}.law.value"
        places[f"start.{body}.{RATES[place]}"] = f"{name}.law.speed"
        if place == "angle":
            machine.add(AngleDriver(name, body, law))
        else:
            machine.add(CoordinateDriver(name, Marker("ground", (0.0, 0.0), direction), body, law))
    driven = with_numbers_of(assemble(machine), system.values)
    run = kinematics(driven, guess=link_poses(start))
    found = np.zeros((2 * n, len(names)))
    own = [k for k, name in enumerate(names) if name in system.values or name in places]
    by = [places.get(names[k], names[k]) for k in own]
    if by:
        record = DrivenInstants(run, by).rows_at(np.zeros(1, dtype=int), with_loads=False)
        found[:, own] = record.tangents[0, : 2 * n]
    return found

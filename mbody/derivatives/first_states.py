"""First states of free motions, with derivatives by numbers and by what is prescribed of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.dynamics.own_states import first_own_states
from mbody.analysis.initial.initial_state import StartDriver, start_drivers, state_of
from mbody.core.dual_number import DualNumber
from mbody.derivatives.driven_instants import DrivenInstants
from mbody.derivatives.dual_solution import DualSolution
from mbody.derivatives.number_tangents import dual_values
from mbody.errors import ModelError
from mbody.kernels.layout import Work
from mbody.kernels.loop_closure import laws_of_time
from mbody.kernels.output import PER_PRIMITIVE
from mbody.laws import ConstantSpeed
from mbody.model.driver import AngleDriver, CoordinateDriver
from mbody.model.element import Marker
from mbody.model.simulation import STATE
from mbody.quantities import Formula
from mbody.quantities.units import DIMENSIONS
from mbody.solution.places import link_poses
from mbody.solution.restart import Way
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.other_numbers import with_numbers_of
from mbody.system.rank import dense, jacobian
from mbody.system.system import System

__all__ = ["FirstState", "first_state"]

#: Rates of what is prescribed, by place.
RATES = {"angle": "omega", "x": "vx", "y": "vy"}
#: Rows that depend on others by less than this part are dependent; so small a change is none.
CLOSED = 1e-9
#: Why there is no derivative by a number.
TIED = "what is prescribed of the beginning does not agree with the joints any more"
#: Places of a body, in the order of a pose, and the directions in which they are measured.
PLACES = (("x", 0.0), ("y", 0.5 * math.pi), ("angle", 0.0))


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
    lost: dict[str, str] = field(default_factory=dict)


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
    lost: dict[str, str] = {}
    if not given:
        tangents[: 2 * n], lost = _prescribed(system, start, names)
    return FirstState(t, y, tangents, _accelerations(run), begun.request.way, lost)


def _accelerations(run: Solution) -> np.ndarray:
    """The accelerations of the first instant, for sizes alone; of what rests with forces those that
    these would give to all mass.
    """
    system, n = run.system, run.system.coordinates
    a = np.abs(run.record.table(slice(2 * n, 3 * n))[0])
    mass = float(system.mass[:n:3, 0].sum())
    if not len(system.layout.switched) or mass <= 0.0:
        return np.asarray(a)
    primitives = run.record.table(slice(3 * n, 3 * n + PER_PRIMITIVE * len(system.owners)))[0]
    force = float(np.abs(primitives.reshape(-1, PER_PRIMITIVE)[:, 2:4]).max(initial=0.0))
    return np.maximum(a, np.tile([force / mass, force / mass, 0.0], n // 3))


def _refuse_motion(run: Solution) -> None:
    """Refuse motions that nothing here follows in dual numbers."""
    what = _without_derivatives(run)
    if what:
        raise ModelError(
            f"gradient: a motion with {what}, as that of '{run.mechanism.name}', is not "
            "differentiated: compare designs by sweep"
        )


def _without_derivatives(run: Solution) -> str:
    """What a motion has that is not followed; empty where it has nothing of these."""
    machine = run.mechanism
    if machine.groups or run.begun[0].request.way.method == "moreau":
        return "impulses in place of located impacts"
    if len(run.begun) > 1:
        return "several parts"
    own = [event for event in run.events if not event.contact]
    if run.ending != "completed" and not (own and own[-1].t == run.t[-1]):
        return "an end before its time"
    return ""


def _prescribed(
    system: System, start: Solution, names: Sequence[str]
) -> tuple[np.ndarray, dict[str, str]]:
    """Derivatives of position and velocity, where the description prescribes all of both; names by
    which there are none, and why.
    """
    settings = system.mechanism.simulation
    n = system.coordinates
    imposed = [] if settings is None else start_drivers(system, settings, rates=False, poses={})
    poses = link_poses(start)
    alone = [
        (f"{body} {place} held", (body, place, direction), poses[body][part], 0.0)
        for body in _alone(system, start)
        for part, (place, direction) in enumerate(PLACES)
        if (body, place) not in {(where[0], where[1]) for _, where, *_ in imposed}
    ]
    fast = [] if settings is None else start_drivers(system, settings, rates=True, poses={})
    rates = {name: speed for name, *_, speed in fast}
    every = [*imposed, *alone]
    free = _free(system, start, every, poses)
    if system.rows + len(free) != n or start.regularization:
        missing = n - system.rows - len(free)
        raise ModelError(
            f"gradient: how the motion of '{system.mechanism.name}' begins is not determined: "
            f"{max(missing, 0)} of its coordinates follow from guesses, which are no numbers: "
            "prescribe as many as are free in the start of its simulation, or give start, a result"
        )
    driven = _driven(system, [(one, rates.get(one[0], 0.0)) for one in free])
    places: dict[str, str] = {}
    for name, (body, place, _), *_ in free:
        places[f"start.{body}.{place}"] = f"{name}.law.value"
        places[f"start.{body}.{RATES[place]}"] = f"{name}.law.speed"
    made = _made(system, names)
    own = [name for name in names if name in system.values or name in places]
    every_name = [*own, *(name for name in made if name not in own and name in places)]
    found, lost = np.zeros((2 * n, len(names))), dict[str, str]()
    if not every_name:
        return found, lost
    by = [places.get(name, name) for name in every_name]
    chain = np.zeros((len(by), len(names)))
    for k, name in enumerate(every_name):
        if name in own:
            chain[k, names.index(name)] += 1.0
        if name in made and name not in names:
            chain[k] += made[name]
    run = kinematics(driven, guess=poses)
    whole = DrivenInstants(run, by).at(np.zeros(1, dtype=int), with_loads=False)
    found = whole.record.tangents[0, : 2 * n] @ chain
    for one in every:
        if one not in free:
            _, (body, place, _), *_ = one
            asked = made.get(f"start.{body}.{place}", np.zeros(len(names)))
            if f"start.{body}.{place}" in names:
                asked = np.eye(len(names))[names.index(f"start.{body}.{place}")]
            moved = _tangents_of(whole, body, place, len(by)) @ chain - asked
            most = max(1.0, float(np.abs(moved).max(initial=0.0)))
            lost |= {names[int(k)]: TIED for k in np.flatnonzero(np.abs(moved) > CLOSED * most)}
    return found, lost


def _driven(system: System, free: list[tuple[StartDriver, float]]) -> System:
    """The system with a driver for each of the prescribed coordinates."""
    machine = system.mechanism.copied()
    for (name, (body, place, direction), value, _), speed in free:
        law = ConstantSpeed(float(value), float(speed))
        if place == "angle":
            machine.add(AngleDriver(name, body, law))
        else:
            machine.add(CoordinateDriver(name, Marker("ground", (0.0, 0.0), direction), body, law))
    return with_numbers_of(assemble(machine), system.values)


def _free(
    system: System, start: Solution, every: list[StartDriver], poses: Mapping[str, Any]
) -> list[StartDriver]:
    """Those of the prescribed coordinates that joints leave free, first ones first."""
    if system.rows + len(every) <= system.coordinates:
        return every
    driven = _driven(system, [(one, 0.0) for one in every])
    G = dense(driven, _workspace(driven, start))[1]
    owners = [driven.owners[int(e)][0].name for e in driven.row_table[0]]
    names = [one[0] for one in every]
    order = [row for row, name in enumerate(owners) if name not in names]
    kept, found = list[np.ndarray](), list[StartDriver]()
    for row in [*order, *(owners.index(name) for name in names)]:
        left = G[row] / max(float(np.linalg.norm(G[row])), 1e-300)
        for _ in range(2):
            for one in kept:
                left = left - (one @ left) * one
        size = float(np.linalg.norm(left))
        if size > CLOSED:
            kept.append(left / size)
            if owners[row] in names:
                found.append(every[names.index(owners[row])])
    return found


def _tangents_of(whole: DualSolution, body: str, place: str, count: int) -> np.ndarray:
    """Tangents of a coordinate of a body at the only instant: (numbers,)."""
    if place == "angle":
        found: Any = whole[body].angle
    else:
        point = whole.point(Marker(body, (0.0, 0.0)))
        found = point.x if place == "x" else point.y
    return found.tangents[0] if isinstance(found, DualNumber) else np.zeros(count)


def _alone(system: System, start: Solution) -> list[str]:
    """Bodies that no joint and no driver holds: they begin where their guesses say."""
    _, G = jacobian(system, _workspace(system, start))
    moved = np.abs(G).max(axis=0, initial=0.0).reshape(-1, 3).any(axis=1)
    return [body.name for body in system.mechanism.bodies if not moved[system.bodies[body.name]]]


def _workspace(system: System, start: Solution) -> Work:
    """A workspace at the first position."""
    t, q, _ = state_of(system, start)
    work = system.work()
    work.q[: len(q), 0], work.time[0, 0] = q, t
    laws_of_time(system.runtime(), work)
    return work


def _made(system: System, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Derivatives of the numbers of the start that formulas make of some parameters."""
    mechanism, settings = system.mechanism, system.mechanism.simulation
    values = dual_values(system, [name for name in names if name in system.values])
    own = {name: values[name] for name in mechanism.parameters}
    places = [n for n, name in enumerate(names) if name in system.values]
    scope, found = mechanism.parameters.scope(own), {}
    for body, state in () if settings is None else settings.start.items():
        for key, given in state.items():
            if not isinstance(given, Formula):
                continue
            made = given.of(DIMENSIONS[STATE[key]]).value(scope)
            if isinstance(made, DualNumber):
                row = np.zeros(len(names))
                row[places] = made.tangents
                found[f"start.{body}.{key}"] = row
    return found

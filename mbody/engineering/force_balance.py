"""Counterweights that balance the inertia forces of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbody.analysis.driven.requested_instants import analyse_with
from mbody.analysis.position.assembly_analysis import as_system
from mbody.engineering.balance_of_forces import ForceBalance, Shaking
from mbody.engineering.counterweights import (
    Counterweight,
    best_moments,
    counterweight_columns,
    link_columns,
    link_moments,
    weights_of_instants,
    with_counterweights,
)
from mbody.errors import ModelError, brief
from mbody.model.element import Marker, as_marker, listed
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.solution.doubts import inherited
from mbody.solution.point_histories import point_history
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

__all__ = ["force_balance"]

Array = np.ndarray

AT_REST = (
    "the drivers have no speed in this motion: forces are those at unit rates, one driver after "
    "the other"
)
BALANCED = "the links balance each other already: no counterweight is needed"
#: Parts of the momentum, or of the shaking force, that are rounding: positions are closed to 1e-13
#: of the model length, and rates follow from them with the condition of the loops.
NOTHING = 1e-10
#: A singular value below this part of the greatest is no condition.
SINGULAR = 1e-9


def force_balance(model: Mechanism | System, on: Mapping[Any, Any], **options: Any) -> ForceBalance:
    """Counterweights that balance the inertia forces of a linkage completely, or best: balancing of
    shaking forces.

    Parameters
    ----------
    model : Mechanism or System
        Driven, of one design.
    on : mapping
        Which links get a counterweight, and how far from where: ``{"crank": "3 in"}`` from the
        origin of the link, ``{"rocker.O4": 5.0}`` from one of its points; floats [length] or text
        with units.
    **options
        The motion: ``t``, ``drive``, ``turn``, ``instants``, ``guess`` as of `kinematics`, or
        ``at``, ``over`` as of `Instants`; by default a turn of the one driver of an angle, else the
        instants of the mechanism.

    Returns
    -------
    ForceBalance
        Masses and directions, how many conditions there are, what is left and why; the shaking
        moment; the mechanism with counterweights.

    Raises
    ------
    ModelError
        For a link that there is not or that is the ground, a radius that is none, a batch, and one
        instant alone.
    SolveError
        As of `kinematics`.

    Notes
    -----
    The momentum of all links is linear in m, m x, m y of each: A p, one block of rows for each
    driver at unit rate. Where it vanishes in all positions there is no shaking force at any
    speed. The rank of A is the number of conditions: 4 of a four-bar. A counterweight adds m, m x,
    m y at its radius; its mass counts wherever its place moves. Where these counterweights cannot
    do it, those with the least mean square of the shaking force of this motion are given.
    Springs, weights and other loads are no part of it. The shaking moment has the inertias in
    it and is only reported.

    Source: R. S. Berkof and G. G. Lowen, *A new method for completely force balancing simple
    linkages*, J. Eng. Ind. 91 (1969) 21–26; F. R. Tepper and G. G. Lowen, *General theorems
    concerning full force balancing of planar linkages by internal mass redistribution*, J. Eng.
    Ind. 94 (1972) 789–796 (the way to the ground).

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.gallery.load("norton_fourbar")
    >>> found = mbody.engineering.force_balance(machine, {"crank": "3 in", "rocker": "5 in"})
    >>> found.complete, found.conditions
    (True, 4)
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError("force_balance takes one design: choose one of the batch with design(n)")
    wanted = _wanted(system, on)
    run = _motion(system, options)
    for place in wanted:
        point_history(run, place)
    blocks = _unit_rates(run)
    present = link_moments(system)
    if not present.any():
        raise ModelError(
            f"'{system.mechanism.name}' has no link with mass: there is nothing to balance"
        )
    links = _rows(blocks, None, "v")
    conditions = _rank(links, system.length)
    places, radii = list(wanted), np.array(list(wanted.values()))
    columns = _rows(blocks, places, "v")
    # what is rounding beside the momenta of the links, taken one by one, is balanced already
    size = float(np.linalg.norm(links * present))
    momentum = links @ present
    if np.linalg.norm(momentum) <= NOTHING * size:
        momentum = 0.0 * momentum
    moments = best_moments(columns, momentum, radii)
    complete = _left(columns, moments, radii, momentum) <= NOTHING * size
    before, notes = _shaking(run), []
    moving = float(np.abs(before.magnitude).max(initial=0.0)) > 0.0
    if not moving:
        notes.append(AT_REST)
    forces = [run] if moving else blocks
    if not complete:
        whole = _rows(forces, None, "a") @ present
        moments = best_moments(_rows(forces, places, "a"), whole, radii)
    weights = tuple(
        _counterweight(system, place, radius, moment)
        for place, radius, moment in zip(places, radii, moments, strict=True)
    )
    described = model if isinstance(model, Mechanism) else model.mechanism
    made = _made(described, system, weights)
    after = _same_motion(made[1], run)
    old, new = (
        [_shaking(one) for one in ((motion,) if moving else _unit_rates(motion))]
        for motion in (run, after)
    )
    left, reason = 0.0, ""
    if not momentum.any():
        notes.append(BALANCED)
    else:
        left = _size(new) / _size(old)
    if not complete:
        reason = _reason(system, wanted, left, blocks, momentum)
    return ForceBalance(
        counterweights=weights,
        conditions=conditions,
        complete=complete,
        left=left,
        reason=reason,
        before=_joined(old),
        after=_joined(new),
        run=after,
        mechanism=made[0],
        system=made[1],
        **inherited(run, after, notes=[*notes, *([reason] if reason else [])]),
    )


# -- what is asked -------------------------------------------------------------------------------


def _wanted(system: System, on: Any) -> dict[Marker, float]:
    """Places from which counterweights are measured, with their radii."""
    if not isinstance(on, Mapping) or not on:
        raise ModelError(
            'force_balance: on must name links with radii, such as {"crank": "3 in"}, not '
            f"{brief(on)}"
        )
    found: dict[Marker, float] = {}
    names = [body.name for body in system.mechanism.bodies]
    for place, given in on.items():
        marker = as_marker(place, "force_balance", "on")
        if marker.body not in names:
            raise ModelError(
                f"force_balance: there is no link '{marker.body}' for a counterweight (there are: "
                f"{listed(names)})",
                marker.body,
            )
        radius = number_in(system.mechanism, given, "length", marker.body, "radius")
        if radius <= 0.0:
            raise ModelError(
                f"the counterweight on '{marker}' has the radius {radius:g} "
                f"{system.mechanism.units.length}, it must be positive: its direction is found",
                marker.body,
            )
        if any(marker.body == other.body for other in found):
            raise ModelError(
                f"force_balance: '{marker.body}' has two counterweights: one does the work of both",
                marker.body,
            )
        found[marker] = radius
    return found


def _motion(system: System, options: Mapping[str, Any]) -> Solution:
    """The motion whose positions count."""
    given = dict(options)
    turning = [one for one in system.leaders if getattr(one, "angular", False)]
    if not given and len(system.leaders) == len(turning) == 1:
        given = {"turn": turning[0].name}
    run = analyse_with(system, "kinematics", given, "force_balance")
    if not system.leaders:
        raise ModelError(
            f"'{system.mechanism.name}' has no driver: force_balance takes positions of a driven "
            "motion, add one"
        )
    if len(run.t) < 2:
        raise ModelError(
            'force_balance takes several positions: give over="turn", or drive with the values of '
            "the drivers"
        )
    return run


def _poses(run: Solution) -> dict[str, tuple[float, float, float]]:
    """Guesses of all bodies: where they are at the first instant."""
    places = {b.name: run.point(Marker(b.name, (0.0, 0.0))) for b in run.mechanism.bodies}
    return {
        name: (float(place.x[0]), float(place.y[0]), float(run[name].angle[0]))
        for name, place in places.items()
    }


def _unit_rates(run: Solution) -> list[Solution]:
    """The same positions with one driver after the other at unit rate."""
    values = {one.name: np.asarray(run.driven(one.name)[0]) for one in run.system.leaders}
    guess = _poses(run)
    found = []
    for moving in values:
        drive = {name: (v, 1.0 if name == moving else 0.0, 0.0) for name, v in values.items()}
        options = {"drive": drive, "guess": guess}
        found.append(analyse_with(run.system, "kinematics", options, "force_balance"))
    return found


def _same_motion(system: System, run: Solution) -> Solution:
    """The motion of `run` by another system."""
    drive = {one.name: run.driven(one.name) for one in run.system.leaders}
    options = {"drive": drive, "guess": _poses(run)}
    return analyse_with(system, "kinematics", options, "force_balance")


# -- what is found -------------------------------------------------------------------------------


def _rows(runs: list[Solution], places: list[Marker] | None, of: str) -> Array:
    """Columns of the links, or of counterweights at places, over the instants of several runs."""
    parts = [
        link_columns(run, of) if places is None else counterweight_columns(run, places, of)
        for run in runs
    ]
    return np.concatenate(parts) * weights_of_instants(len(runs), len(runs[0].t))[:, None]


def _rank(columns: Array, length: float) -> int:
    """The number of conditions: of masses and first moments by the model length."""
    scaled = columns / np.tile([length, 1.0, 1.0], columns.shape[1] // 3)
    sizes = np.linalg.svd(scaled, compute_uv=False)
    return int((sizes > SINGULAR * sizes[0]).sum()) if sizes.size and sizes[0] else 0


def _left(columns: Array, moments: Array, radii: Array, present: Array) -> float:
    """What is left of the present momentum."""
    masses = np.hypot(*moments.T) / radii
    added = np.column_stack([masses, moments]).ravel()
    return float(np.linalg.norm(present + columns @ added))


def _shaking(run: Solution) -> Shaking:
    """By d'Alembert, from the motion."""
    total = np.zeros((3, len(run.t)))
    for body in run.mechanism.bodies:
        fx, fy, torque = run.inertia(body.name)
        place = run[body.name]
        total += np.array([fx, fy, torque + place.x * fy - place.y * fx])
    return Shaking(*total)


def _size(parts: list[Shaking]) -> float:
    """Root of the mean square of the force, weighted as the columns are."""
    squares = np.array([one.magnitude for one in parts]) ** 2
    squares[:, [0, -1]] *= 0.5
    return float(np.sqrt(squares.sum() / (squares.size - len(parts))))


def _joined(parts: list[Shaking]) -> Shaking:
    keys = ("fx", "fy", "moment")
    return Shaking(*[np.concatenate([getattr(one, key) for one in parts]) for key in keys])


def _counterweight(system: System, place: Marker, radius: float, moment: Array) -> Counterweight:
    size = float(np.hypot(*moment))
    angle = float(np.arctan2(moment[1], moment[0])) if size else 0.0
    x, y = _local(system, place)
    return Counterweight(
        body=place.body,
        at=str(place),
        radius=float(radius),
        angle=angle,
        mass=size / float(radius),
        x=x + float(radius * np.cos(angle)),
        y=y + float(radius * np.sin(angle)),
        moment=size,
    )


def _local(system: System, place: Marker) -> tuple[float, float]:
    """A place in the axes of its link."""
    if isinstance(place.point, str):
        x, y = system.numbers.point(f"{place.body}.{place.point}")
    elif isinstance(place.point, tuple):
        x, y = place.point
    else:
        polar = place.point
        x, y = polar.r * np.cos(polar.angle), polar.r * np.sin(polar.angle)
    return float(x), float(y)


def _made(
    described: Mechanism, system: System, weights: tuple[Counterweight, ...]
) -> tuple[Mechanism, System]:
    """Description and system with counterweights; other numbers are those of the system."""
    heavy = {one.body: [one] for one in weights if one.mass > 0.0}
    machine = with_counterweights(described, system, heavy)
    made = assemble(machine)
    others = {
        name: value
        for name, value in system.values.items()
        if name in made.values
        and made.values[name] != value
        and not (name.partition(".")[0] in heavy and _of_mass(name.partition(".")[2]))
    }
    return machine, made.with_values(others) if others else made


def _of_mass(key: str) -> bool:
    return key in ("mass", "weight", "inertia") or key.startswith(("cg.", "spread."))


def _reason(
    system: System,
    wanted: Mapping[Marker, float],
    left: float,
    blocks: list[Solution],
    present: Array,
) -> str:
    """Why counterweights on these links leave something, and what would help."""
    here = listed(place.body for place in wanted)
    head = f"counterweights on {here} leave {100.0 * left:.3g} % of the shaking force (rms)"
    stuck = _without_pins(system)
    if stuck:
        verb = "has" if len(stuck) == 1 else "have"
        return (
            f"{head}: {listed(stuck)} {verb} no way to the ground through pins, so that "
            "counterweights on links balance only a part (contour theorem)"
        )
    taken = {place.body for place in wanted}
    others = [body.name for body in system.mechanism.bodies if body.name not in taken]
    radius = float(np.mean(list(wanted.values())))
    for name in others:
        if _would_do({**wanted, Marker(name, (0.0, 0.0)): radius}, blocks, present):
            return f"{head}: with one on '{name}' too the balance is complete"
    every = {**wanted, **{Marker(name, (0.0, 0.0)): radius for name in others}}
    if others and _would_do(every, blocks, present):
        return f"{head}: more links must have one, on all of them the balance is complete"
    return f"{head}: other links or radii may leave less"


def _would_do(wanted: Mapping[Marker, float], blocks: list[Solution], present: Array) -> bool:
    """Whether these counterweights balance completely."""
    places, radii = list(wanted), np.array(list(wanted.values()))
    columns = _rows(blocks, places, "v")
    moments = best_moments(columns, present, radii)
    return _left(columns, moments, radii, present) <= NOTHING * float(np.linalg.norm(present))


def _without_pins(system: System) -> list[str]:
    """Links with mass that no chain of pins connects with the ground."""
    reached, before = {"ground"}, 0
    pins = [one.bodies for one in system.mechanism.joints if one.coincident]
    while len(reached) > before:
        before = len(reached)
        for pair in pins:
            if reached & set(pair):
                reached |= set(pair)
    heavy = [b.name for b in system.mechanism.bodies if system.mass[3 * system.bodies[b.name], 0]]
    return [name for name in heavy if name not in reached]

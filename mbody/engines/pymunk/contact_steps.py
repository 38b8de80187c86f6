"""A motion with contacts by pymunk, compared with ours."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np

from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, by_newtons_law, first_of_several
from mbody.engines.opinion import Inexpressible, Opinion
from mbody.engines.pymunk.instants import kinematic
from mbody.engines.pymunk.shapes_that_touch import TouchingShapes, inexpressible_contacts
from mbody.engines.pymunk.space import Space, inexpressible
from mbody.engines.pymunk.steps import SpaceStepper, of_system
from mbody.model.element import listed
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["contact_opinion"]

#: Iterations of the solver at every step, with joints, along which impacts go, many more; and the
#: part of them with which one more motion says what they leave.
ITERATIONS, WITH_JOINTS, FEWER = 100, 1000, 0.25


def contact_opinion(system: System, run: Solution, engine: str) -> Opinion:
    """Places at instants, and what every contact does, by steps of several lengths."""
    missing = [*inexpressible(system), *inexpressible_contacts(system)]
    trial = Space(system, 1.0, 1)
    missing += [
        Inexpressible(name, "pymunk needs a mass and an inertia of every body that strikes")
        for name in trial.lumped
    ]
    if missing:
        return Opinion(engine, (), tuple(missing), ("without these nothing can be compared",))
    notes = []
    last = by_newtons_law(system, run)
    if last < run.t[-1]:
        notes.append(
            f"pymunk's impacts follow Newton's law: compared up to t = {last:.6g}, for with that "
            "law the motion would go on otherwise than with Poisson's"
        )
    several = first_of_several(run)
    if several is not None and several <= last:
        last = float(np.nextafter(several, -np.inf))
        notes = [
            "where several contacts strike at once with restitution, steps find them one by one: "
            f"compared up to t = {several:.6g}"
        ]
    if trial.over:
        names = listed([system.mechanism.loads[n].name for n in trial.over])
        notes.append(f"applied with the values from mbody, not checked: {names}")
    check = StepwiseCheck(run, last, "pymunk", order=1.0, near=0.01)
    iterations = WITH_JOINTS if trial.parts else ITERATIONS
    few = int(FEWER * iterations)
    rows, unseen, more = check.rows(
        functools.partial(_motion, system, run, check.times, iterations),
        functools.partial(_motion, system, run, check.times, few),
    )
    return Opinion(engine, tuple(rows), tuple(unseen), (*more, *notes))


def _motion(
    system: System, run: Solution, times: np.ndarray, iterations: int, counts: list[int]
) -> Stepped:
    """The motion with a number of steps between the instants."""
    space = Space(system, 1.0, iterations)
    rates = np.abs(kinematic(run, "rate")) * (1.0, 1.0, system.length)
    last = float(run.t[-1])
    # what stays where it is has the speed of a model length over the motion
    least = system.length / max(last - float(run.t[0]), 1e-300)
    touching = TouchingShapes(space, max(float(rates.max()), least))
    stepper = SpaceStepper(space, functools.partial(of_system, run.system, last=last), last=last)
    stepper.put(kinematic(run, "place")[0], kinematic(run, "rate")[0])
    places, modes = [], []
    for (begin, end), count in zip(pairwise(times.tolist()), counts, strict=True):
        h = (end - begin) / count
        if count > 1:
            stepper.go(begin, h, count - 1)
        touching.begin()
        stepper.go(end - h, h, 1)
        places.append(stepper.state()[0])
        modes.append(dict(touching.modes))
    named = {name: [one[name] for one in modes] for name in touching.names}
    return Stepped(np.array(places), named)

"""What is to be known of a motion by steps with impulses: notes and doubts."""

from __future__ import annotations

from mbody.kernels.contact_shapes import ImpulseSteps
from mbody.kernels.moreau import (
    CONTACTS,
    DEEPEST,
    DEEPEST_PART,
    ITERATIONS_DONE,
    NEARER,
    PART_AT,
    STEPS_DONE,
    SWEEPS_DONE,
    UNSOLVED_AT,
    UNSOLVED_COUNT,
    UNSOLVED_MOST,
)
from mbody.model.element import listed
from mbody.solution.doubts import Doubt
from mbody.solution.restart import Way
from mbody.system.system import System

__all__ = ["SWEEPS", "judged_steps"]

#: Sweeps of one step of few contacts, at most.
SWEEPS = 800
#: A last change of impulses that is a greater part of the greatest leaves a doubt.
UNCERTAIN = 1e-3
#: Overlap, as a part of the smaller shape, that leaves a doubt.
DEEP = 0.05
#: Contacts at once up to which a motion by events is the better one.
FEW = 12


def judged_steps(whole: System, motion: ImpulseSteps, way: Way) -> tuple[list[str], list[Doubt]]:
    """What is to be known of the steps, and what is in doubt."""
    state, units = motion.state, whole.mechanism.units
    machine, notes, doubts = whole.mechanism, list[str](), list[Doubt]()
    steps = int(state[STEPS_DONE])
    sweeps, iterations = (state[n] / max(steps, 1) for n in (SWEEPS_DONE, ITERATIONS_DONE))
    ways = f"{sweeps:.3g} sweeps"
    if iterations:
        ways += f" and {iterations:.3g} iterations of the interior-point method"
    notes.append(
        f"steps of {way.step:g} {units.time} with impulses, of order one: up to "
        f"{int(state[CONTACTS])} contacts at once, {ways} a step, impulses to "
        f"{way.rtol:.0e} of the greatest; shapes overlap by at most "
        f"{max(state[DEEPEST], 0.0):.2g} {units.length}, {100 * max(state[DEEPEST_PART], 0.0):.2g}"
        " % of the smaller"
    )
    if state[NEARER] > 0.0:
        notes.append(
            "of many contacts one that slides comes nearer, or leaves, by what its sliding changes "
            f"in a step: by at most {100 * state[NEARER]:.2g} % of the smaller shape"
        )
    if (machine.contacts or machine.groups) and state[CONTACTS] <= FEW:
        notes.append(
            f"of so few contacts ({int(state[CONTACTS])} at once) dop853 finds the motion to its "
            "tolerance, with each impact and each change between sticking and sliding located"
        )
    bouncing = [
        one.name
        for one in (*machine.contacts, *machine.groups)
        if getattr(one, "law", "newton") == "poisson" and getattr(one, "restitution", 0.0)
    ]
    if bouncing:
        notes.append(
            f"impacts of {listed(bouncing)} follow Newton's law of restitution: steps with "
            "impulses know no compression and expansion"
        )
    if state[UNSOLVED_COUNT]:
        t, part = float(state[UNSOLVED_AT]), float(state[UNSOLVED_MOST])
        message = (
            f"the impulses of {int(state[UNSOLVED_COUNT])} of {steps} steps are not found to "
            f"{way.rtol:.0e}, first at t = {t:.6g} {units.time}: what is left is {part:.1e} of the "
            "greatest"
        )
        if part > UNCERTAIN:
            doubts.append(Doubt("solver", f"{message}; take shorter steps", t))
        else:
            notes.append(message)
    if state[DEEPEST_PART] > DEEP:
        t, part = float(state[PART_AT]), 100 * float(state[DEEPEST_PART])
        doubts.append(
            Doubt(
                "contact",
                f"shapes overlap by {part:.2g} % of the smaller one at t = {t:.6g} {units.time}, "
                f"more than {100 * DEEP:g} %: take shorter steps",
                t,
            )
        )
    return notes, doubts

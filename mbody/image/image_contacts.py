"""Free motions of an image in which something may open, stick or strike."""

from __future__ import annotations

import numpy as np

from mbody.analysis.dynamics.contact_motion import EventIntegration
from mbody.analysis.dynamics.contact_start import fit_contacts
from mbody.errors import ModelError
from mbody.image.arena import Arena
from mbody.kernels.advance import UnilateralMotion
from mbody.kernels.force_programs import open_forces_memory
from mbody.kernels.number_program import NumberProgram
from mbody.solution.solution import IntegrationSettings, Solution
from mbody.system.system import System

#: Happenings that an image keeps; numbers of each: time, what it is, contact point.
HAPPENINGS, OF_EACH = 1000, 3
#: Bytes for the problem of everything that may act at once, at most.
MOST_BYTES = 64e6


def contact_motion(
    system: System, start: Solution, settings: IntegrationSettings
) -> EventIntegration:
    """The motion of a system, with memory for everything that may act at once."""
    motion = EventIntegration(system, start, settings, ())
    points, joints = len(motion.uni.contact_points), len(motion.uni.friction_joints)
    rows = 2 * points + len(motion.layout.friction_kind)
    forces, lines = system.rows + 2 * points + joints, 3 * points + 2 * joints
    limits = lines + 4 * joints + 2 * forces
    if 8.0 * ((5.0 * rows) ** 2 + 4.0 * limits**2) > MOST_BYTES:
        raise ModelError(
            f"'{system.mechanism.name}' has {points} places that may touch, too many for an image: "
            "leave out contacts that never close"
        )
    motion.memory.grow(rows)
    found = open_forces_memory(system.coordinates, forces, lines, joints)
    for name, bundle in zip(("open", "program"), found, strict=True):
        motion.guard_table.attach(name, bundle)
    return motion


def fitted_start(motion: EventIntegration, q: np.ndarray) -> np.ndarray:
    """The first position (coordinates,), fitted to contacts, once the motion has begun; refuses
    shapes that overlap, and what an image cannot begin with.
    """
    motion.load()
    if fit_contacts(motion.uni, motion.work) is not None:
        q = motion.work.q[: motion.system.coordinates, 0].copy()
    trial = EventIntegration(motion.system, motion.start, motion.settings, ())
    n = motion.system.coordinates
    trial.begin(motion.first, q, motion.y[n : 2 * n], motion.until)
    status = trial.begin_modes()
    if status or any("rolls at once" in note for note in trial.log.notes):
        raise ModelError(
            f"an image cannot begin the motion of '{motion.system.mechanism.name}': "
            f"{status or trial.log.notes[-1]}"
        )
    return q


def enter_contacts(arena: Arena, motion: EventIntegration, steps: int) -> UnilateralMotion:
    """Enter what a program reads and sets of a motion with contacts; the motion."""
    G = motion.guard_table
    G.asked[:] = motion.first, steps, motion.swings, 1.0
    arena.array("motion.stage", motion.stage)
    arena.array("motion.page", G.page)
    arena.array("motion.events", np.zeros(HAPPENINGS * OF_EACH))
    arena.array("motion.happened", np.zeros(1))
    arena.array("motion.struck", motion.memory.impact.first)
    for name in ("advance", "run"):
        arena.word(f"{name}.until", arena.put(G.asked))
        arena.word(f"{name}.steps", arena.put(G.asked) + 8)
    found = motion.eliminate_rows_that_are_on()
    whole = {"layout": motion.layout, "joints": motion.layout}
    return found.replaced(**whole, reduced=motion.work, joint_work=motion.work)


def keep_phases(motion: EventIntegration, numbers: NumberProgram) -> None:
    """Where circles that stick have met is no number of the model: other numbers leave it."""
    numbers.targets[motion.uni.phase_rows] = -1

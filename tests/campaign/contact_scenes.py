"""A random scene of bodies that touch, as it is examined: its motion, and what is wrong with it."""

from __future__ import annotations

import warnings
from collections import Counter
from typing import Any

import numpy as np

import mbody
from mbody.errors import ModelWarning
from tests.campaign.analyses import Finding
from tests.campaign.held import Program, compare
from tests.campaign.scene_checks import Checks, Fault, faults_of
from tests.campaign.scenes import Scene, random_scene, uneven_scene

__all__ = ["examine_scene", "examine_uneven"]


def marks(scene: Scene, run: Any) -> list[Fault]:
    """Forces at the end that are marked unique and are not, by the linear program of what acts."""
    if any(one.friction for one in (*scene.pins, *scene.guides)) or scene.guides:
        return []
    if any(pin.limits for pin in scene.pins):
        return []
    checks = Checks(scene, run)
    state = checks.states[-1]
    checks.t = float(run.t[-1])
    program = Program(checks, [], state, True)
    if not program.columns or not np.isfinite(program.load).all():
        return []
    for one in (*scene.touching, *scene.ropes, *scene.pins):
        reaction = run.reaction(one.name)
        sign = 1.0 if reaction.on == one.j[0] else -1.0
        for k, (key, form) in enumerate(zip(("fx", "fy"), program.forms(one.name), strict=True)):
            band = program.band(sign * form) if np.any(form) else None
            compare(checks, f"{one.name}.{key}", band, reaction.unique[k], None, program.scale)
    return checks.faults


def examine_scene(seed: int) -> Finding:
    """Draw the scene of a seed, and judge its motion. An end before its time counts as refused."""
    return _examined(random_scene(seed), f"scene {seed}")


def examine_uneven(seed: int) -> Finding:
    """Draw the scene of a seed whose masses differ greatly, and judge it."""
    return _examined(uneven_scene(seed), f"uneven {seed}")


def _examined(scene: Scene, name: str) -> Finding:
    model = scene.mechanism(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        try:
            run = mbody.simulate(model, scene.until, rtol=scene.rtol, instants=scene.instants)
            faults = faults_of(scene, run) + marks(scene, run)
        except (mbody.ModelError, mbody.SolveError) as error:
            told = f"{type(error).__name__}: {error}"
            return Finding(scene.kind, 1, refused=1, told=told, model=model)
    counts = ", ".join(f"{n} {kind}" for kind, n in Counter(f.kind for f in faults).items())
    told = f"{counts}; {max(faults, key=lambda f: f.size)}" if faults else ""
    if run.doubts:
        told = f"{told or 'nothing wrong'}; {run.status}"
        return Finding(scene.kind, 1, doubted=1, told=told, model=model)
    if faults:
        return Finding(scene.kind, 1, silent=1, told=told, model=model)
    if run.status != "completed":
        return Finding(scene.kind, 1, refused=1, told=run.status, model=model)
    return Finding(scene.kind, 1)

"""A random scene of bodies that touch, as it is examined: its motion, and what is wrong with it."""

from __future__ import annotations

import warnings
from collections import Counter

import mbody
from mbody.errors import ModelWarning
from tests.campaign.analyses import Finding
from tests.campaign.scene_checks import faults_of
from tests.campaign.scenes import random_scene

__all__ = ["examine_scene"]


def examine_scene(seed: int) -> Finding:
    """Draw the scene of a seed, and judge its motion. An end before its time counts as refused."""
    scene = random_scene(seed)
    model = scene.mechanism(f"scene {seed}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        try:
            run = mbody.simulate(model, scene.until, rtol=scene.rtol, instants=scene.instants)
            faults = faults_of(scene, run)
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

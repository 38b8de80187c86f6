"""The word that somebody means: what others call so, or the one that is spelled most like it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

#: What others call it, by the words that users of other programs and textbooks write.
OTHER_WORDS: dict[str, tuple[str, ...]] = {
    word: tuple(meanings.split())
    for words, meanings in {
        "pin hinge turning_pair pivot": "revolute",
        "slider slide sliding translational guide rail": "prismatic",
        "slot pin_in_slot yoke": "pin_slot",
        "weld welded clamp rigid": "fixed",
        "rod link_of_length strut": "distance",
        "roller wheel": "rolling",
        "cam follower": "cam_follower",
        "rack pinion": "rack_pinion",
        "torsional_spring rotational_spring": "torsion_spring",
        "torsional_damper rotational_damper": "torsion_damper",
        "dashpot": "damper",
        "moment": "torque",
        "links link body members parts rigid_bodies": "bodies",
        "pins joint constraints pairs connections": "joints",
        "motors motor driver actuators": "drivers",
        "forces load springs dampers torques": "loads kinetostatics",
        "belts ropes coupling": "couplings",
        "frame fixed base world": "ground",
        "variables constants params parameter": "parameters",
        "outputs measure sensors quantities": "measures",
        "input controls commands signals": "inputs",
        "state auxiliary_states odes integrators filters": "states",
        "contact collisions": "contacts",
        "curve profiles": "curves",
        "law": "laws",
        "simulation motion run dynamics": "simulate",
        "optimise optimization optimisation": "optimize",
        "synthesise synthesis": "synthesize",
        "inverse_dynamics reactions inversedynamics": "kinetostatics",
        "gallery examples": "models",
        "fbd free_body freebodies": "freebody",
        "plot picture sketch": "draw",
        "film movie video": "animate",
        "over": "turn",
        "at times": "t",
    }.items()
    for word in words.split()
}


def meant(word: object, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The known word that somebody means: what others call so, or the one that is spelled most
    like it; None where there is none.

    >>> meant("slider", ["revolute", "prismatic"]), meant("revolut", ["revolute", "prismatic"])
    ('prismatic', 'revolute')
    """
    there = list(known)
    given = str(word)[:100]
    for one in OTHER_WORDS.get(given.lower().replace("-", "_").replace(" ", "_"), ()):
        if one in there:
            return one
    return next(iter(difflib.get_close_matches(given, there, 1, cutoff)), None)

"""The word that somebody means: what others call so, or the one that is spelled most like it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

#: Kinds of elements by the other words that textbooks have for them, which model files take too.
KINDS: dict[str, str] = {
    word: kind
    for kind, words in {
        "revolute": "pin hinge pivot pin_joint hinge_joint turning_pair",
        "prismatic": "slider slide sliding sliding_pair slider_joint",
        "fixed": "weld welded rigid",
        "pin_slot": "pin_in_slot slot slotted_pin",
        "gear": "gears gear_pair gear_mesh",
        "rack_pinion": "rack_and_pinion",
        "cam_follower": "cam cam_and_follower",
        "rolling": "rolling_contact",
        "belt": "belt_drive",
        "torque": "moment couple",
        "damper": "dashpot",
        "torsion_spring": "torsional_spring rotational_spring",
        "torsion_damper": "torsional_damper rotational_damper",
        "tyre": "tire",
        "rope": "cable",
        "freewheel": "one_way_clutch overrunning_clutch",
        "stop": "end_stop",
    }.items()
    for word in words.split()
}
#: What others call it, by the words that users of other programs and textbooks write.
OTHER_WORDS: dict[str, tuple[str, ...]] = {word: (kind,) for word, kind in KINDS.items()} | {
    word: tuple(meanings.split())
    for words, meanings in {
        "translational guide rail": "prismatic",
        "yoke": "pin_slot",
        "clamp": "fixed",
        "rod link_of_length strut": "distance",
        "roller wheel": "rolling",
        "follower": "cam_follower",
        "rack pinion": "rack_pinion",
        "links link body members parts rigid_bodies": "bodies",
        "pins joint constraints pairs connections": "joints",
        "motors motor driver actuators": "drivers",
        "forces load springs dampers torques": "loads",
        "belts ropes coupling": "couplings",
        "frame fixed base world": "ground",
        "variables constants params parameter": "parameters",
        "outputs measure sensors": "measures",
        "input controls commands signals": "inputs",
        "state auxiliary_states odes integrators filters": "states",
        "quantity variable intermediate definitions": "quantities",
        "contact collisions": "contacts",
        "curve profiles": "curves",
        "law": "laws",
        "simulation motion run dynamics": "simulate",
        "optimise optimization optimisation": "optimize",
        "over": "turn",
        "turn": "over",
        "theta phi orientation heading": "angle",
        "w angular_velocity": "omega",
        "angular_acceleration": "alpha",
        "x": "fx",
        "y": "fy",
        "mz": "torque",
        "force": "reaction",
        "torque": "effort",
        "time": "t",
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
    for one in there:
        if one.lower() == given.lower():
            return one
    return next(iter(difflib.get_close_matches(given, there, 1, cutoff)), None)


class Attributes:
    """A class whose refusal of an attribute that it has not says which one is meant."""

    def read_by(self, name: str) -> str:
        """How something of that name is read, if not as an attribute; "" where there is none."""
        return ""

    if not TYPE_CHECKING:  # for which all attributes would be there

        def __getattr__(self, name: str) -> Any:
            """Refuse it."""
            what = f"a {type(self).__name__} has no '{name}'"
            if name.startswith("_"):
                raise AttributeError(what)
            if place := self.read_by(name):
                raise AttributeError(f"{what}: it is read by {place}")
            known = [one for one in dir(type(self)) if one[0] != "_" and one != "read_by"]
            known += [one for one in getattr(type(self), "__annotations__", ()) if one not in known]
            close = meant(name, known)
            raise AttributeError(
                what + (f": did you mean '{close}'?" if close else f" (it has: {', '.join(known)})")
            )

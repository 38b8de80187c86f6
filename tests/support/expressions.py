"""Formulas of a law made as their fields make them."""

from mbody import AngleDriver, makers
from mbody.laws import Expression, compile_formula
from mbody.quantities import Scope, Valued, read
from mbody.quantities.units import DIMENSIONS

TIME, ANGLE, LENGTH = (DIMENSIONS[name] for name in ("time", "angle", "length"))


def made(text, dimension=None, argument=TIME, angle="rad", **names):
    """The law of a formula, with parameters that are plain numbers or `Valued`."""
    scope = Scope(names={k: v if isinstance(v, Valued) else Valued(v) for k, v in names.items()})
    return compile_formula(read(text, dimension, angle), scope, argument)


def program(text, **names):
    """The same, where it must be a program."""
    found = made(text, **names)[0]
    assert isinstance(found, Expression)
    return found


def four_bar(angle_law, *loads):
    """Norton's proportions, driven by that law."""
    machine = makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=1.0)
    fresh = type(machine)("four-bar", ground=dict(machine.ground.points))
    fresh.add(*machine.bodies, *machine.joints, AngleDriver("motor", "crank", angle_law), *loads)
    return fresh

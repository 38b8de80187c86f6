"""mbody: planar multibody dynamics. Describe a mechanism, get its motion and every joint force.

>>> import mbody
>>> machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
>>> run = mbody.kinetostatics(machine)
>>> round(float(run["crank"].omega[0]), 6)
10.0
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mbody._version import __version__

if TYPE_CHECKING:
    from mbody import engineering, gallery, laws, makers, sweeps, testing
    from mbody.analysis import (
        close_loops,
        equilibrium,
        equilibrium_curve,
        free_body,
        kinematics,
        kinetostatics,
        linearize,
        members,
        mobility,
        modes,
        reach,
        simulate,
        solve_for,
        statics,
    )
    from mbody.assembler import assemble
    from mbody.bodies import Body, Guess, SecondMoments, Slender, deg, rpm
    from mbody.bridges.crosscheck import Crosscheck, crosscheck
    from mbody.bridges.mjcf import to_mjcf
    from mbody.couplings import AngleCoupling, LengthCoupling, Term
    from mbody.doubts import Doubt
    from mbody.drivers import AngleDriver, CoordinateDriver, DistanceDriver
    from mbody.elements import Marker, Polar, number_field, polar
    from mbody.errors import ModelError, ModelWarning, SolveError
    from mbody.events import Event, Occurrence, Stop
    from mbody.formulas import convert
    from mbody.histories import Reaction
    from mbody.io.model import Limits, from_text, in_units, load, save, to_text
    from mbody.io.saved import load_run, save_run
    from mbody.joints import (
        CamFollower,
        CustomJoint,
        Distance,
        Fixed,
        Gear,
        PinSlot,
        Prismatic,
        RackPinion,
        Revolute,
        Rolling,
    )
    from mbody.laws import (
        Cam,
        Constant,
        ConstantAcceleration,
        ConstantSpeed,
        Dwell,
        Function,
        Harmonic,
        Polynomial,
        Rise,
        Table,
    )
    from mbody.loads import (
        CustomLoad,
        Damper,
        Force,
        Gravity,
        PistonPressure,
        RotatingField,
        Spring,
        Torque,
        TorsionDamper,
        TorsionSpring,
        ValvedCylinder,
    )
    from mbody.mechanism import Mechanism
    from mbody.momenta import momentum
    from mbody.questions import Ask, Measure, Question, Unknown
    from mbody.simulation import Simulation
    from mbody.solution import Solution
    from mbody.sweeps.run import sweep
    from mbody.system import System
    from mbody.views import draw, plot


# where each public name lives: loaded when it is asked for, so that `import mbody` costs nothing
_HOME = {
    "analysis": "close_loops equilibrium equilibrium_curve free_body kinematics kinetostatics "
    "linearize members mobility modes reach simulate solve_for statics",
    "assembler": "assemble",
    "bridges.crosscheck": "Crosscheck crosscheck",
    "bridges.mjcf": "to_mjcf",
    "bodies": "Body Guess SecondMoments Slender deg rpm",
    "formulas": "convert",
    "io.model": "Limits from_text in_units load save to_text",
    "io.saved": "load_run save_run",
    "questions": "Ask Measure Question Unknown",
    "simulation": "Simulation",
    "couplings": "AngleCoupling LengthCoupling Term",
    "drivers": "AngleDriver CoordinateDriver DistanceDriver",
    "doubts": "Doubt",
    "elements": "Marker Polar number_field polar",
    "errors": "ModelError ModelWarning SolveError",
    "events": "Event Occurrence Stop",
    "joints": "CamFollower CustomJoint Distance Fixed Gear PinSlot Prismatic RackPinion Revolute "
    "Rolling",
    "laws": "Cam Constant ConstantAcceleration ConstantSpeed Dwell Function Harmonic Polynomial "
    "Rise Table",
    "loads": "CustomLoad Damper Force Gravity PistonPressure RotatingField Spring Torque "
    "TorsionDamper TorsionSpring ValvedCylinder",
    "mechanism": "Mechanism",
    "momenta": "momentum",
    "histories": "Reaction",
    "solution": "Solution",
    "sweeps.run": "sweep",
    "system": "System",
    "views": "draw plot",
}
_MODULES = ("engineering", "gallery", "laws", "makers", "sweeps", "testing")
_WHERE = {name: home for home, names in _HOME.items() for name in names.split()}

__all__ = [*_WHERE, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f"mbody.{name}")
    if name in _WHERE:
        value = getattr(importlib.import_module(f"mbody.{_WHERE[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'mbody' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)

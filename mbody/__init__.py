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
from mbody.solution import presentation

if TYPE_CHECKING:
    from mbody import engineering, gallery, laws, sweeps, testing
    from mbody.analysis.driven.driver_range import driver_range
    from mbody.analysis.driven.free_body import free_body, member_forces
    from mbody.analysis.driven.kinematics import kinematics
    from mbody.analysis.driven.kinetostatics import kinetostatics
    from mbody.analysis.driven.statics import statics
    from mbody.analysis.dynamics.simulate import simulate
    from mbody.analysis.equilibria.equilibrium import equilibrium
    from mbody.analysis.equilibria.equilibrium_curve import equilibrium_curve
    from mbody.analysis.freedom.mobility import mobility
    from mbody.analysis.initial.close_loops import close_loops
    from mbody.analysis.inverse.solve_for import solve_for
    from mbody.analysis.linear.linearize import linearize
    from mbody.analysis.linear.modes import modes
    from mbody.engines.crosscheck import Crosscheck, crosscheck
    from mbody.engines.mjcf import to_mjcf
    from mbody.errors import ModelError, ModelWarning, SolveError
    from mbody.files.model import Limits, from_text, in_units, load, save, to_text
    from mbody.files.saved import load_run, save_run
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
    from mbody.makers import makers
    from mbody.model.body import Body, Guess, SecondMoments, SlenderRod, deg, rpm
    from mbody.model.coupling import AngleCoupling, CouplingTerm, LengthCoupling
    from mbody.model.driver import AngleDriver, CoordinateDriver, DistanceDriver
    from mbody.model.element import Marker, Polar, number_field, polar
    from mbody.model.event import Event, Stop
    from mbody.model.joints import (
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
    from mbody.model.loads import (
        CentrifugalField,
        CustomLoad,
        Damper,
        Force,
        Gravity,
        PistonPressure,
        ReciprocatingCylinder,
        Spring,
        Torque,
        TorsionDamper,
        TorsionSpring,
    )
    from mbody.model.mechanism import Mechanism
    from mbody.model.simulation import SimulationSettings
    from mbody.model.study import Instants, Measure, Question, Unknown
    from mbody.quantities import convert
    from mbody.solution.doubts import Doubt
    from mbody.solution.event_record import EventRecord
    from mbody.solution.histories import Reaction
    from mbody.solution.momentum import momentum
    from mbody.solution.solution import Solution
    from mbody.sweeps.run import sweep
    from mbody.system.assembler import assemble
    from mbody.system.system import System
    from mbody.views import draw, plot

presentation.register(
    sheet="mbody.sheets.present:sheet",
    data="mbody.files.present:data",
    equations="mbody.sheets.equations:system_of_equations",
    columns="mbody.files.tables:columns",
    dataframe="mbody.files.tables:dataframe",
    csv="mbody.files.tables:write_csv",
    json="mbody.files.results:write_json",
    npz="mbody.files.results:write_npz",
)

# where each public name lives: loaded when it is asked for, so that `import mbody` costs nothing
_HOME = {
    "analysis.initial.close_loops": "close_loops",
    "analysis.equilibria.equilibrium": "equilibrium",
    "analysis.equilibria.equilibrium_curve": "equilibrium_curve",
    "analysis.driven.free_body": "free_body member_forces",
    "analysis.driven.kinematics": "kinematics",
    "analysis.driven.kinetostatics": "kinetostatics",
    "analysis.driven.statics": "statics",
    "analysis.driven.driver_range": "driver_range",
    "analysis.linear.linearize": "linearize",
    "analysis.linear.modes": "modes",
    "analysis.freedom.mobility": "mobility",
    "analysis.dynamics.simulate": "simulate",
    "analysis.inverse.solve_for": "solve_for",
    "system.assembler": "assemble",
    "engines.crosscheck": "Crosscheck crosscheck",
    "engines.mjcf": "to_mjcf",
    "model.body": "Body Guess SecondMoments SlenderRod deg rpm",
    "quantities": "convert",
    "files.model": "Limits from_text in_units load save to_text",
    "files.saved": "load_run save_run",
    "model.study": "Instants Measure Question Unknown",
    "model.simulation": "SimulationSettings",
    "model.coupling": "AngleCoupling LengthCoupling CouplingTerm",
    "model.driver": "AngleDriver CoordinateDriver DistanceDriver",
    "solution.doubts": "Doubt",
    "model.element": "Marker Polar number_field polar",
    "errors": "ModelError ModelWarning SolveError",
    "model.event": "Event Stop",
    "solution.event_record": "EventRecord",
    "model.joints": "CamFollower CustomJoint Distance Fixed Gear PinSlot Prismatic RackPinion "
    "Revolute Rolling",
    "laws": "Cam Constant ConstantAcceleration ConstantSpeed Dwell Function Harmonic Polynomial "
    "Rise Table",
    "model.loads": "CustomLoad Damper Force Gravity PistonPressure CentrifugalField Spring Torque "
    "TorsionDamper TorsionSpring ReciprocatingCylinder",
    "model.mechanism": "Mechanism",
    "solution.momentum": "momentum",
    "solution.histories": "Reaction",
    "solution.solution": "Solution",
    "sweeps.run": "sweep",
    "system.system": "System",
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

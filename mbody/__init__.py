"""mbody: planar multibody dynamics. Describe a mechanism, get its motion and every joint force.

>>> import mbody
>>> machine = mbody.makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0), speed=10.0)
>>> run = mbody.kinetostatics(machine)
>>> round(float(run["crank"].omega[0]), 6)
10.0

These names are for every user, with the folders `mbody.laws`, `mbody.makers`, `mbody.gallery`,
`mbody.engineering`, `mbody.envs`, `mbody.sweeps`, `mbody.synthesis`, `mbody.teaching` and
`mbody.testing`.
"""

from __future__ import annotations

import importlib

from mbody._version import __version__ as __version__
from mbody.core import presentation, registered

#: As that of `typing`, which takes time to load.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from mbody import engineering as engineering
    from mbody import envs as envs
    from mbody import gallery as gallery
    from mbody import laws as laws
    from mbody import makers as makers
    from mbody import sweeps as sweeps
    from mbody import synthesis as synthesis
    from mbody import teaching as teaching
    from mbody import testing as testing
    from mbody.analysis.assemblies.assembly_modes import assembly_modes as assembly_modes
    from mbody.analysis.assemblies.circuits import circuits as circuits
    from mbody.analysis.assemblies.circuits import dead_centres as dead_centres
    from mbody.analysis.driven.dead_centres import driver_range as driver_range
    from mbody.analysis.driven.driven import kinematics as kinematics
    from mbody.analysis.driven.driven import kinetostatics as kinetostatics
    from mbody.analysis.driven.driven import statics as statics
    from mbody.analysis.driven.free_body import free_body as free_body
    from mbody.analysis.driven.free_body import member_forces as member_forces
    from mbody.analysis.driven.transmission import transmission as transmission
    from mbody.analysis.dynamics.simulate import simulate as simulate
    from mbody.analysis.equilibria.equilibrium import Equilibria as Equilibria
    from mbody.analysis.equilibria.equilibrium import equilibrium as equilibrium
    from mbody.analysis.freedom.mobility import Mobility as Mobility
    from mbody.analysis.freedom.mobility import mobility as mobility
    from mbody.analysis.inverse.conditions import Answer as Answer
    from mbody.analysis.linear.modes import Modes as Modes
    from mbody.analysis.linear.modes import modes as modes
    from mbody.derivatives.fit import fit as fit
    from mbody.derivatives.gradient import gradient as gradient
    from mbody.derivatives.tolerance_study import tolerances as tolerances
    from mbody.engines.crosscheck import crosscheck as crosscheck
    from mbody.errors import ModelError as ModelError
    from mbody.errors import SolveError as SolveError
    from mbody.files.model import from_toml as from_toml
    from mbody.files.model import load as load
    from mbody.files.model import save as save
    from mbody.files.model import to_toml as to_toml
    from mbody.files.saved import load_run as load_run
    from mbody.files.saved import save_run as save_run
    from mbody.inverse.solve_for import solve_for as solve_for
    from mbody.model.body import Body as Body
    from mbody.model.body import SlenderRod as SlenderRod
    from mbody.model.contact import Between as Between
    from mbody.model.contact import Contact as Contact
    from mbody.model.contact import Rope as Rope
    from mbody.model.coupling import AngleCoupling as AngleCoupling
    from mbody.model.coupling import CouplingTerm as CouplingTerm
    from mbody.model.coupling import LengthCoupling as LengthCoupling
    from mbody.model.driver import AngleDriver as AngleDriver
    from mbody.model.driver import CoordinateDriver as CoordinateDriver
    from mbody.model.driver import DistanceDriver as DistanceDriver
    from mbody.model.element import Marker as Marker
    from mbody.model.element import number_field as number_field
    from mbody.model.inputs import Controller as Controller
    from mbody.model.inputs import Input as Input
    from mbody.model.joints import BandBrake as BandBrake
    from mbody.model.joints import Belt as Belt
    from mbody.model.joints import CamFollower as CamFollower
    from mbody.model.joints import Clutch as Clutch
    from mbody.model.joints import CustomJoint as CustomJoint
    from mbody.model.joints import Distance as Distance
    from mbody.model.joints import Fixed as Fixed
    from mbody.model.joints import FrictionForce as FrictionForce
    from mbody.model.joints import Gear as Gear
    from mbody.model.joints import PinSlot as PinSlot
    from mbody.model.joints import Prismatic as Prismatic
    from mbody.model.joints import RackPinion as RackPinion
    from mbody.model.joints import Revolute as Revolute
    from mbody.model.joints import Rolling as Rolling
    from mbody.model.loads import Actuator as Actuator
    from mbody.model.loads import CentrifugalField as CentrifugalField
    from mbody.model.loads import CustomLoad as CustomLoad
    from mbody.model.loads import Damper as Damper
    from mbody.model.loads import DCMotor as DCMotor
    from mbody.model.loads import Force as Force
    from mbody.model.loads import Gravity as Gravity
    from mbody.model.loads import HydraulicCylinder as HydraulicCylinder
    from mbody.model.loads import InductionMotor as InductionMotor
    from mbody.model.loads import ReciprocatingCylinder as ReciprocatingCylinder
    from mbody.model.loads import Spring as Spring
    from mbody.model.loads import Torque as Torque
    from mbody.model.loads import TorsionDamper as TorsionDamper
    from mbody.model.loads import TorsionSpring as TorsionSpring
    from mbody.model.loads import Tyre as Tyre
    from mbody.model.mechanism import Mechanism as Mechanism
    from mbody.model.simulation import Event as Event
    from mbody.model.simulation import SimulationSettings as SimulationSettings
    from mbody.model.states import State as State
    from mbody.model.stop import Freewheel as Freewheel
    from mbody.model.stop import Stop as Stop
    from mbody.model.study import Instants as Instants
    from mbody.optimization.optimize import optimize as optimize
    from mbody.reports.mechanism_report import report as report
    from mbody.solution.doubts import Doubt as Doubt
    from mbody.solution.energy import Energy as Energy
    from mbody.solution.histories import BodyHistory as BodyHistory
    from mbody.solution.histories import EventRecord as EventRecord
    from mbody.solution.histories import Reaction as Reaction
    from mbody.solution.solution import Solution as Solution
    from mbody.stepping.simulator import Simulator as Simulator
    from mbody.stepping.simulators import Simulators as Simulators
    from mbody.sweeps.run import sweep as sweep
    from mbody.synthesis.request import synthesize as synthesize
    from mbody.system.assembler import assemble as assemble
    from mbody.system.system import System as System
    from mbody.topologies.many_linkages import linkages as linkages
    from mbody.views import animate as animate
    from mbody.views import draw as draw
    from mbody.views import plot as plot
    from mbody.views import view as view

registered.compiler, registered.builder = "mbody.compiler.install", "mbody.compiler.builder"

presentation.register(
    "summary",
    Answer="mbody.summaries.analyses:answers_summary",
    AssemblyModes="mbody.summaries.analyses:assemblies_summary",
    Circuits="mbody.summaries.analyses:circuits_summary",
    Crosscheck="mbody.summaries.analyses:crosscheck_summary",
    DeadCentres="mbody.summaries.analyses:dead_centres_summary",
    Equations="mbody.summaries.equations:summary",
    Equilibria="mbody.summaries.analyses:equilibrium_summary",
    EquilibriumCurve="mbody.summaries.analyses:curve_summary",
    Mobility="mbody.summaries.analyses:mobility_summary",
    Modes="mbody.summaries.analyses:modes_summary",
    Presented="mbody.summaries.declared_text:summary",
    Solution="mbody.summaries.instant:summary",
)
presentation.register(
    "data",
    Answer="mbody.files.results:answer_data",
    Presented="mbody.solution.declared_result:result_data",
    Solution="mbody.files.results:data",
)
presentation.register(
    "notebook",
    Mechanism="mbody.views.notebook_html:html_of",
    Presented="mbody.views.notebook_html:html_of",
    System="mbody.views.notebook_html:html_of",
)
presentation.register("certificate", Solution="mbody.solution.checks:certificate_of")
presentation.register("drawing", FreeBody="mbody.views.free_bodies:draw_free_body")
presentation.register("equations", Solution="mbody.summaries.equations:system_of_equations")
presentation.register("derivation", Solution="mbody.teaching.derivation:derivation_as")
presentation.register("columns", Solution="mbody.files.tables:columns")
presentation.register("table", Solution="mbody.solution.result_table:result_table")
presentation.register("dataframe", Solution="mbody.files.tables:dataframe")
presentation.register("at", Solution="mbody.analysis.dynamics.simulate:repeated_at")
presentation.register("efficiency", Solution="mbody.analysis.driven.efficiency:efficiency")
presentation.register("known_of", Solution="mbody.solution.known_forces:known_of")
presentation.register("move_forces", Solution="mbody.analysis.driven.open_forces:move_forces")
presentation.register("open_forces", Solution="mbody.analysis.driven.open_forces:open_forces")
presentation.register("open_forces_note", Solution="mbody.solution.known_forces:open_forces_note")
presentation.register("sensitivity", Solution="mbody.derivatives.gradient:sensitivity")
presentation.register("then", Solution="mbody.analysis.dynamics.simulate:then")
presentation.register("xarray", Solution="mbody.files.tables:dataset")
presentation.register("csv", Solution="mbody.files.tables:write_csv")
presentation.register("json", Solution="mbody.files.results:write_json")
presentation.register("xlsx", Solution="mbody.files.spreadsheet:write_xlsx")
presentation.register("npz", Solution="mbody.files.results:write_npz")

#: Folders that need no import of their own.
_FOLDERS = (
    "engineering", "envs", "gallery", "laws", "makers", "sweeps", "synthesis", "teaching",
    "testing",
)  # fmt: skip
#: Names by module. A name is loaded when it is first used, so that `import mbody` takes no time;
#: type checkers read the imports above.
_MODULES = {
    "analysis.assemblies.assembly_modes": "assembly_modes",
    "analysis.assemblies.circuits": "circuits dead_centres",
    "analysis.driven.dead_centres": "driver_range",
    "analysis.driven.free_body": "free_body member_forces",
    "analysis.driven.driven": "kinematics kinetostatics statics",
    "analysis.dynamics.simulate": "simulate",
    "analysis.equilibria.equilibrium": "Equilibria equilibrium",
    "analysis.freedom.mobility": "Mobility mobility",
    "analysis.inverse.conditions": "Answer",
    "inverse.solve_for": "solve_for",
    "analysis.linear.modes": "Modes modes",
    "derivatives.fit": "fit",
    "derivatives.gradient": "gradient",
    "derivatives.tolerance_study": "tolerances",
    "analysis.driven.transmission": "transmission",
    "engines.crosscheck": "crosscheck",
    "errors": "ModelError SolveError",
    "files.model": "from_toml load save to_toml",
    "files.saved": "load_run save_run",
    "model.body": "Body SlenderRod",
    "model.contact": "Between Contact Rope",
    "model.inputs": "Controller Input",
    "model.coupling": "AngleCoupling CouplingTerm LengthCoupling",
    "model.driver": "AngleDriver CoordinateDriver DistanceDriver",
    "model.element": "Marker number_field",
    "model.simulation": "Event SimulationSettings",
    "model.stop": "Freewheel Stop",
    "model.joints": "BandBrake Belt CamFollower Clutch CustomJoint Distance Fixed FrictionForce "
    "Gear PinSlot Prismatic RackPinion Revolute Rolling",
    "model.loads": "Actuator CentrifugalField CustomLoad DCMotor Damper Force Gravity "
    "HydraulicCylinder InductionMotor ReciprocatingCylinder Spring Torque TorsionDamper "
    "TorsionSpring Tyre",
    "model.mechanism": "Mechanism",
    "model.states": "State",
    "model.study": "Instants",
    "optimization.optimize": "optimize",
    "reports.mechanism_report": "report",
    "solution.doubts": "Doubt",
    "solution.energy": "Energy",
    "solution.histories": "EventRecord BodyHistory Reaction",
    "solution.solution": "Solution",
    "stepping.simulator": "Simulator",
    "stepping.simulators": "Simulators",
    "sweeps.run": "sweep",
    "synthesis.request": "synthesize",
    "topologies.many_linkages": "linkages",
    "system.assembler": "assemble",
    "system.system": "System",
    "views": "animate draw plot view",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}
__all__ = [*_MODULE_OF]

if not TYPE_CHECKING:  # a type checker would take every name for one of these

    def __getattr__(name: str) -> Any:
        if name in _FOLDERS:
            return importlib.import_module(f"mbody.{name}")
        if name in _MODULE_OF:
            value = getattr(importlib.import_module(f"mbody.{_MODULE_OF[name]}"), name)
            globals()[name] = value
            return value
        from mbody.core.former_names import former

        raise AttributeError(former(f"mbody.{name}") or f"module 'mbody' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)

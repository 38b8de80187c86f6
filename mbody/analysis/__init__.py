"""Analyses, one a file; each takes a Mechanism or a System and gives a Solution."""

from mbody.analysis.close_loops import close_loops
from mbody.analysis.equilibrium import Equilibria, Equilibrium, equilibrium
from mbody.analysis.equilibrium_curve import EquilibriumCurve, equilibrium_curve
from mbody.analysis.free_body import free_body, members
from mbody.analysis.kinematics import kinematics
from mbody.analysis.kinetostatics import kinetostatics
from mbody.analysis.linearize import Linearization, linearize
from mbody.analysis.mobility import mobility
from mbody.analysis.modes import Modes, modes
from mbody.analysis.reach import reach
from mbody.analysis.simulate import simulate
from mbody.analysis.solve_for import solve_for
from mbody.analysis.statics import statics

__all__ = [
    "Equilibria",
    "Equilibrium",
    "EquilibriumCurve",
    "Linearization",
    "Modes",
    "close_loops",
    "equilibrium",
    "equilibrium_curve",
    "free_body",
    "kinematics",
    "kinetostatics",
    "linearize",
    "members",
    "mobility",
    "modes",
    "reach",
    "simulate",
    "solve_for",
    "statics",
]

"""Engineering evaluations of a result, and analyses for special questions."""

from mbody.analysis.equilibria.equilibrium_curve import equilibrium_curve
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.linear.linearize import linearize
from mbody.engineering.fluctuation import Fluctuation, energy_fluctuation, fluctuation
from mbody.engineering.flywheel import flywheel
from mbody.engineering.indicator import Indicator, indicator
from mbody.engineering.shaking import ShakingForce, shaking_force
from mbody.solution.momentum import momentum

__all__ = [
    "Fluctuation",
    "Indicator",
    "ShakingForce",
    "close_loops",
    "energy_fluctuation",
    "equilibrium_curve",
    "fluctuation",
    "flywheel",
    "indicator",
    "linearize",
    "momentum",
    "shaking_force",
]

"""Engineering evaluations of a result: pure functions of a `Solution`, one subject per file."""

from mbody.engineering.fluctuation import Fluctuation, energy_fluctuation, fluctuation
from mbody.engineering.flywheel import flywheel
from mbody.engineering.indicator import Indicator, indicator
from mbody.engineering.shaking import ShakingForce, shaking_force

__all__ = [
    "Fluctuation",
    "Indicator",
    "ShakingForce",
    "energy_fluctuation",
    "fluctuation",
    "flywheel",
    "indicator",
    "shaking_force",
]

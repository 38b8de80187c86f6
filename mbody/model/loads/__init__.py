"""Loads, one subject a file: the frozen dataclass that a user writes and its compiled physics."""

from mbody.model.loads._base import Load
from mbody.model.loads.centrifugal_field import CentrifugalField
from mbody.model.loads.custom import CustomLoad
from mbody.model.loads.force import Force
from mbody.model.loads.gravity import Gravity
from mbody.model.loads.pressure import PistonPressure
from mbody.model.loads.reciprocating_cylinder import ReciprocatingCylinder
from mbody.model.loads.spring import Damper, Spring
from mbody.model.loads.torque import Torque
from mbody.model.loads.torsion import TorsionDamper, TorsionSpring

__all__ = [
    "CustomLoad",
    "Damper",
    "Force",
    "Gravity",
    "Load",
    "PistonPressure",
    "CentrifugalField",
    "Spring",
    "Torque",
    "TorsionDamper",
    "TorsionSpring",
    "ReciprocatingCylinder",
]

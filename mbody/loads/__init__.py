"""Loads, one subject a file: the frozen dataclass that a user writes and its compiled physics."""

from mbody.loads._base import Load
from mbody.loads.custom import CustomLoad
from mbody.loads.force import Force
from mbody.loads.gravity import Gravity
from mbody.loads.pressure import PistonPressure
from mbody.loads.rotating_field import RotatingField
from mbody.loads.spring import Damper, Spring
from mbody.loads.torque import Torque
from mbody.loads.torsion import TorsionDamper, TorsionSpring
from mbody.loads.valved_cylinder import ValvedCylinder

__all__ = [
    "CustomLoad",
    "Damper",
    "Force",
    "Gravity",
    "Load",
    "PistonPressure",
    "RotatingField",
    "Spring",
    "Torque",
    "TorsionDamper",
    "TorsionSpring",
    "ValvedCylinder",
]

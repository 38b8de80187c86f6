"""Loads, one subject a file: the frozen dataclass that a user writes and its compiled physics.

This is the one list of them, as `mbody.model.joints` is of joints: a new load is a file and a line
at its end.
"""

# ruff: noqa: I001
from mbody.model.loads._base import Load as Load
from mbody.model.loads.gravity import Gravity as Gravity
from mbody.model.loads.centrifugal_field import CentrifugalField as CentrifugalField
from mbody.model.loads.force import Force as Force
from mbody.model.loads.torque import Torque as Torque
from mbody.model.loads.spring import Damper as Damper, Spring as Spring
from mbody.model.loads.torsion import TorsionDamper as TorsionDamper, TorsionSpring as TorsionSpring
from mbody.model.loads.pressure import PistonPressure as PistonPressure
from mbody.model.loads.reciprocating_cylinder import ReciprocatingCylinder as ReciprocatingCylinder
from mbody.model.loads.dc_motor import DCMotor as DCMotor
from mbody.model.loads.induction_motor import InductionMotor as InductionMotor
from mbody.model.loads.actuator import Actuator as Actuator
from mbody.model.loads.hydraulic_cylinder import HydraulicCylinder as HydraulicCylinder
from mbody.model.loads.tyre import Tyre as Tyre
from mbody.model.loads.custom import CustomLoad as CustomLoad
from mbody.model.primitives import LOADS as LOADS

"""Joints, one type a file: the frozen dataclass that a user writes and its compiled physics.

This is the one list of them. A new joint is a file and a line at its end; model files, their
schema, the kernels and the messages follow. The order of the lines numbers the kinds of physics,
and primitives are eliminated in that order: to change it changes the last digits of results.
"""

# ruff: noqa: I001
from mbody.model.joints._base import Joint as Joint
from mbody.model.joints.revolute import Revolute as Revolute
from mbody.model.joints.prismatic import Prismatic as Prismatic
from mbody.model.joints import angle as angle
from mbody.model.joints.fixed import Fixed as Fixed
from mbody.model.joints.distance import Distance as Distance
from mbody.model.joints import coordinate as coordinate
from mbody.model.joints.pin_slot import PinSlot as PinSlot
from mbody.model.joints.gear import Gear as Gear
from mbody.model.joints.rack import RackPinion as RackPinion
from mbody.model.joints.rolling import Rolling as Rolling
from mbody.model.joints.cam import CamFollower as CamFollower
from mbody.model.joints.clutch import Clutch as Clutch
from mbody.model.joints.friction_force import FrictionForce as FrictionForce
from mbody.model.joints.custom import CustomJoint as CustomJoint
from mbody.model.joints import circles as circles
from mbody.model.joints.band_brake import BandBrake as BandBrake
from mbody.model.joints.belt import Belt as Belt
from mbody.model.joints import contour as contour
from mbody.model.primitives import CONSTRAINTS as CONSTRAINTS

"""Joints, one type a file: the frozen dataclass that a user writes and its compiled physics."""

from mbody.joints._base import Joint
from mbody.joints.cam import CamFollower
from mbody.joints.custom import CustomJoint
from mbody.joints.distance import Distance
from mbody.joints.fixed import Fixed
from mbody.joints.gear import Gear
from mbody.joints.pin_slot import PinSlot
from mbody.joints.prismatic import Prismatic
from mbody.joints.rack import RackPinion
from mbody.joints.revolute import Revolute
from mbody.joints.rolling import Rolling

__all__ = [
    "CamFollower",
    "CustomJoint",
    "Distance",
    "Fixed",
    "Gear",
    "Joint",
    "PinSlot",
    "Prismatic",
    "RackPinion",
    "Revolute",
    "Rolling",
]

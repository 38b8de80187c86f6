"""Joints, one type a file: the frozen dataclass that a user writes and its compiled physics."""

from mbody.model.joints._base import Joint
from mbody.model.joints.cam import CamFollower
from mbody.model.joints.custom import CustomJoint
from mbody.model.joints.distance import Distance
from mbody.model.joints.fixed import Fixed
from mbody.model.joints.gear import Gear
from mbody.model.joints.pin_slot import PinSlot
from mbody.model.joints.prismatic import Prismatic
from mbody.model.joints.rack import RackPinion
from mbody.model.joints.revolute import Revolute
from mbody.model.joints.rolling import Rolling

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

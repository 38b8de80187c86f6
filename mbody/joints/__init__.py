"""Joints, one type a file: the frozen dataclass that a user writes and its compiled physics."""

from mbody.joints._base import Joint
from mbody.joints.custom import CustomJoint
from mbody.joints.distance import Distance
from mbody.joints.fixed import Fixed
from mbody.joints.prismatic import Prismatic
from mbody.joints.revolute import Revolute

__all__ = ["CustomJoint", "Distance", "Fixed", "Joint", "Prismatic", "Revolute"]

"""MJCF: a mechanism as a model file of MuJoCo, which Pinocchio reads too."""

from mbody.engines.mjcf.writer import Exported, to_mjcf

__all__ = ["Exported", "to_mjcf"]

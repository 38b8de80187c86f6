"""A slow, obvious oracle: planar mechanisms in dense matrices, sharing no code of numbers."""

from mbody.engines.oracle.reference import Reference

__all__ = ["Reference"]

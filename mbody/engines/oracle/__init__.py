"""The oracle: a slow and simple reference with dense matrices, without numerical code of mbody."""

from mbody.engines.oracle.mechanics import Reference

__all__ = ["Reference"]

"""The numba half of `mbody.core`: decorators, bundles, lanes, callbacks."""

from mbody.compiler import callbacks as callbacks
from mbody.compiler import frame as frame
from mbody.compiler import lanes as lanes
from mbody.compiler.bundle_type import bundle_type
from mbody.compiler.jit import compilations, inline, kernel, njit

__all__ = ["bundle_type", "compilations", "inline", "kernel", "njit"]

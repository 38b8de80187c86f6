"""The numba half of `mbody.core`: decorators, bundles, lanes, callbacks."""

from mbody.compiler import numba_duals as numba_duals
from mbody.compiler import numba_lanes as numba_lanes
from mbody.compiler.jit import compilations as compilations
from mbody.compiler.jit import inline as inline
from mbody.compiler.jit import kernel as kernel
from mbody.compiler.jit import njit as njit
from mbody.compiler.numba_bundle import bundle_type as bundle_type

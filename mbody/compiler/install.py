"""The numba half of `mbody.core`: decorators, bundles, lanes, callbacks."""

from mbody.compiler import numba_duals as numba_duals
from mbody.compiler import numba_lanes as numba_lanes

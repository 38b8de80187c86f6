"""The kernels that images call: a fourth of all."""

from __future__ import annotations

from mbody.kernels.continuation import follow
from mbody.kernels.image_calls import begin_motion, close_at
from mbody.kernels.number_program import measures, set_numbers
from mbody.kernels.runge_kutta import runge_kutta

__all__ = ["IMAGE_KERNELS"]

IMAGE_KERNELS = (set_numbers, measures, close_at, follow, begin_motion, runge_kutta)

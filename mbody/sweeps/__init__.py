"""Sweeps: one analysis of many designs, with its samples, measures and results."""

from mbody.sweeps.run import Sweep, sweep
from mbody.sweeps.samples import (
    Normal,
    Samples,
    Steps,
    Triangular,
    Uniform,
    grid,
    latin_hypercube,
    monte_carlo,
    sobol,
    together,
)

__all__ = [
    "Normal", "Samples", "Steps", "Sweep", "Triangular", "Uniform", "grid", "latin_hypercube",
    "monte_carlo", "sobol", "sweep", "together",
]  # fmt: skip

"""Angle row: the angle of body j from body i follows a law (a driver) or stays (a weld)."""

from __future__ import annotations

from mbody.core.decorators import inline
from mbody.model.primitives import constraint_physics


@constraint_physics()
@inline
def angle(i, j, p, f):
    """Φ = θ_j − θ_i + β − f;  ν = ḟ;  γ = f̈."""
    blocks = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    return (j[2] - i[2] + p[0] - f[0], 0.0), blocks, (f[1], 0.0), (f[2], 0.0)

"""From which speed on a rotating field moves a mechanism out of a position that it leaves alone."""

from __future__ import annotations

import numpy as np

from mbody.analysis.equilibria.search import BALANCED, Rest
from mbody.analysis.position.tangent_space import Manifold

__all__ = ["lifting"]


def lifting(manifold: Manifold, rest: Rest) -> list[str]:
    """Sentences of fields that leave a stable position where it would be without them.

    There K(ω) = K₀ + ω² K₁; the position is left where the least root ω² of det K(ω) = 0 is passed.
    """
    system, found = manifold.system, []
    time = system.mechanism.units.time
    for load in system.mechanism.loads:
        if not load.quadratic_in:
            continue
        name = f"{load.name}.{load.quadratic_in}"
        speed = abs(float(system.values[name]))
        used = speed or 1.0
        still, turning = (
            manifold.other(system.with_values({name: value})) for value in (0.0, used)
        )
        one, other = still.place(rest.place.q), turning.place(rest.place.q)
        if one is None or other is None or len(one.motions) != len(rest.place.motions):
            continue
        top = max(rest.top, turning.largest(rest.place.q))
        if max(one.size, other.size) > 10.0 * BALANCED * top:
            continue
        before, field = still.stiffness(one), turning.stiffness(other)
        if np.linalg.matrix_rank(before) < len(before):
            continue  # the field alone keeps it there
        roots = np.linalg.eigvals(np.linalg.solve(before, before - field))
        real = roots.real[np.abs(roots.imag) <= 1e-6 * np.abs(roots).max(initial=0.0)]
        most = float(real.max(initial=0.0))
        if most <= 1e-12:
            continue
        lifts = used / np.sqrt(most)
        if lifts <= speed:
            continue
        found.append(
            f"at {_in_words(speed, time)} '{load.name}' does not move it: it hangs as without the "
            f"field, and lifts above {_in_words(lifts, time)}"
        )
    return found


def _in_words(speed: float, time: str) -> str:
    text = f"{speed:.6g} rad/{time}"
    return f"{text} ({speed * 30.0 / np.pi:.6g} rpm)" if time == "s" else text

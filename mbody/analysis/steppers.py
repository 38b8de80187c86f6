"""The methods of `simulate` by name: each a kernel with its tables and its own memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from mbody.core.flow import flow
from mbody.core.implicit_methods import radau_5, suzuki_4
from mbody.core.methods import Explicit, order_5, order_8
from mbody.core.pace import pace
from mbody.core.progress import DONE, MORE
from mbody.core.radau import radau

__all__ = ["Memory", "Stepper", "stepper"]

Array = np.ndarray

#: Steps of one explicit run that stiffness may cost.
PATIENT = 300_000
#: Spectral radius of generalised-α at infinite frequency.
RADIUS = 0.9
#: Coordinates of which an implicit method takes dense matrices.
DENSE = 1500


@dataclass(eq=False)
class Memory:
    """All that the steps of a motion work on; see the kernels."""

    layout: Any
    work: Any
    soft: float
    regular: int
    passes: int
    rtol: float
    atol: float
    y: Array
    K: Array
    P: Array
    F: Array
    G: Array
    state: Array
    scale: Array = field(default_factory=lambda: np.empty(0))


class Stepper(Protocol):
    """One method.

    Attributes
    ----------
    even : bool
        Whether its steps are of one length.
    slopes, polynomial : int
        Rows of `Memory.K` and of `Memory.F` that it needs.
    own : tuple of arrays
        What it carries on from step to step beyond `Memory`.
    """

    even: bool
    slopes: int
    polynomial: int
    own: tuple[Array, ...]

    def slack(self, until: float) -> float:
        """How near to the last time a step is stretched to it."""

    def steps(
        self, memory: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> int:
        """At most so many steps towards `until`; a code of `mbody.core.progress`."""


class ExplicitSteps:
    """Runge–Kutta steps of adapted length."""

    even = False
    own: tuple[Array, ...] = ()

    def __init__(self, method: Explicit, coordinates: int) -> None:
        self.method = method
        self.slopes, self.polynomial = len(method.A), 3 + len(method.D)
        self.room = np.zeros((5, 2 * coordinates))

    def slack(self, until: float) -> float:
        """Rounding."""
        return 1e-14 * abs(until)

    def steps(
        self, memory: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> int:
        """See `Stepper`."""
        m = memory
        return int(
            flow(
                *(m.layout, m.work, self.method, m.soft, m.regular, m.passes, m.rtol, m.atol),
                *(m.scale, until, count, PATIENT, m.y, m.K, m.P, self.room, m.F, m.G),
                *(times, output, gained, m.state),
            )
        )


class RadauSteps:
    """Implicit steps of adapted length."""

    even, slopes, polynomial = False, 4, 3

    def __init__(self, coordinates: int) -> None:
        n = coordinates
        self.past = np.zeros((4, 2 * n))
        self.room, self.Z, self.X = (np.zeros((rows, 2 * n)) for rows in (4, 3, 3))
        self.complex = np.zeros((3, n), dtype=complex)
        self.Jq, self.Jv = np.zeros((n, n)), np.zeros((n, n))
        self.own: tuple[Array, ...] = self.past, self.Jq, self.Jv
        self.real, self.turned = np.zeros((n, n)), np.zeros((n, n), dtype=complex)
        self.pivots = np.zeros((2, n), dtype=np.int64)

    def slack(self, until: float) -> float:
        """Rounding."""
        return 1e-14 * abs(until)

    def steps(
        self, memory: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> int:
        """See `Stepper`."""
        m = memory
        return int(
            radau(
                *(m.layout, m.work, radau_5(), m.soft, m.regular, m.passes, m.rtol, m.atol),
                *(m.scale, until, count, m.y, m.K, m.P, self.room, self.Z, self.X, self.complex),
                *(
                    self.past,
                    self.Jq,
                    self.Jv,
                    self.real,
                    self.pivots[0],
                    self.turned,
                    self.pivots[1],
                ),
                *(m.F, m.G, times, output, gained, m.state),
            )
        )


class EvenSteps:
    """Steps of one length: RATTLE in parts, or generalised-α without."""

    even, slopes, polynomial = True, 4, 5

    def __init__(self, coordinates: int, nodes: int, blocks: int, step: float, parts: Any) -> None:
        self.length, self.parts = step, np.asarray(parts, dtype=float)
        n = coordinates if not len(self.parts) else 1
        self.room = np.zeros((3, 2 * coordinates))
        self.blocks, self.pivots = np.zeros(blocks), np.zeros(n, dtype=np.int64)
        self.S = np.zeros((n, n))
        self.Jq, self.Jv = np.zeros((n, n)), np.zeros((n, n))
        # the acceleration of the algorithm, not known before the first slope, and multipliers
        self.hat, self.lam = np.full(coordinates, np.nan), np.zeros(2 * nodes)
        self.own: tuple[Array, ...] = self.hat, self.lam, self.Jq, self.Jv

    def slack(self, until: float) -> float:
        """A last step that were as short would be lost in rounding."""
        return 1e-9 * self.length

    def steps(
        self, memory: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> int:
        """See `Stepper`."""
        m, n = memory, len(memory.y) // 2
        if np.isnan(self.hat).any():
            self.hat[:] = m.K[0, n:]
        code = int(
            pace(
                *(m.layout, m.work, self.parts, RADIUS, m.soft, m.passes, m.scale, until, count),
                *(self.length, m.y, m.K, m.P, self.room, self.hat, self.blocks),
                *(
                    self.lam,
                    self.Jq,
                    self.Jv,
                    self.S,
                    self.pivots,
                    m.F,
                    m.G,
                    times,
                    output,
                    gained,
                    m.state,
                ),
            )
        )
        return DONE if code == MORE and m.state[0] >= until else code


def stepper(method: str, layout: Any, work: Any, step: float) -> Stepper:
    """The method of that name (`mbody.simulation.METHODS`); `step` is the length of even steps."""
    coordinates = 3 * layout.bodies
    if method in ("dop853", "dopri5"):
        return ExplicitSteps(order_8() if method == "dop853" else order_5(), coordinates)
    if method == "radau5":
        return RadauSteps(coordinates)
    parts = {"generalized-alpha": (), "rattle": (1.0,), "rattle4": suzuki_4()}[method]
    return EvenSteps(coordinates, layout.nodes, len(work.block), step, parts)

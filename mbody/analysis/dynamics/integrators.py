"""The methods of `simulate` by name: each a kernel with its tables and its own memory."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from mbody.errors import ModelError
from mbody.kernels.dense_output import FIRST, SECOND
from mbody.kernels.fixed_step import pace
from mbody.kernels.implicit_tableaus import radau_5, suzuki_4
from mbody.kernels.radau import radau
from mbody.kernels.runge_kutta import flow
from mbody.kernels.step_state import (
    DOUBTED,
    FREEST,
    FRESH,
    LOST,
    MORE,
    NEAR,
    NEXT,
    PASSAGE,
    PASSING,
    PIVOT,
    SMALL,
    STEPS,
    TIME,
    WEAK,
)
from mbody.kernels.tableaus import Explicit, order_5, order_8

__all__ = ["Memory", "Stepper", "stepper"]

Array = np.ndarray

#: The weakest pivot, as a part of what it was, from which on a step that fails may be one into a
#: singular position.
NEARLY = 0.01
#: Steps of one explicit run that stiffness may cost.
PATIENT = 300_000
#: Spectral radius of generalised-α at infinite frequency.
RADIUS = 0.9
#: Parts of a step of one length at which it is sampled: its ends, and the nodes of its polynomial.
SAMPLED = np.array([0.0, FIRST, SECOND, 1.0])
#: Bodies of which an implicit method takes dense matrices, at most.
DENSE = 300


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
        """At most so many steps towards `until`; a code of `mbody.kernels.step_state`."""


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


class _WithPassages:
    """Steps of a kernel, and explicit ones near singular positions, where no other method has a
    say.
    """

    def __init__(self, coordinates: int) -> None:
        self.explicit = ExplicitSteps(order_8(), coordinates)
        self.inner: Memory | None = None

    def kernel(
        self, m: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> Any:
        """Steps until a singular position, at most."""
        raise NotImplementedError

    def forget(self, m: Memory) -> None:
        """After explicit steps: what was carried on is of before them."""
        raise NotImplementedError

    def steps(
        self, memory: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> int:
        """See `Stepper`."""
        state, code = memory.state, MORE
        while count > 0 and code == MORE:
            done = state[STEPS]
            near = state[NEAR] or state[TIME] <= state[PASSING] or state[TIME] < state[DOUBTED]
            if state[PIVOT] >= WEAK * state[FREEST] and not near:
                code = int(self.kernel(memory, until, count, times, output, gained))
                nearly = state[PIVOT] < NEARLY * state[FREEST]
                if code != PASSAGE and not (nearly and code in (SMALL, LOST)):
                    return code
            code = self._explicit(memory, until, times, output, gained)
            count -= 1 + int(state[STEPS] - done)
        return code

    def _explicit(
        self, memory: Memory, until: float, times: Array, output: Array, gained: Array
    ) -> int:
        """One explicit step, or one that was refused."""
        if self.inner is None:
            rows, polynomial = self.explicit.slopes, self.explicit.polynomial
            width, causes = len(memory.y), memory.P.shape[1]
            slopes, powers = np.zeros((rows, width)), np.zeros((rows, causes))
            F, G = np.zeros((polynomial, width)), np.zeros((polynomial, causes))
            self.inner = replace(memory, K=slopes, P=powers, F=F, G=G)
        m, t = self.inner, memory.state[TIME]
        m.K[0], m.P[0] = memory.K[0], memory.P[0]
        code = self.explicit.steps(m, until, 1, times, output, gained)
        if m.state[TIME] > t:
            memory.K[0], memory.P[0] = m.K[0], m.P[0]
            self.forget(memory)
        return code


class RadauSteps(_WithPassages):
    """Implicit steps of adapted length."""

    even, slopes, polynomial = False, 4, 3

    def __init__(self, coordinates: int) -> None:
        super().__init__(coordinates)
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

    def kernel(
        self, m: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> Any:
        """See `mbody.kernels.radau`."""
        real, turned = self.pivots
        return radau(
            *(m.layout, m.work, radau_5(), m.soft, m.regular, m.passes, m.rtol, m.atol),
            *(m.scale, until, count, m.y, m.K, m.P, self.room, self.Z, self.X, self.complex),
            *(self.past, self.Jq, self.Jv, self.real, real, self.turned, turned),
            *(m.F, m.G, times, output, gained, m.state),
        )

    def forget(self, m: Memory) -> None:
        """No polynomial to begin from, no tangents."""
        self.past[3, 0] = m.state[FRESH] = 0.0


class EvenSteps(_WithPassages):
    """Steps of one length: RATTLE in parts, or generalised-α without."""

    even, slopes, polynomial = True, 4, 5

    def __init__(self, coordinates: int, nodes: int, blocks: int, step: float, parts: Any) -> None:
        super().__init__(coordinates)
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

    def kernel(
        self, m: Memory, until: float, count: int, times: Array, output: Array, gained: Array
    ) -> Any:
        """See `mbody.kernels.fixed_step`."""
        if np.isnan(self.hat).any():
            self.hat[:] = m.K[0, len(self.hat) :]
        tangents = self.Jq, self.Jv
        return pace(
            *(
                m.layout,
                m.work,
                self.parts,
                SAMPLED,
                RADIUS,
                m.soft,
                m.passes,
                m.scale,
                until,
                count,
            ),
            *(self.length, m.y, m.K, m.P, self.room, self.hat, self.blocks, self.lam),
            *(*tangents, self.S, self.pivots, m.F, m.G, times, output, gained, m.state),
        )

    def forget(self, m: Memory) -> None:
        """The acceleration of the algorithm begins anew, and so does the length."""
        self.hat[:] = m.K[0, len(self.hat) :]
        m.state[FRESH] = 0.0
        if m.state[PIVOT] >= WEAK * m.state[FREEST] and not m.state[NEAR]:
            m.state[NEXT] = self.length


def stepper(method: str, layout: Any, work: Any, step: float) -> Stepper:
    """The method of that name (one of `METHODS`); `step` is the length of even steps."""
    coordinates = 3 * layout.bodies
    if method in ("radau5", "generalized-alpha") and layout.bodies > DENSE:
        raise ModelError(
            f"the method '{method}' takes dense matrices, of at most {DENSE} bodies, not of "
            f"{layout.bodies}: take dop853, or rattle4 for long runs"
        )
    if method in ("dop853", "dopri5"):
        return ExplicitSteps(order_8() if method == "dop853" else order_5(), coordinates)
    if method == "radau5":
        return RadauSteps(coordinates)
    parts = {"generalized-alpha": (), "rattle": (1.0,), "rattle4": suzuki_4()}[method]
    return EvenSteps(coordinates, layout.nodes, len(work.block), step, parts)

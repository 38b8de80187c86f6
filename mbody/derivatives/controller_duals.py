"""Functions of controllers with derivatives, by the samples of one motion.

A function of the user's is called with dual numbers, so that what it computes, and what it
remembers, has exact derivatives. Where it takes plain numbers only, as `math.sin` and NumPy's
arrays of floats do, copies of it follow the same samples for numbers a little greater and smaller,
each with a memory of its own: differences of what these return.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mbody.core.dual_number import DualNumber, value
from mbody.model.controller import Controller

__all__ = ["ControllerDuals"]

Array = np.ndarray

#: By what part of its size a number is changed for differences: errors of the order of its square.
PART = 1e-5


class ControllerDuals:
    """One controller along a motion.

    Parameters
    ----------
    controller : Controller
    function : callable
        As it is when the motion begins; copies of it are called.
    sizes : array (numbers,)
        By how much a number may change.
    """

    def __init__(self, controller: Controller, function: Callable[..., Any], sizes: Array) -> None:
        self.controller, self.function = controller, function
        self.steps = PART * np.where((sizes > 0.0) & np.isfinite(sizes), sizes, 1.0)
        self.exact: Any = copy.deepcopy(function)
        #: Of the differences: the function itself, then for each number one above and one below.
        self.copies: list[Callable[..., Any]] = []
        self.samples: list[tuple[DualNumber, list[DualNumber]]] = []

    @property
    def differenced(self) -> bool:
        """Whether differences are taken."""
        return bool(self.copies)

    def __call__(self, t: DualNumber, reads: Sequence[DualNumber]) -> dict[str, DualNumber]:
        """What it sets at the next sample."""
        self.samples.append((t, list(reads)))
        if self.exact is not None:
            time = t if t.tangents.any() else float(t.value)
            try:
                # where it asks for a value that is dual it may fail in any way
                return self._dual(_named(self.controller, self.exact(time, *reads)))
            except Exception:
                self.exact = None
        if not self.copies:
            count = 1 + 2 * len(self.steps)
            self.copies = [copy.deepcopy(self.function) for _ in range(count)]
            for sample in self.samples[:-1]:
                self._differenced(*sample)
        return self._differenced(t, reads)

    def _dual(self, found: Mapping[str, Any]) -> dict[str, DualNumber]:
        none = np.zeros(len(self.steps))
        return {
            name: DualNumber(float(value(one)), getattr(one, "tangents", none))
            for name, one in found.items()
        }

    def _differenced(self, t: DualNumber, reads: Sequence[DualNumber]) -> dict[str, DualNumber]:
        """Central differences of the copies, which go on with this sample."""
        every = [t, *reads]
        values = np.array([float(one.value) for one in every])
        rows = np.array([one.tangents for one in every])
        plain, *others = self.copies
        found = self._plain(plain, values)
        tangents = {name: np.zeros(len(self.steps)) for name in found}
        for k, step in enumerate(self.steps):
            above = self._plain(others[2 * k], values + step * rows[:, k])
            below = self._plain(others[2 * k + 1], values - step * rows[:, k])
            for name, row in tangents.items():
                row[k] = (above.get(name, np.nan) - below.get(name, np.nan)) / (2.0 * step)
        return {name: DualNumber(one, tangents[name]) for name, one in found.items()}

    def _plain(self, function: Callable[..., Any], given: Array) -> dict[str, float]:
        found = _named(self.controller, function(*given.tolist()))
        return {name: float(one) for name, one in found.items()}


def _named(controller: Controller, found: Any) -> dict[str, Any]:
    """What a function returned, by the names of the inputs; a motion has checked it before."""
    if isinstance(found, Mapping):
        return dict(found)
    row = np.asarray(found, dtype=object).reshape(-1)
    return dict(zip(controller.sets, row, strict=True))

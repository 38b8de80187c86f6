"""What controllers read of a motion: measures that are compiled when they are first read."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbody.kernels.step_state import TIME
from mbody.model.controller import Controller
from mbody.solution.compiled_measures import Present, Read
from mbody.solution.histories import Record
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["ControllerReadings"]

Array = np.ndarray


class ControllerReadings:
    """Readings of the present instant of a motion.

    Parameters
    ----------
    system : System
    y, state : arrays
        Positions and rates, and the slots of the steps, as the integrator changes them in place.
    page : callable
        What is kept of the present instant (rows, 1).
    regularization : float
        Of redundant rows.
    """

    def __init__(
        self,
        system: System,
        y: Array,
        state: Array,
        page: Callable[[], Array],
        regularization: float,
    ) -> None:
        self.system, self.state, self.page = system, state, page
        self.regularization = regularization
        slots = memoryview(state.data)
        self.present = Present(
            system, memoryview(y.data), slots, lambda: memoryview(page().reshape(-1).data)
        )
        self._found: dict[str, list[Read]] = {}

    def of(self, controller: Controller) -> list[float]:
        """What a controller reads now."""
        found = self._found.get(controller.name)
        if found is None:
            measure = self.present.measure
            found = [measure(text, self._instant) for text in controller.reads]
            self._found[controller.name] = found
        return [read() for read in found]

    def _instant(self) -> Solution:
        """The present instant as a result."""
        record = Record([self.page()[None].copy()], 1, batch=False)
        t, regular = np.array([self.state[TIME]]), self.regularization
        return Solution(self.system, "simulate", t, record, None, regularization=regular)

"""Measured quantities of the present instant as Python functions, made once for each.

A quantity is computed once by mbody's own functions from an instant whose numbers are recorded
(`mbody.solution.tracing`); the operations that this takes become the text of a function. It reads
positions and rates where the integrator has them; accelerations and forces make it evaluate the
instant.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbody.kernels.number_program import NumberProgram
from mbody.laws.postfix import OPERATIONS
from mbody.model.study import Measure, measure_named
from mbody.solution.measures import check_measure, valued
from mbody.solution.solution import Solution
from mbody.solution.traced_instant import TracedInstant, TracedRecord
from mbody.solution.tracing import Recording, Rule
from mbody.system.system import System

__all__ = ["Present", "Read"]

#: What reads one number of the present instant.
Read = Callable[[], float]

#: Operations as Python writes them; all else is a function of its arguments.
WRITTEN = {"negative": "-{0}", "+": "{0} + {1}", "-": "{0} - {1}", "*": "{0} * {1}"}
WRITTEN |= {"/": "{0} / {1}", "^": "pow({0}, {1})"}
#: The functions, as they stop where a number is none, and as they go on with what is no number.
NAMES = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "atan2", "hypot", "pow")
STRICT: dict[str, Any] = {name: getattr(math, name) for name in NAMES}
STRICT |= {"abs": abs, "min": min, "max": max, "number": float}
NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "pow": "power"}
LENIENT = {name: getattr(np, NUMPY.get(name, name)) for name in NAMES}
LENIENT |= {"abs": np.abs, "min": np.minimum, "max": np.maximum, "number": np.float64}


class Present:
    """The present instant of a motion, for functions that read it.

    Parameters
    ----------
    system : System
    y, slots : memoryviews (2·coordinates,), (slots,)
        Positions and rates, and the state of the steps (its first number is the time), as the
        integrator changes them in place.
    page : callable
        What is kept of the present instant (rows, 1) (see `mbody.kernels.output`), always in the
        same place.
    """

    def __init__(
        self,
        system: System,
        y: memoryview,
        slots: memoryview,
        page: Callable[[], memoryview],
    ) -> None:
        self.system, self.page = system, page
        self.y, self.slots = y, slots
        self.rows = system.page_rows
        self.recording = Recording(
            {f"row {n}": Rule(0.0) for n in range(self.rows)} | {"time": Rule(0.0)}
        )
        traced: list[Any] = list(self.recording.inputs.values())
        record: Any = TracedRecord(traced[:-1])
        self.instant = TracedInstant(system, "simulate", traced[-1], record, None)

    def measure(self, of: str | Measure, solution: Callable[[], Solution]) -> Read:
        """A measured quantity; one that no list of operations gives is read from `solution`, the
        present instant as a result.

        Raises
        ------
        ModelError
            For a name that the mechanism has not, or units that do not fit.
        """
        measure = measure_named(self.system.mechanism.measures, of)
        check_measure(self.system.mechanism, measure)
        try:
            return self.read(valued(self.instant, measure)[0])
        except Exception:  # whatever Python does with a number that is none
            return lambda: float(solution().measure(measure)[-1])

    def read(self, value: Any) -> Read:
        """What a number of the traced instant is at present.

        Raises
        ------
        Untraceable
            Where no list of operations gives it.
        """
        if isinstance(value, np.ndarray):
            value = value[()]
        text, needs_page = self._text(self.recording.program([value]))
        strict, lenient = (_function(text, scope) for scope in (STRICT, LENIENT))
        y, slots, page = self.y, self.slots, self.page

        def evaluated() -> float:
            kept = page() if needs_page else None
            try:
                found: float = strict(y, slots, kept)
            except (ValueError, ArithmeticError):
                with np.errstate(all="ignore"):
                    found = float(lenient(y, slots, kept))
            return found

        return evaluated

    def _text(self, program: NumberProgram) -> tuple[str, bool]:
        """The function as text, and whether it reads the page."""
        inputs, few = self.rows + 1, 2 * self.system.coordinates
        constants = len(program.slots) - len(program.operations)
        used = {int(n) for n in program.operations[:, 1:3].ravel()} | {int(program.targets[0])}
        lines = ["def read(y, slots, page):"]
        needs_page = False
        for n in sorted(used):
            if n < inputs:
                source = f"y[{n}]" if n < few else f"page[{n}]"
                needs_page |= few <= n < self.rows
                source = "slots[0]" if n == self.rows else source
                lines.append(f"    s{n} = number({source})")
            elif n < constants:
                lines.append(f"    s{n} = number({float(program.slots[n])!r})")
        for code, a, b, place in program.operations.tolist():
            name = OPERATIONS[code]
            binary = code > OPERATIONS.index("log")
            form = WRITTEN.get(name, f"{name}({{0}}, {{1}})" if binary else f"{name}({{0}})")
            lines.append(f"    s{place} = {form.format(f's{a}', f's{b}')}")
        lines.append(f"    return s{int(program.targets[0])}")
        return "\n".join(lines), needs_page


def _function(text: str, scope: dict[str, Any]) -> Callable[..., Any]:
    own = dict(scope, inf=math.inf, nan=math.nan)
    exec(text, own)
    found: Callable[..., Any] = own["read"]
    return found

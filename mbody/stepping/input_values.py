"""Inputs of a mechanism: named numbers that may change between steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import unknown_name


def jumping(name: str, driver: str) -> ModelError:
    """Why an input that a driver follows cannot be set."""
    return ModelError(
        f"the input '{name}' cannot be set: the position or the rate of driver '{driver}' follows "
        "it and would jump, which takes an infinite effort. Give it a smooth history, or lead it "
        'through states: State("speed", rate="acceleration") and State("angle", '
        'rate="speed"), of which the driver follows the angle',
        name,
    )


class Inputs(MutableMapping[str, float]):
    """The present values of the inputs by name, in the units of the mechanism.

    `values`: Name and first value of each input that can be set.
    `changed`: Called with the number and the value of one that has changed.
    `others`: Of each input that cannot be set what sets it, and a function that gives its value.
    `number`: The number that a text or another value means for an input, by its name.
    `followed`: Inputs that the position or the rate of a driver follows, with its name: they keep
      their value.

    Examples
    --------
    >>> inputs = Inputs({"u": 0.0}, print)
    >>> inputs["u"] = 2.0
    0 2.0
    """

    def __init__(
        self,
        values: Mapping[str, float],
        on_change: Callable[[int, float], Any],
        others: Mapping[str, tuple[str, Callable[[], float]]] | None = None,
        number: Callable[[str, Any], float] = lambda name, value: float(value),
        drivers: Mapping[str, str] | None = None,
    ) -> None:
        self._drivers = dict(drivers or {})
        self.names = tuple(values)
        self._index = {name: n for n, name in enumerate(self.names)}
        self._values = [float(value) for value in values.values()]
        self._on_change, self._others, self._number = on_change, dict(others or {}), number

    def __getitem__(self, name: str) -> float:
        place = self._index.get(name)
        if place is not None:
            return self._values[place]
        if name in self._others:
            return float(self._others[name][1]())
        raise self._unknown(name)

    def __setitem__(self, name: str, value: Any) -> None:
        place = self._index.get(name)
        if place is None:
            if name in self._others:
                raise ModelError(f"the input '{name}' {self._others[name][0]}", name)
            raise self._unknown(name)
        if type(value) is not float:
            value = self._number(name, value)
        if not -math.inf < value < math.inf:
            raise ModelError(f"the input '{name}' is {value}: give a finite number", name)
        if value != self._values[place]:
            if name in self._drivers:
                raise jumping(name, self._drivers[name])
            self._values[place] = value
            self._on_change(place, value)

    def __delitem__(self, name: str) -> None:
        if name not in self:
            raise self._unknown(name)
        raise ModelError(f"the input '{name}' belongs to the mechanism: set it to a number", name)

    def __iter__(self) -> Iterator[str]:
        return iter((*self.names, *self._others))

    def __len__(self) -> int:
        return len(self.names) + len(self._others)

    def set_all(self, values: np.ndarray) -> None:
        """All that can be set (inputs,)."""
        for name, value in zip(self.names, values.tolist(), strict=True):
            self[name] = value

    def array(self, changes: Any = None) -> np.ndarray:
        """All that can be set (inputs,), some of them changed: an array of all, or values by name.

        Raises ModelError.
        """
        found = np.array(self._values, dtype=float)
        if changes is None:
            return found
        if isinstance(changes, Mapping):
            for name, value in changes.items():
                if name not in self._index:
                    raise self._unknown(name)
                found[self._index[name]] = self._number(name, value)
            return found
        try:
            row = np.asarray(changes, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            raise ModelError(
                f"u must be numbers, or a dict by name, not {brief(changes)}"
            ) from None
        if row.shape != found.shape:
            raise ModelError(
                f"u has {row.size} numbers, the mechanism {found.size} inputs that can be set: "
                "give one each, or a dict by name"
            )
        return row

    def _unknown(self, name: Any) -> ModelError:
        return unknown_name("input", name, self)

    def __repr__(self) -> str:
        return f"Inputs({dict(self)})"

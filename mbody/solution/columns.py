"""Columns of results: a history with its name, unit and doubts; a table of several."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.quantities.units import Dimension, name_of
from mbody.solution.doubts import Doubt

Array = np.ndarray


class ResultColumn:
    """One history of a result.

    `owner`, `key`: The element or point, and what of it: "crank", "omega"; of a measure, an input
      and a state the key is empty.
    `role`: What the owner is: "time", "body", "point", "joint", "contact", "coupling", "driver",
      "load", "input", "state", "quantity", "measure".
    `dimension`, `unit`: Of the values; the unit of a plain number is empty.
    `doubts`: Of the result, those that name the owner or no element.
    """

    def __init__(
        self,
        owner: str,
        key: str,
        role: str,
        dimension: Dimension,
        unit: str,
        read: Callable[[], Any],
        unique: Callable[[], bool | None] = lambda: True,
        doubts: tuple[Doubt, ...] = (),
    ) -> None:
        self.owner, self.key, self.role, self.unit = owner, key, role, unit
        self.dimension, self.doubts = dimension, doubts
        self._read, self._unique = read, unique

    @property
    def name(self) -> str:
        """By which measures know it: "crank.omega"."""
        return f"{self.owner}.{self.key}" if self.key else self.owner

    @property
    def quantity(self) -> str:
        """Name of the dimension, empty where it has none."""
        return name_of(self.dimension)

    @property
    def heading(self) -> str:
        """Name and unit: "crank.omega [rad/s]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @functools.cached_property
    def unique(self) -> bool | None:
        """Whether a force is determined; None where it was not examined."""
        return self._unique()

    @functools.cached_property
    def values(self) -> Array:
        """(instants,), of a batch (designs, instants), in `unit`."""
        return np.asarray(self._read(), dtype=float)

    def __repr__(self) -> str:
        return f"ResultColumn({self.heading!r}, {self.role})"


class ResultTable(tuple[ResultColumn, ...]):
    """Columns of a result; one by its name as well.

    >>> import mbody
    >>> run = mbody.kinetostatics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0))
    >>> run.table()["crank.omega"].values
    array([10.])
    """

    def __getitem__(self, name: Any) -> Any:
        if not isinstance(name, str):
            return super().__getitem__(name)
        if name in self._by_name:
            return self._by_name[name]
        owner = name.rpartition(".")[0]
        own = [one.name for one in self if one.owner == owner] or self.names
        raise ModelError(f"there is no column '{name}' (there are: {listed(own, 12)})")

    def get(self, name: str) -> ResultColumn | None:
        """The column of that name; None where there is none."""
        return self._by_name.get(name)

    @functools.cached_property
    def _by_name(self) -> dict[str, ResultColumn]:
        return {one.name: one for one in self}

    @property
    def names(self) -> list[str]:
        """Of all columns."""
        return [one.name for one in self]

    def of(self, owners: Iterable[str], key: str) -> list[ResultColumn]:
        """The same quantity of several elements."""
        return [self[f"{owner}.{key}"] for owner in owners]

    def by_owner(self, role: str, *keys: str) -> dict[str, dict[str, ResultColumn]]:
        """The columns of a role by owner and key, or some of them."""
        found = dict[str, dict[str, ResultColumn]]()
        for one in self:
            if one.role == role and (not keys or one.key in keys):
                found.setdefault(one.owner, {})[one.key] = one
        return found

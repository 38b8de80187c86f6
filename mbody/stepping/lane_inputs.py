"""Inputs of many motions: arrays (n,) by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping
from typing import Any

import numpy as np

from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.stepping.input_values import jumping
from mbody.stepping.lane_motion import LaneMotion

__all__ = ["LaneInputs"]

Array = np.ndarray


class LaneInputs(MutableMapping[str, Array]):
    """The present values of the inputs by name, arrays (n,) in the units of the mechanism.

    What is set is a number for all, or an array (n,); it acts from then on. Arrays that are read
    are copies: set them again.

    Parameters
    ----------
    names : tuple of str
        The inputs that can be set.
    lanes : LaneMotion
    others : mapping
        Of each input that cannot be set what sets it.
    number : callable
        The number that a text means for an input, by its name.
    changed : callable
        Called when something has changed.
    followed : mapping, optional
        Inputs that drivers follow, with the driver of each: they keep their values.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        lanes: LaneMotion,
        others: dict[str, str],
        number: Callable[[str, Any], float],
        changed: Callable[[], None],
        followed: Mapping[str, str] | None = None,
    ) -> None:
        self._followed = dict(followed or {})
        self.names, self._lanes, self._others = names, lanes, others
        self._number, self._changed = number, changed

    def __getitem__(self, name: str) -> Array:
        return self._lanes.row(self._lanes.many.inputs, self._place(name))

    def __setitem__(self, name: str, value: Any) -> None:
        place, lanes = self._place(name), self._lanes
        values = self._values(name, value)
        of = lanes.many.inputs
        filled = np.full(lanes.groups * of.shape[2], values[-1])
        filled[: lanes.count] = values
        given = filled.reshape(lanes.groups, -1)
        different = given != of[:, place, :]
        if different.any():
            if name in self._followed:
                raise jumping(name, self._followed[name])
            of[:, place, :] = given
            lanes.many.stale[different] = 1.0
            self._changed()

    def _place(self, name: str) -> int:
        if name in self.names:
            return self.names.index(name)
        if name in self._others:
            raise ModelError(f"the input '{name}' {self._others[name]}", name)
        known = listed(self) or "none"
        raise ModelError(f"there is no input {brief(name)} (there are: {known})", str(name))

    def _values(self, name: str, value: Any) -> Array:
        """A number for every state."""
        n = self._lanes.count
        if isinstance(value, str):
            value = self._number(name, value)
        try:
            values = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(
                f"the input '{name}' takes a number or an array of {n}, not {brief(value)}", name
            ) from None
        if values.shape not in ((), (1,), (n,)):
            raise ModelError(
                f"the input '{name}' has an array of shape {values.shape}: give one number, or one "
                f"for each of the {n} motions",
                name,
            )
        if not np.isfinite(values).all():
            first = int(np.flatnonzero(~np.isfinite(np.atleast_1d(values)))[0])
            raise ModelError(
                f"the input '{name}' is {np.atleast_1d(values)[first]} in motion {first}: give "
                "finite numbers",
                name,
            )
        return np.broadcast_to(values.reshape(-1), (n,))

    def __delitem__(self, name: str) -> None:
        self._place(name)
        raise ModelError(f"the input '{name}' belongs to the mechanism: set it to a number", name)

    def __iter__(self) -> Iterator[str]:
        return iter((*self.names, *self._others))

    def __len__(self) -> int:
        return len(self.names) + len(self._others)

    def __repr__(self) -> str:
        return f"Inputs of {self._lanes.count} motions: {', '.join(self.names) or 'none'}"

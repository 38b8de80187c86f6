"""The result of a sweep: columns by name, with named axes."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbody.core.presentation import present
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.model.numbers import dimension_named
from mbody.quantities.evaluate import degrees_of
from mbody.quantities.units import DIMENSIONS
from mbody.solution.doubts import Doubt
from mbody.summaries.text_table import Column, number, numbers, paragraph, table
from mbody.sweeps.samples import DesignNumbers
from mbody.system.read_only import locked
from mbody.system.system import System

#: Failed designs that a summary names.
NAMED = 3
#: Designs up to which each has a row, and how many numbers a row has.
LISTED, ROW_NUMBERS = 30, 8


class ColumnStore(Protocol):
    """The columns, in memory or in a folder."""

    def column(self, index: int) -> np.ndarray:
        """One column: (designs,) or (designs, instants)."""

    @property
    def failures(self) -> dict[int, str]:
        """Error message of every failed design."""

    @property
    def doubts(self) -> dict[int, tuple[Doubt, ...]]:
        """Doubts by design, for designs that have any."""

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed: (designs,)."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """Measured quantities of many designs, in the units of the mechanism or of the measure.

    Attributes
    ----------
    system : System
        The description with its own numbers.
    samples : DesignNumbers
        The numbers of the designs.
    names : tuple of str
        The measured quantities.
    units : dict
        Unit of each.
    t : array (instants,)
        Times of the instants; empty for free motions.
    ending : str
        "completed", or "stopped: …" with the number of finished designs.
    known : tuple of str
        What is known of the forces that the quantities are made of, by the first and last design.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    >>> found = mbody.sweep(
    ...     machine,
    ...     {"crank.A.x": [0.9, 1.0], "coupler.mass": [2.0, 3.0, 4.0]},
    ...     measure="peak(motor.effort)",
    ...     turn=True,
    ... )
    >>> found["peak(motor.effort)"].shape, list(found.axes)
    ((2, 3), ['crank.A.x', 'coupler.mass'])
    """

    system: System
    samples: DesignNumbers
    names: tuple[str, ...]
    units: dict[str, str]
    t: np.ndarray
    ending: str
    kept: ColumnStore
    known: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.samples.values)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def axes(self) -> dict[str, np.ndarray]:
        """Name and values of every axis: the parameters of a grid, else the number of the
        design.
        """
        axes: dict[str, np.ndarray] = locked(self.samples.axes or {"design": np.arange(len(self))})
        return axes

    def axes_of(self, name: str) -> tuple[str, ...]:
        """Names of the axes of ``sweep[name]``; of a history the last one is ``"instant"``."""
        history = self._column(name).ndim == 2
        return (*self.axes, "instant") if history else tuple(self.axes)

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity along the axes that `axes_of` names; NaN where a design failed or was not
        analysed.
        """
        column = self._column(name)
        shape = tuple(len(values) for values in self.axes.values())
        return column.reshape(*shape, *column.shape[1:])

    def _column(self, name: str) -> np.ndarray:
        if name not in self.names:
            raise ModelError(
                f"the sweep has no {name!r} (there are: {listed(self.names)})", str(name)
            )
        return np.asarray(locked(self.kept.column(self.names.index(name))))

    def parameter(self, name: str) -> np.ndarray:
        """Values of a parameter: (designs,)."""
        for names in (self.samples.given_names, self.samples.names):
            if name in names:
                return np.asarray(locked(self.samples.values[:, names.index(name)]))
        raise ModelError(
            f"{name!r} is not a parameter of the sweep (there are: "
            f"{listed(self.samples.given_names)})",
            str(name),
        )

    @property
    def failures(self) -> dict[int, str]:
        """Error messages of failed designs, by number."""
        return self.kept.failures

    @functools.cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts of the designs; each message has the number of the design."""
        return tuple(
            replace(one, message=f"design {n}: {one.message}")
            for n, found in sorted(self.kept.doubts.items())
            for one in found
        )

    @property
    def status(self) -> str:
        """`ending`, or "doubtful: …" where a design is in doubt."""
        if not self.doubts:
            return self.ending
        count = len(self.kept.doubts)
        return f"doubtful: {count} of {len(self)} designs, as {self.doubts[0].message}"

    @property
    def notes(self) -> tuple[str, ...]:
        """Those on the description, what is known of forces, and the messages of the doubts."""
        return (*self.system.notes, *self.known, *(one.message for one in self.doubts))

    @property
    def done(self) -> np.ndarray:
        """Which designs were analysed, well or not: (designs,)."""
        return self.kept.done

    def design(self, number: int) -> System:
        """One design as a system, to be analysed by itself."""
        count = len(self)
        if not hasattr(number, "__index__") or not -count <= number < count:
            raise ModelError(f"there is no design {number!r}: give 0 to {count - 1}")
        values = self.samples.values[number].tolist()
        return self.system.with_values(dict(zip(self.samples.names, values, strict=True)))

    def unit_of(self, parameter: str, angle: str = "rad") -> str:
        """Unit of values of a parameter, of an angle "deg" or "rad"; empty for a plain number."""
        names = dict(zip(self.samples.given_names, self.samples.names, strict=True))
        units = self.system.mechanism.units
        kind = dimension_named(self.system.mechanism, names.get(parameter, parameter))
        unit = "" if kind is None else units.of(kind)
        return angle if unit == units.of(DIMENSIONS["angle"]) else unit

    def _parameter_values(self, name: str, angle: str) -> tuple[np.ndarray, str]:
        """Values of a parameter and their unit, angles in "deg" or "rad"."""
        values, unit = self.parameter(name), self.unit_of(name, angle)
        return (degrees_of(values) if unit == "deg" else values), unit

    def columns(self, angle: str = "rad") -> dict[str, Any]:
        """Parameters, quantities of one number, ``"error"`` and ``"doubt"``, by name: each
        (designs,). Parameters that are angles are in "deg" or "rad"; quantities have the units of
        `units`.
        """
        given = self.samples.given_names
        table: dict[str, Any] = {name: self._parameter_values(name, angle)[0] for name in given}
        for name in self.names:
            column = self._column(name)
            table[name] = column if column.ndim == 1 else list(column)
        sentences, doubts = self.failures, self.kept.doubts
        table["error"] = [sentences.get(n, "") for n in range(len(self))]
        table["doubt"] = ["; ".join(d.message for d in doubts.get(n, ())) for n in range(len(self))]
        return table

    def to_dataframe(self) -> Any:
        """A row for each design as a pandas DataFrame; needs pandas."""
        try:
            import pandas  # type: ignore[import-untyped, unused-ignore]
        except ImportError:
            raise ModelError(
                "a table of a sweep needs pandas, which is not installed: pip install pandas"
            ) from None
        frame = pandas.DataFrame(self.columns())
        frame.attrs |= {"status": self.status, "notes": self.notes}
        return frame

    def _statistics(self, name: str) -> list[float]:
        """Least, mean, greatest value and standard deviation; NaN where there is none."""
        column = self._column(name)
        column = column[np.isfinite(column)]
        if not column.size:
            return [np.nan] * 4
        return [column.min(), column.mean(), column.max(), column.std()]

    def __repr__(self) -> str:
        return (
            f"Sweep({self.system.mechanism.name!r}: {', '.join(self.names)} of {len(self)} "
            f"designs, {self.status})"
        )

    def _repr_html_(self) -> str:
        # what a notebook shows
        return str(present("notebook", self))

    def _designs(self) -> list[str]:
        """A row for each design where they are few: its numbers, and its measures of one value."""
        if not 1 < len(self) <= LISTED:
            return []
        columns = [Column("DESIGN", [str(n) for n in range(len(self))])]
        for name in self.samples.given_names:
            values, unit = self._parameter_values(name, "deg")  # as all summaries have angles
            columns.append(Column(name, numbers(values), unit))
        measures = [name for name in self.names if self._column(name).ndim == 1]
        if not measures:
            return []  # histories
        for name in measures:
            columns.append(Column(name, numbers(self._column(name)), self.units[name]))
        return ["", *table(columns[: 1 + ROW_NUMBERS])]

    def __str__(self) -> str:
        machine, failed = self.system.mechanism, self.failures
        lines = paragraph(
            f"{machine.name}: sweep of {len(self)} designs over "
            f"{', '.join(self.samples.given_names)}"
        )
        rows = [self._statistics(name) for name in self.names]
        columns = [Column("MEASURES", list(self.names), text=True)]
        for n, title in enumerate(("least", "mean", "greatest", "deviation")):
            columns.append(Column(title, [number(row[n]) for row in rows]))
        columns.append(Column("unit", [self.units[name] for name in self.names], text=True))
        lines += ["", *table(columns)]
        lines += self._designs()
        if failed:
            lines += ["", f"{len(failed)} of {len(self)} designs failed:"]
            some = sorted(failed.items())[:NAMED]
            lines += [f"  design {design}: {sentence}" for design, sentence in some]
        doubts = self.kept.doubts
        if doubts:
            lines += ["", f"{len(doubts)} of {len(self)} designs are in doubt:"]
            lines += [f"  {one.message}" for one in self.doubts[:NAMED]]
        if self.status != "completed":
            lines += ["", self.status]
        if self.known:
            lines += ["", *(line for note in self.known for line in paragraph(f"note: {note}"))]
        return "\n".join(lines)

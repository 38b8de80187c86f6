"""What a result is made of, declared once: its data and its text are both written from that.

A class of results lists its quantities in `declared`: key of the data, words for people, what is
measured, where the value is read. Data have the units of the model, and the unit of angles that is
asked for; the text (`mbody/summaries/text_table.py`) has units for people.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mbody.core.presentation import Presented
from mbody.errors import ModelError
from mbody.model.element import listed
from mbody.quantities.evaluate import short_degrees
from mbody.quantities.units import DIMENSIONS, NUMBER, Dimension, name_of
from mbody.solution.doubts import Doubt, heading

if TYPE_CHECKING:
    from mbody.quantities.output_units import OutputUnits


# -- Columns of results: a history with its name, unit and doubts; a table of several ----------

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


#: Powers as they are written in products of units.
POWERS = {"²": 2, "³": 3}
#: Where a value is read: an attribute or a key, by default that of the data, or a function.
Reader: TypeAlias = "str | Callable[[Any], Any]"


class DeclaredEntry:
    """One part of a result.

    `key`: In the data; empty of what is for people alone.
    `value`: Where it is read.
    """

    key: str
    value: Reader

    def read(self, owner: Any) -> Any:
        """Its value of a result, or of an item of one."""
        source = self.value or self.key
        if callable(source):
            return source(owner)
        return owner[source] if isinstance(owner, dict) else getattr(owner, source)

    def as_data(self, owner: Any, units: Any, dimension: str = "") -> dict[str, Any]:
        """Its plain value by its key, which may be none."""
        return {}


@dataclass(frozen=True)
class Value(DeclaredEntry):
    """A quantity: a row of the text, or a column of a table.

    `key`: In the data; empty of what is for people alone.
    `words`: For people; empty of what is data alone. Of a mapping the words by key, or a pattern.
    `dimension`: What it measures: a name of `DIMENSIONS`, a product such as ``"mass·length²"``,
      "share", which people read in percent, "text", or "each" where every row has a unit of its
      own; of a mapping by key, of a sequence one by one; or a function that says it.
    `missing`: For people, where there is no value; by default it has no row.
    `floor`: Below it a value is rounding beside others, and printed as 0; a number, of a mapping by
      key, or a function.
    `columns`: Where the value has parts: of what it is, and beside it.
    """

    key: str = ""
    words: str | Mapping[str, str] = ""
    dimension: str | tuple[str, ...] | Mapping[str, str] | Callable[[Any], Any] = ""
    value: Reader = ""
    missing: str | None = field(default=None, kw_only=True)
    floor: Any = field(default=0.0, kw_only=True)
    columns: tuple[Value, ...] = field(default=(), kw_only=True)

    def as_data(self, owner: Any, units: Any, dimension: str = "") -> dict[str, Any]:
        """Its plain value by its key. `dimension`: What it measures where it does not say so."""
        value = self.read(owner) if self.key else ...
        measured = called(self.dimension, owner) or dimension
        if value is ...:  # there is no such thing in this one
            return {}
        if isinstance(value, Mapping) and (self.by_key or isinstance(measured, Mapping)):
            parts = value.items()
            return {
                self.key: {n: self._plain(v, units, of_name(measured, n, "")) for n, v in parts}
            }
        return {self.key: self._plain(value, units, measured)}

    @property
    def by_key(self) -> bool:
        """Whether it is a mapping of quantities."""
        return isinstance(self.words, Mapping) or "{}" in self.words

    def _plain(self, value: Any, units: Any, dimension: str) -> Any:
        if self.columns and value is not None:
            return of_entries(self.columns, value, units, dimension)
        return plain(value, units, dimension)


def data_only(*keys: str, dimension: str = "") -> tuple[Value, ...]:
    """Quantities that are data alone, all of one dimension."""
    return tuple(Value(key, "", dimension) for key in keys)


def of_entries(
    declared: Sequence[DeclaredEntry | str], owner: Any, units: Any, dimension: str = ""
) -> dict[str, Any]:
    """The plain values of all that is declared of one thing; keys in a text are data as is."""
    found: dict[str, Any] = {}
    for one in declared:
        for entry in map(Value, one.split()) if isinstance(one, str) else (one,):
            found |= entry.as_data(owner, units, dimension)
    return found


def called(given: Any, owner: Any) -> Any:
    """What a declaration gives, or what its function finds."""
    return given(owner) if callable(given) else given


def of_name(found: Any, name: str, other: Any) -> Any:
    """What a mapping has of a name, else `other`; what is no mapping is of all names."""
    return found.get(name, other) if isinstance(found, Mapping) else found


@dataclass(frozen=True)
class Heading(DeclaredEntry):
    """Quantities below it are a table of their own under this heading; `of`: that of the values."""

    words: str
    of: str = ""
    key, value = "", ""


@dataclass(frozen=True)
class IncludedResult(DeclaredEntry):
    """What another result declares, as if it were declared here, its data under `key` if it has
    one; nothing where there is none.
    """

    value: Reader
    key: str = ""

    def as_data(self, owner: Any, units: Any, dimension: str = "") -> dict[str, Any]:
        """The data of the other result."""
        other = self.read(owner)
        return {self.key: plain(other, units)} if self.key else declared_data(other, units)


@dataclass(frozen=True)
class ItemTable(DeclaredEntry):
    """A table of items: a sequence, or a mapping whose keys are the first column, under `words`.

    `columns`: Of each item, and tables of it, as data.
    """

    key: str
    columns: tuple[DeclaredEntry | str, ...]
    words: str = ""
    value: Reader = ""

    def as_data(self, owner: Any, units: Any, dimension: str = "") -> dict[str, Any]:
        """The items as dicts, in a list, or by their keys."""
        if not self.key:
            return {}
        items = self.read(owner)
        whole = items.values() if isinstance(items, Mapping) else items
        rows = [of_entries(self.columns, one, units) for one in whole]
        return {self.key: dict(zip(items, rows, strict=True)) if whole is not items else rows}


@dataclass(frozen=True)
class ColumnTable(DeclaredEntry):
    """A table of columns that are quantities of the result by themselves: sequences alike, or
    mappings with the same keys, which are the first column, under `words`.

    `columns`: Of the table, and of the data.
    `kept`: Which rows people see; by default `SHOWN` of them, at even distances.
    """

    columns: tuple[Value, ...]
    words: str = ""
    kept: Callable[[Any], Sequence[int]] | None = None
    key, value = "", ""

    def as_data(self, owner: Any, units: Any, dimension: str = "") -> dict[str, Any]:
        """Every column by its key."""
        return of_entries(self.columns, owner, units)


@dataclass(frozen=True)
class Sentence(DeclaredEntry):
    """A sentence, or several; nothing where there is none."""

    value: Reader
    key = ""


def in_units(units: OutputUnits, dimension: str, values: Any) -> tuple[Any, str]:
    """Values of a quantity of a model in other units, and the symbol.

    >>> from mbody.quantities.output_units import read_by_people
    >>> from mbody.quantities.units import unit_system
    >>> in_units(read_by_people(unit_system("mm-N-s")), "mass·length", 0.002)
    (2.0, 'kg·mm')
    """
    if dimension in ("", "share", "text", "each"):
        return values, ""
    # a product is read by its factors: kg·mm, where the system alone has N·s²
    factors = [(part.rstrip("²³"), POWERS.get(part[-1], 1)) for part in dimension.split("·")]
    whole = math.prod((DIMENSIONS[name] ** n for name, n in factors), start=NUMBER)
    if len(factors) == 1 or whole in units.chosen:
        return units.converted(values, whole), units.of(whole)
    size = math.prod(units.size(name) ** n for name, n in factors)
    return values / size, "·".join(units.of(name) + ("", "", "²", "³")[n] for name, n in factors)


def plain(value: Any, units: OutputUnits | None = None, dimension: Any = "") -> Any:
    """A value as JSON has it: complex numbers are pairs, what is infinite or undefined is None.
    `dimension`: Of all, or of the parts of a sequence.

    >>> plain({"a": (1.0, math.inf), "b": np.array([1.0 + 2.0j])})
    {'a': [1.0, None], 'b': [[1.0, 2.0]]}
    """
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Mapping):
        return {key: plain(one, units, dimension) for key, one in value.items()}
    if isinstance(value, Doubt):
        return value.data()
    if dataclasses.is_dataclass(value) or isinstance(value, Presented):
        if isinstance(value, Presented) and model_of(value) is not None:
            return value.data(None if units is None else units.of("angle"))
        return declared_data(value, units, dimension)
    if isinstance(value, float | complex | np.ndarray | np.generic):
        whole, symbol = (value, "") if units is None else in_units(units, dimension, value)
        if symbol == "deg" and isinstance(value, float):
            whole = short_degrees(value)
        array = np.asarray(whole)
        if array.dtype.kind == "c":
            array = np.stack([array.real, array.imag], axis=-1) + 0.0  # no −0
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            array = array.astype(object)
            array[~np.isfinite(array.astype(float))] = None
        return array.tolist()
    if isinstance(dimension, tuple) and not isinstance(value[0], list | tuple):
        return [plain(one, units, own) for one, own in zip(value, dimension, strict=True)]
    return [plain(one, units, dimension) for one in value]


def entries(result: Any) -> Sequence[DeclaredEntry | str]:
    """What a result declares; its fields where it declares nothing."""
    # those that its `repr` has: not its status and notes
    return getattr(result, "declared", ()) or [f.name for f in dataclasses.fields(result) if f.repr]


def declared_data(result: Any, units: OutputUnits | None, dimension: str = "") -> dict[str, Any]:
    """The plain values of all that a result declares; `dimension`: Of what does not say its own."""
    return of_entries(entries(result), result, units, dimension)


def result_data(result: Any, angle: str | None) -> dict[str, Any]:
    """A result as plain values, ready for JSON, in the units of the model or those that it has for
    results; one that says which analysis it is has the heading of all results.
    """
    model = model_of(result)
    if model is None:
        return declared_data(result, None)
    units = getattr(result, "compared_in", None)  # what it is in, whatever is asked for
    if units is None:
        units = model.data_units.with_angle(angle, getattr(result, "angle_unit", "rad"))
    found, analysis = declared_data(result, units), getattr(result, "analysis_name", "")
    if not analysis:
        return found
    return heading(model.name, analysis.format(result), units.symbols(), result) | found


def model_of(result: Any) -> Any:
    """The mechanism of a result, or what it knows of it; None where it knows nothing."""
    for owner in ("run", "solution"):
        if (found := getattr(result, owner, None)) is not None:
            return found.mechanism
    found = getattr(result, "mechanism", None)
    if not isinstance(found, str):
        return found
    from mbody.quantities.output_units import OutputUnits, read_by_people

    units = result.units
    return SimpleNamespace(name=found, data_units=OutputUnits(units), shown=read_by_people(units))

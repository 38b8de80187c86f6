"""Bundles: named numbers and arrays that are passed to a kernel by one address.

Of a `Bundle` a kernel gets the address of one table instead of hundreds of numbers. The table is
made together with the bundle and contains, of each array, what numba keeps on its stack for it
(`array_words`); inside compiled functions ``bundle.field`` reads as in Python
(`mbody.compiler.numba_bundle`).
"""

from __future__ import annotations

import functools
import math
import struct
import sys
from typing import Any, ClassVar, Self

import numpy as np

from mbody.core import selection

#: Arrays by their kind of number and number of axes; to type checkers they are arrays of any kind.
Ints = Any
Tables = Any
Floats = Any
Rows = Any
Stacks = Any
Grids = Any
ComplexRows = Any

#: Kind of number and number of axes of what an annotation names.
KINDS: dict[str, tuple[str, int]] = {
    "int": ("int64", 0),
    "float": ("float64", 0),
    "Ints": ("int64", 1),
    "Tables": ("int64", 2),
    "Floats": ("float64", 1),
    "Rows": ("float64", 2),
    "Stacks": ("float64", 3),
    "Grids": ("float64", 4),
    "ComplexRows": ("complex128", 2),
}

#: A float64 and the integer of the same bits.
_FLOAT, _FLOAT_WORD = struct.Struct("d"), struct.Struct("q")


class Bundle:
    """Named numbers, arrays and bundles; subclasses annotate them as `int`, `float`, one of the
    kinds above, or a class of bundles.

    The fields are set once and never change; the numbers within the arrays may change.
    """

    fields: ClassVar[tuple[str, ...]]
    address: int
    _numba_type_: ClassVar[Any]
    #: By name type of number and number of axes of a field, and its words; of a bundle no type.
    _plan: ClassVar[dict[str, tuple[np.dtype[Any] | None, int, slice]]]
    _words: np.ndarray

    def __init_subclass__(cls) -> None:
        cls.fields = tuple(cls.__annotations__)
        cls._plan, start = {}, 0
        for name, kind in cls.__annotations__.items():
            number, axes = KINDS.get(kind, (None, 0))
            stop = start + (len(array_words(0, (0,) * axes)) if axes else 1)
            dtype = None if number is None else np.dtype(number)
            cls._plan[name] = dtype, axes, slice(start, stop)
            start = stop
        compiler = selection.compiler()
        if compiler is not None:
            cls._numba_type_ = compiler.bundle_type(cls)

    def __init__(self, **values: Any) -> None:
        if values.keys() != set(self.fields):
            wrong = ", ".join(sorted(values.keys() ^ set(self.fields)))
            raise TypeError(f"{type(self).__name__}: missing or unknown: {wrong}")
        words: list[int] = []
        for name in self.fields:
            words += self._set(name, values[name])
        self._keep(np.array(words, dtype=np.int64))

    def _set(self, name: str, value: Any) -> list[int]:
        """Take the value of a field; its words."""
        dtype, axes, _ = self._plan[name]
        if dtype is None:
            words = [value.address]
        elif axes:
            value = np.ascontiguousarray(value, dtype)
            if value.ndim != axes:
                raise TypeError(f"{type(self).__name__}.{name} has {axes} axes")
            pointer = value.__array_interface__["data"][0]
            words = array_words(pointer, value.shape, value.itemsize)
        else:
            words = [int(value)] if dtype.kind == "i" else [*_FLOAT_WORD.unpack(_FLOAT.pack(value))]
        self.__dict__[name] = value
        return words

    @classmethod
    def zeros(cls, shapes: tuple[tuple[int, ...], ...], **numbers: float) -> Self:
        """A bundle whose arrays, all of float64, are zeros of these shapes in one piece of memory:
        made in a third of the time.
        """
        own: Any = cls  # mypy takes a type of Self for unhashable
        size, template, pointers, places = _zeros(own, shapes)
        memory, words = np.zeros(size), template.copy()
        words[pointers] += memory.__array_interface__["data"][0]
        bundle = cls.__new__(cls)
        bundle.__dict__.update(numbers, _memory=memory, _places=places)
        for name, value in numbers.items():
            words[places[name][0]] = _FLOAT_WORD.unpack(_FLOAT.pack(value))[0]
        bundle._keep(words)
        return bundle

    def __getattr__(self, name: str) -> np.ndarray:
        # of a bundle of `zeros` an array is made when it is first read: most never are
        own = self.__dict__
        if name.startswith("_") or name not in own.get("_places", ()):
            raise AttributeError(f"a {type(self).__name__} has no {name!r}")
        start, stop, shape = own["_places"][name]
        own[name] = view = own["_memory"][start:stop].reshape(shape)
        return view

    def _keep(self, words: np.ndarray) -> None:
        """Set the table of this bundle."""
        self.__dict__["_words"] = words
        self.__dict__["address"] = words.__array_interface__["data"][0]

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"the fields of a {type(self).__name__} cannot change: make a new one")

    @classmethod
    def bundle_of(cls, name: str) -> type[Bundle] | None:
        """The class of a field that is a bundle itself; None of others."""
        kind = cls.__annotations__[name]
        return None if kind in KINDS else getattr(sys.modules[cls.__module__], kind)

    def attach(self, name: str, bundle: Bundle) -> None:
        """Another bundle in the place of one, between two calls of kernels: what contains this
        bundle has it, too.
        """
        if name not in self._plan:
            raise AttributeError(f"a {type(self).__name__} has no {name!r}")
        assert type(bundle) is type(getattr(self, name))
        self._words[self._plan[name][2]] = self._set(name, bundle)

    def take(self, other: Self, but: set[str]) -> None:
        """All arrays but some become those of another bundle, between two calls of kernels."""
        for name, (_, _, words) in self._plan.items():
            if name not in but:
                self._words[words] = other._words[words]
                self.__dict__[name] = getattr(other, name)

    def replaced(self, **values: Any) -> Self:
        """A copy with other values of some fields."""
        bundle, words = type(self).__new__(type(self)), self._words.copy()
        bundle.__dict__.update(self.as_dict())
        for name, value in values.items():
            if name not in self._plan:
                raise TypeError(f"{type(self).__name__}: missing or unknown: {name}")
            words[self._plan[name][2]] = bundle._set(name, value)
        bundle._keep(words)
        return bundle

    def as_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return {name: getattr(self, name) for name in self.fields}

    def __reduce__(self) -> tuple[Any, ...]:
        # the address belongs to this process
        return _restored, (type(self), self.as_dict())


def _restored(kind: type[Bundle], values: dict[str, Any]) -> Bundle:
    return kind(**values)


@functools.lru_cache(maxsize=256)
def _zeros(
    kind: type[Bundle], shapes: tuple[tuple[int, ...], ...]
) -> tuple[int, np.ndarray, np.ndarray, dict[str, tuple[Any, ...]]]:
    """Size of the memory of `Bundle.zeros`; the table for memory that begins at zero, and where in
    it the pointers are; by name start, stop and shape of an array, the place of a number.
    """
    words, pointers, start = list[int](), list[int](), 0
    places: dict[str, tuple[Any, ...]] = {}
    rest = iter(shapes)
    for name, (dtype, axes, _) in kind._plan.items():
        if not axes:
            assert dtype is not None and dtype.kind == "f", f"{kind.__name__}.{name} is no float"
            places[name] = (len(words),)
            words.append(0)
            continue
        shape = next(rest)
        stop = start + math.prod(shape)
        places[name] = start, stop, shape
        pointers.append(len(words) + 4)
        words += array_words(8 * start, shape)
        start = stop
    return start, np.array(words), np.array(pointers), places


def array_words(pointer: int, shape: tuple[int, ...], itemsize: int = 8) -> list[int]:
    """Numba's struct of a C-contiguous array of numbers of so many bytes: memory info and parent
    (none), number of items, item size, data pointer, shape and strides.
    """
    before, after = _array_words(shape, itemsize)
    return [*before, pointer, *after]


@functools.lru_cache(maxsize=1024)
def _array_words(shape: tuple[int, ...], itemsize: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Words before and after the pointer in `array_words`."""
    strides = [itemsize]
    for count in reversed(shape[1:]):
        strides.insert(0, strides[0] * count)
    size = strides[0] * shape[0] // itemsize
    return (0, 0, size, itemsize), (*shape, *strides)

"""Numba's type of a `Bundle`: a pointer to its table.

Numba unpacks a tuple of arrays at every call (seven hundred numbers for those of the core), and
each kernel contains code for it. A bundle is one address, and its fields are loaded where they are
read. The loads are marked as invariant, since the table never changes. A call takes 1 µs, not 7.

A table consists of words of eight bytes, also where addresses have four: so one image of a model
serves every machine (`mbody.image`).
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    unbox,
)

from mbody.core.bundle import KINDS, Bundle

WORD = ir.IntType(64)
NUMBERS = {"int64": types.int64, "float64": types.float64, "complex128": types.complex128}


def number_type(number: str, axes: int) -> Any:
    """Numba's type of a number, or of a C-contiguous array of so many axes."""
    kind = NUMBERS[number]
    return types.Array(kind, axes, "C") if axes else kind


def bundle_type(bundle: type[Bundle]) -> Address:
    """Numba's type of the bundles of a class."""
    kinds = [number_type(*KINDS[kind]) for kind in bundle.__annotations__.values()]
    return Address(bundle, kinds)


class Address(types.Type):
    """Numba's type of a pointer to the table of a bundle."""

    def __init__(self, bundle: type[Bundle], kinds: list[Any]) -> None:
        self.bundle, self.kinds = bundle, kinds
        names = ", ".join(f"{n}: {k}" for n, k in zip(bundle.fields, kinds, strict=True))
        super().__init__(f"Address({bundle.__module__}.{bundle.__qualname__}({names}))")


@register_model(Address)
class AddressModel(models.PrimitiveModel):
    """A plain pointer."""

    def __init__(self, manager: Any, kind: Address) -> None:
        super().__init__(manager, kind, WORD.as_pointer())


@unbox(Address)
def _address(kind: Address, value: Any, frame: Any) -> NativeValue:
    number = frame.pyapi.object_getattr_string(value, "address")
    pointer = frame.pyapi.long_as_voidptr(number)
    frame.pyapi.decref(number)
    return NativeValue(frame.builder.bitcast(pointer, frame.context.get_value_type(kind)))


@infer_getattr
class AddressAttributes(AttributeTemplate):
    """Fields of the bundle behind an address."""

    key = Address

    def generic_resolve(  # type: ignore[override]  # numba has NotImplemented in its place
        self, address: Address, name: str
    ) -> Any:
        """Type of a field."""
        fields = address.bundle.fields
        return address.kinds[fields.index(name)] if name in fields else None


@lower_getattr_generic(Address)
def _read_field(context: Any, builder: Any, kind: Address, value: Any, name: str) -> Any:
    n = kind.bundle.fields.index(name)
    first = sum(_words(context.get_value_type(k)) for k in kind.kinds[:n])
    found = _load_words(builder, value, first, context.get_value_type(kind.kinds[n]))
    return impl_ret_borrowed(context, builder, kind.kinds[n], found)


def _parts(kind: Any) -> list[Any] | None:
    """Types of the parts of a struct or an array of LLVM; None for others."""
    if isinstance(kind, ir.ArrayType):
        return [kind.element] * kind.count
    return list(kind.elements) if isinstance(kind, ir.LiteralStructType) else None


def _words(kind: Any) -> int:
    """Number of words that a value takes in a table."""
    parts = _parts(kind)
    return 1 if parts is None else sum(_words(part) for part in parts)


def _load_words(builder: Any, table: Any, first: int, kind: Any) -> Any:
    """Load a value part by part, as invariant: the optimiser drops the parts that are not used."""
    parts = _parts(kind)
    if parts is None:
        place = cgutils.gep_inbounds(builder, table, first)
        loaded = builder.load(builder.bitcast(place, kind.as_pointer()))
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded
    value = ir.Constant(kind, ir.Undefined)
    for n, part in enumerate(parts):
        value = builder.insert_value(value, _load_words(builder, table, first, part), n)
        first += _words(part)
    return value

"""Numba's type of a `Bundle`: a pointer to its table.

Numba unpacks a tuple of arrays at every call (seven hundred numbers for those of the core), and
each kernel contains code for it. A bundle is one address, and its fields are loaded where they are
read. The loads are marked as invariant, since the table never changes. A call takes 1 µs, not 7.
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

__all__ = ["Address", "bundle_type", "number_type"]

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
        table = ir.LiteralStructType([manager.lookup(k).get_value_type() for k in kind.kinds])
        super().__init__(manager, kind, table.as_pointer())


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
    field = cgutils.gep_inbounds(builder, value, 0, n)
    return impl_ret_borrowed(context, builder, kind.kinds[n], _load_fields(builder, field))


def _load_fields(builder: Any, pointer: Any) -> Any:
    """Load a struct part by part, as invariant: the optimiser drops the parts that are not used."""
    pointee = pointer.type.pointee
    if not isinstance(pointee, (ir.LiteralStructType, ir.ArrayType)):
        loaded = builder.load(pointer)
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded
    value = ir.Constant(pointee, ir.Undefined)
    count = pointee.count if isinstance(pointee, ir.ArrayType) else len(pointee.elements)
    for n in range(count):
        part = cgutils.gep_inbounds(builder, pointer, 0, n)
        value = builder.insert_value(value, _load_fields(builder, part), n)
    return value

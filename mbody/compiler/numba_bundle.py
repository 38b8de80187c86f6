"""Numba's type of a `Bundle`: a pointer to its table.

Numba unpacks a tuple of arrays at every call (seven hundred numbers for those of the core), and
each kernel contains code for it. A bundle is one address, and its fields are loaded where they are
read. The loads are marked as invariant, since the table never changes. A call takes 1 µs, not 7.

A table consists of words of eight bytes, also where addresses have four: so one image of a model
serves every machine (`mbody.image`).
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate, signature
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_builtin,
    lower_getattr_generic,
    models,
    register_model,
    type_callable,
    unbox,
)

from mbody.core.bundle import KINDS, Bundle
from mbody.core.callbacks import DOOR, call_user

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


WORD = ir.IntType(64)
#: Digits by which types of bundles of one name differ.
NAME_DIGITS = 8
NUMBERS = {"int64": types.int64, "float64": types.float64, "complex128": types.complex128}


def number_type(number: str, axes: int) -> Any:
    """Numba's type of a number, or of a C-contiguous array of so many axes."""
    kind = NUMBERS[number]
    return types.Array(kind, axes, "C") if axes else kind


@functools.cache
def bundle_type(bundle: type[Bundle]) -> Address:
    """Numba's type of the bundles of a class."""
    kinds = []
    for name, kind in bundle.__annotations__.items():
        inner: Any = bundle.bundle_of(name)  # mypy takes classes of bundles for unhashable
        kinds.append(number_type(*KINDS[kind]) if inner is None else bundle_type(inner))
    return Address(bundle, kinds)


class Address(types.Type):
    """Numba's type of a pointer to the table of a bundle."""

    def __init__(self, bundle: type[Bundle], kinds: list[Any]) -> None:
        self.bundle, self.kinds = bundle, kinds
        names = ", ".join(f"{n}: {k}" for n, k in zip(bundle.fields, kinds, strict=True))
        # a short name: it is part of the symbol of every function that takes such a bundle
        digest = hashlib.sha256(f"{bundle.__module__}.{names}".encode()).hexdigest()[:NAME_DIGITS]
        super().__init__(f"{bundle.__qualname__}{digest}")


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


# -- The call of users' Python from compiled code: `mbody.core.callbacks.call_user` for numba --

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False


#: Compiled code finds the callback by this name, which (unlike an address) can be written into a
#: file. Numba's object mode would do the same but compile its block in every process.
SYMBOL = "mbody_call_user"
llvmlite.binding.add_symbol(SYMBOL, ctypes.cast(DOOR, ctypes.c_void_p).value)

_FAILED, _INTERRUPTED = 1, 2


def _is_plain_row(array: Any) -> bool:
    return (
        isinstance(array, types.Array)
        and array.dtype == types.float64
        and array.ndim == 1
        and array.layout == "C"
    )


@type_callable(call_user)
def _typer(context: Any) -> Any:
    def typer(handle: Any, x: Any, y: Any) -> Any:
        if isinstance(handle, types.Integer) and _is_plain_row(x) and _is_plain_row(y):
            return signature(types.int64, types.int64, x, y)
        return None

    return typer


@lower_builtin(call_user, types.Integer, types.Array, types.Array)
def _lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    """Call the door; an interrupt before its first line leaves the status ``_INTERRUPTED``."""
    word = ir.IntType(64)
    number = context.cast(builder, arguments[0], sig.args[0], types.int64)
    status = cgutils.alloca_once_value(builder, ir.Constant(word, _INTERRUPTED))
    status_address = builder.ptrtoint(status, word)
    values = [number]
    for kind, value in zip(sig.args[1:], arguments[1:], strict=True):
        array = context.make_array(kind)(context, builder, value)
        values += [builder.ptrtoint(array.data, word), array.nitems]
    callback = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.VoidType(), [word] * 6), SYMBOL
    )
    builder.store(ir.Constant(word, _INTERRUPTED), status)
    builder.call(callback, [*values, status_address])
    # An exception that occurred in ctypes before the first line of the door is lost.  Python checks
    # for signals there, so it was a keyboard interrupt: store one.
    interrupted = builder.icmp_signed("==", builder.load(status), ir.Constant(word, _INTERRUPTED))
    with builder.if_then(interrupted, likely=False):
        nothing = ir.Constant(word, 0)
        builder.store(ir.Constant(word, _FAILED), status)
        builder.call(
            callback, [number, nothing, ir.Constant(word, -1), nothing, nothing, status_address]
        )
    return builder.load(status)

"""The C interface of the kernels: wrappers around each in LLVM's language, in three forms.

``mbody_NAME``        plain C: bundles are addresses of their tables; an array is a pointer and its
                      shape; numbers are ``int64_t`` and ``double`` (truth values too are
                      ``int64_t``). Results are words of eight bytes behind a pointer, which comes
                      first where there are any.
``mbody_NAME_np``     the same, where an array is the address of its Python object; data and shape
                      are read from NumPy's public structure.
``mbody_NAME_words``  (arguments, results): what the plain form takes, in words of eight bytes. One
                      signature for all kernels, for units of co-simulation and for browsers.

The value of each is zero, unless the kernel raised.
"""

# mypy: disallow-any-unimported=False, disallow-untyped-calls=False

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

from llvmlite import ir
from numba import types

from mbody.compiler.numba_bundle import SYMBOL

#: Endings of the names; programs in C need the last one alone.
WORDS = "_words"
FORMS = ("", "_np", WORDS)

I8, I32, I64, DOUBLE = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()
BYTES = I8.as_pointer()
HEAD = "mbody_object_head"


def wrapper(context: Any, triple: str, layout: str, name: str, found: Any) -> ir.Module:
    """The wrappers of one kernel, as a module of their own; `found`: numba's description of it."""
    module = ir.Module(f"wrapper.{name}")
    module.triple, module.data_layout = triple, layout
    return _Wrapper(context, module, found).module_of(name)


class _Wrapper:
    def __init__(self, context: Any, module: ir.Module, found: Any) -> None:
        self.context, self.module, self.found = context, module, found
        kind = context.call_conv.get_function_type(found.restype, found.argtypes)
        self.callee = ir.Function(module, kind, found.llvm_func_name)
        self.head = ir.GlobalVariable(module, I64, HEAD)

    def module_of(self, name: str) -> ir.Module:
        for numpy, form in ((False, ""), (True, "_np")):
            kinds = [k for t in self.found.argtypes for k in self._leaves(t, numpy)]
            results = [BYTES] if self.found.restype != types.none else []
            builder, given = self._function(f"mbody_{name}{form}", [*results, *kinds])
            values = iter(given)
            target = next(values) if results else None
            self._call(builder, values, target, numpy)
        words = I64.as_pointer()
        builder, (arguments, results_) = self._function(f"mbody_{name}_words", [words, words])
        kinds = [k for t in self.found.argtypes for k in self._leaves(t, False)]
        self._call(
            builder, self._words(builder, arguments, kinds), builder.bitcast(results_, BYTES), False
        )
        return self.module

    def _function(self, name: str, kinds: list[Any]) -> tuple[ir.IRBuilder, Any]:
        function = ir.Function(self.module, ir.FunctionType(I32, kinds), name)
        return ir.IRBuilder(function.append_basic_block()), function.args

    def _call(self, builder: Any, values: Iterator[Any], target: Any, numpy: bool) -> None:
        found = self.found
        arguments = [self._value(builder, kind, values, numpy) for kind in found.argtypes]
        status, value = self.context.call_conv.call_function(
            builder, self.callee, found.restype, found.argtypes, arguments
        )
        if found.restype != types.none:
            self._store(builder, target, found.restype, value)
        builder.ret(status.code)

    @staticmethod
    def _words(builder: Any, arguments: Any, kinds: list[Any]) -> Iterator[Any]:
        for n, kind in enumerate(kinds):
            word = builder.load(builder.gep(arguments, [ir.Constant(I64, n)]))
            if kind == BYTES:
                yield builder.inttoptr(word, BYTES)
            else:
                yield builder.bitcast(word, DOUBLE) if kind == DOUBLE else word

    @staticmethod
    def _leaves(kind: Any, numpy: bool) -> list[Any]:
        """Types of the values that one argument is passed as."""
        if isinstance(kind, types.Array):
            return [BYTES] if numpy else [BYTES, *[I64] * kind.ndim]
        if kind == types.float64:
            return [DOUBLE]
        if isinstance(kind, types.Integer | types.Boolean):
            return [I64]
        return [BYTES]  # the table of a bundle

    def _value(self, builder: Any, kind: Any, values: Iterator[Any], numpy: bool) -> Any:
        one = next(values)
        if isinstance(kind, types.Array):
            if numpy:  # PyArrayObject_fields: head, data, number of axes, dimensions
                head = builder.load(self.head)
                data = self._field(builder, one, head)
                place = self._field(builder, one, builder.add(head, ir.Constant(I64, 16)))
                sizes = builder.bitcast(place, I64.as_pointer())
                shape = [
                    builder.load(builder.gep(sizes, [ir.Constant(I64, n)]))
                    for n in range(kind.ndim)
                ]
            else:
                data, shape = one, list(itertools.islice(values, kind.ndim))
            return self._array(builder, kind, data, shape)
        if isinstance(kind, types.Boolean):
            return builder.icmp_unsigned("!=", one, ir.Constant(I64, 0))
        if isinstance(kind, types.Integer | types.Float):
            return one
        return builder.bitcast(one, self.context.get_value_type(kind))

    @staticmethod
    def _field(builder: Any, place: Any, offset: Any) -> Any:
        field = builder.gep(place, [offset])
        return builder.load(builder.bitcast(field, BYTES.as_pointer()))

    def _array(self, builder: Any, kind: Any, data: Any, shape: list[Any]) -> Any:
        size = ir.Constant(I64, 16 if kind.dtype == types.complex128 else 8)
        strides = [size]
        for count in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], count))
        total = ir.Constant(I64, 1)
        for count in shape:
            total = builder.mul(total, count)
        array = self.context.make_array(kind)(self.context, builder)
        array.data = builder.bitcast(data, self.context.get_data_type(kind.dtype).as_pointer())
        array.nitems, array.itemsize = total, size
        array.shape, array.strides = self._pack(builder, shape), self._pack(builder, strides)
        array.meminfo = array.parent = ir.Constant(BYTES, None)
        return array._getvalue()

    @staticmethod
    def _pack(builder: Any, values: list[Any]) -> Any:
        packed = ir.Constant(ir.ArrayType(I64, len(values)), ir.Undefined)
        for n, value in enumerate(values):
            packed = builder.insert_value(packed, value, n)
        return packed

    @staticmethod
    def _store(builder: Any, target: Any, kind: Any, value: Any) -> None:
        """Results as words, one after the other."""
        parts: list[tuple[Any, Any]] = [(kind, value)]
        if isinstance(kind, types.BaseTuple):
            inner: Any = kind
            parts = [(part, builder.extract_value(value, n)) for n, part in enumerate(inner)]
        for n, (part, one) in enumerate(parts):
            if isinstance(part, types.Literal):
                one = ir.Constant(I64, int(part.literal_value))
            elif isinstance(part, types.Boolean) and one.type != I64:
                one = builder.zext(one, I64)
            elif isinstance(part, types.Integer) and one.type != I64:
                one = builder.sext(one, I64)
            place = builder.gep(target, [ir.Constant(I64, 8 * n)])
            builder.store(one, builder.bitcast(place, one.type.as_pointer()))


def common(triple: str, layout: str, sources: str, table: str) -> ir.Module:
    """Module that every library has once: the entry to users' functions, the size of the head of a
    Python object, the hash of the sources, the table of entries as JSON.

    The host sets the pointer of the door; a call where it is null does nothing.
    """
    module = ir.Module("common")
    module.triple, module.data_layout = triple, layout
    kind = ir.FunctionType(ir.VoidType(), [I64] * 6)
    pointer = ir.GlobalVariable(module, kind.as_pointer(), "mbody_user_door")
    pointer.initializer = ir.Constant(kind.as_pointer(), None)
    head = ir.GlobalVariable(module, I64, HEAD)
    head.initializer = ir.Constant(I64, 16)
    for name, text in (("mbody_sources", sources), ("mbody_entries", table)):
        data = bytearray(text.encode() + b"\0")
        constant = ir.GlobalVariable(module, ir.ArrayType(I8, len(data)), name)
        constant.initializer = ir.Constant(ir.ArrayType(I8, len(data)), data)
        constant.global_constant = True
    function = ir.Function(module, kind, SYMBOL)
    builder = ir.IRBuilder(function.append_basic_block())
    found = builder.load(pointer)
    there = builder.icmp_unsigned("!=", builder.ptrtoint(found, I64), ir.Constant(I64, 0))
    with builder.if_then(there):
        builder.call(found, function.args)
    builder.ret_void()
    return module

"""Hand a named tuple of arrays from kernel to kernel by its address.

Numba passes a named tuple to a function as all the numbers of all its arrays: seven hundred for the
tuples of the core, at every call. A kernel puts each of its tuples on its own stack once,
``L = by_reference(L)``, and then calls compiled functions with one pointer; inside them
``L.field`` reads as before. So the functions of the core need not be copied into every caller,
which is what their compilation time depends on.

In plain Python ``by_reference`` gives the tuple itself.
"""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False
# mypy: disallow-untyped-decorators=False, disallow-untyped-calls=False

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)

from mbody._jit import PLAIN

__all__ = ["by_reference"]


class Reference(types.Type):
    """Pointer to a named tuple that lives on the stack of a kernel."""

    def __init__(self, target: Any) -> None:
        self.target = target
        super().__init__(f"Reference({target})")

    @property
    def key(self) -> Any:
        """What makes two types of references the same."""
        return self.target


@register_model(Reference)
class ReferenceModel(models.PrimitiveModel):
    """A plain pointer."""

    def __init__(self, manager: Any, kind: Reference) -> None:
        value = manager.lookup(kind.target).get_value_type()
        super().__init__(manager, kind, value.as_pointer())


@intrinsic
def _on_stack(typing_context: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return cgutils.alloca_once_value(builder, arguments[0])

    return Reference(value)(value), generate


@infer_getattr
class ReferenceAttributes(AttributeTemplate):
    """Fields of the tuple behind a reference."""

    key = Reference

    def generic_resolve(  # type: ignore[override]  # numba has NotImplemented in its place
        self, reference: Reference, name: str
    ) -> Any:
        """Type of a field."""
        if name in reference.target.fields:
            return reference.target.types[reference.target.fields.index(name)]
        return None


@lower_getattr_generic(Reference)
def _read_field(context: Any, builder: Any, kind: Reference, value: Any, name: str) -> Any:
    n = kind.target.fields.index(name)
    field = cgutils.gep_inbounds(builder, value, 0, n)
    return impl_ret_borrowed(context, builder, kind.target.types[n], _leaves(builder, field))


def _leaves(builder: Any, pointer: Any) -> Any:
    """Load a struct part by part, so that the parts that nobody asks for vanish."""
    pointee = pointer.type.pointee
    if not isinstance(pointee, (ir.LiteralStructType, ir.ArrayType)):
        return builder.load(pointer)
    value = ir.Constant(pointee, ir.Undefined)
    count = pointee.count if isinstance(pointee, ir.ArrayType) else len(pointee.elements)
    for n in range(count):
        part = cgutils.gep_inbounds(builder, pointer, 0, n)
        value = builder.insert_value(value, _leaves(builder, part), n)
    return value


if TYPE_CHECKING or PLAIN:

    def by_reference(value: Any) -> Any:
        """The tuple itself."""
        return value

else:
    by_reference = _on_stack

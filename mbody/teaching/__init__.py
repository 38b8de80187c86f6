"""Teaching: the equations of a mechanism in symbols and with numbers, and what elements are."""

from mbody.teaching.derivation import FORMS, Derivation, derivation, derivation_as
from mbody.teaching.element_reference import (
    ElementReference,
    FieldReference,
    element_reference,
    reference_overview,
)

__all__ = [
    "FORMS",
    "Derivation",
    "ElementReference",
    "FieldReference",
    "derivation",
    "derivation_as",
    "element_reference",
    "reference_overview",
]

"""Teaching: equations in symbols and with numbers, what elements are, files to begin with."""

from mbody.teaching.derivation import FORMS, Derivation, derivation, derivation_as
from mbody.teaching.element_reference import (
    ElementReference,
    FieldReference,
    element_reference,
    reference_overview,
)
from mbody.teaching.new_model import KINDS, new_model

__all__ = [
    "FORMS",
    "Derivation",
    "ElementReference",
    "FieldReference",
    "KINDS",
    "derivation",
    "derivation_as",
    "element_reference",
    "new_model",
    "reference_overview",
]

"""Teaching: equations with numbers, what elements are, files to begin with, exercises."""

from mbody.teaching.derivation import FORMS, Derivation, derivation, derivation_as
from mbody.teaching.element_reference import (
    ElementReference,
    FieldReference,
    element_reference,
    reference_overview,
)
from mbody.teaching.exercises import Exercise, ExerciseSheet, exercises, least_transmission
from mbody.teaching.new_model import KINDS, new_model

__all__ = [
    "Derivation", "ElementReference", "Exercise", "ExerciseSheet", "FORMS", "FieldReference",
    "KINDS", "derivation", "derivation_as", "element_reference", "exercises", "least_transmission",
    "new_model", "reference_overview",
]  # fmt: skip

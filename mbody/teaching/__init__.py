"""Teaching: equations with numbers, what elements are, files to begin with, exercises."""

from mbody.teaching.derivation import FORMS, Derivation, derivation, derivation_as
from mbody.teaching.exercises import (
    KINDS,
    ElementReference,
    Exercise,
    ExerciseSheet,
    FieldReference,
    element_reference,
    exercises,
    least_transmission,
    new_model,
    reference_overview,
)

__all__ = [
    "Derivation", "ElementReference", "Exercise", "ExerciseSheet", "FORMS", "FieldReference",
    "KINDS", "derivation", "derivation_as", "element_reference", "exercises", "least_transmission",
    "new_model", "reference_overview",
]  # fmt: skip

"""Teaching: the equations of a mechanism in symbols and with numbers."""

from mbody.teaching.derivation import FORMS, Derivation, derivation, derivation_as

__all__ = ["FORMS", "Derivation", "derivation", "derivation_as"]

"""Model files: TOML and JSON that read like the book's "Given" paragraph."""

from mbody.io.model.convert import in_units
from mbody.io.model.limits import Limits
from mbody.io.model.read import from_text, load
from mbody.io.model.schema import json_schema
from mbody.io.model.write import save, to_text

__all__ = ["Limits", "to_text", "in_units", "json_schema", "load", "from_text", "save"]

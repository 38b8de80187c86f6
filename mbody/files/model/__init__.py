"""Model files: TOML and JSON that read like the book's "Given" paragraph."""

from mbody.files.model.other_units import in_units
from mbody.files.model.problems import Limits
from mbody.files.model.read import from_toml, load
from mbody.files.model.schema import json_schema
from mbody.files.model.study_tables import ReportSettings, report_settings
from mbody.files.model.write import save, to_toml

__all__ = [
    "Limits",
    "ReportSettings",
    "from_toml",
    "in_units",
    "json_schema",
    "load",
    "report_settings",
    "save",
    "to_toml",
]

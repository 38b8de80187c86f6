"""Model files: TOML and JSON that read like the book's "Given" paragraph.

Who reads a file needs no writer: what stands behind a name is loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from mbody.files.model.other_units import in_units
    from mbody.files.model.problems import Limits
    from mbody.files.model.read import from_toml, load
    from mbody.files.model.schema import json_schema
    from mbody.files.model.study_tables import ReportSettings, report_settings
    from mbody.files.model.write import save, to_toml

__all__ = [
    "Limits", "ReportSettings", "from_toml", "in_units", "json_schema", "load", "report_settings",
    "save", "to_toml",
]  # fmt: skip

_MODULES = {
    "other_units": "in_units",
    "problems": "Limits",
    "read": "from_toml load",
    "schema": "json_schema",
    "study_tables": "ReportSettings report_settings",
    "write": "save to_toml",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}

if not TYPE_CHECKING:  # a type checker would take every name for one of these

    def __getattr__(name: str) -> Any:
        if name not in _MODULE_OF:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
        value = getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
        globals()[name] = value
        return value

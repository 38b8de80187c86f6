"""Build hook: a wheel of one platform with its libraries of kernels, or a pure wheel without.

``MBODY_WHEEL`` names the tag of the platform, such as ``manylinux_2_17_x86_64``; its libraries are
those in ``mbody/core_libraries``, made by ``mbody compile``. Without it the wheel is pure: kernels
run by numba where it is installed, else in plain Python. The core for browsers and
the binaries of co-simulation units are in every wheel.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

#: Beginning of the names of the libraries, by the beginning of the tag.
SYSTEMS = {"manylinux": "linux-", "win": "windows-", "macosx": "macos-"}


# hatchling is there only where a wheel is built, so that to mypy its class is of any type
class Libraries(BuildHookInterface):  # type: ignore[misc]
    """Adds the libraries, and says which platform the wheel is for."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds the built libraries to a wheel, as hatchling calls it."""
        if version == "editable":
            return
        folder = Path(self.root) / "mbody" / "core_libraries"
        inside = build_data["force_include"]
        for file in (*folder.glob("*.wasm"), *folder.glob("*.fmu.*")):
            inside[str(file)] = f"mbody/core_libraries/{file.name}"
        tag = os.environ.get("MBODY_WHEEL")
        if not tag:
            return
        system = next(name for start, name in SYSTEMS.items() if tag.startswith(start))
        machine = "aarch64" if tag.endswith("aarch64") else "x86-64" if "86" in tag else ""
        files = sorted(folder.glob(f"{system}*{machine}*"))
        if not files:
            raise FileNotFoundError(f"{folder} has no libraries for {tag}: run mbody compile first")
        for file in files:
            inside[str(file)] = f"mbody/core_libraries/{file.name}"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{tag}"

"""`mbody compile`: libraries of all kernels, for wheels and for programs without Python."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["all_kernels", "compile_libraries"]


def all_kernels() -> dict[str, Callable[..., Any]]:
    """Every kernel of mbody, by its name."""
    import pkgutil
    from importlib import import_module

    import mbody.kernels
    import mbody.laws.kernels
    from mbody.core.interface import KERNELS

    for module in pkgutil.iter_modules(mbody.kernels.__path__):
        import_module(f"mbody.kernels.{module.name}")
    return KERNELS


def compile_libraries(args: Any) -> int:
    """Build one library for each target."""
    from importlib.util import find_spec

    from mbody.core import registered
    from mbody.core.sources import PACKAGE, source_hash
    from mbody.errors import ModelError

    if find_spec("numba") is None:
        raise ModelError(
            "libraries are built by numba, which is not installed: pip install 'mbody[jit]'"
        )
    kernels = all_kernels()
    names = [f"{one.__module__}:{name}" for name, one in sorted(kernels.items())]
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]))
    settings = os.environ | {"MBODY_CORE": "numba", "MBODY_QUIET": "1", "PYTHONPATH": path}
    folder = Path(args.out)
    first, *others = args.target or ["host"]
    command = [sys.executable, "-m", registered.builder, "--target", first, "--whole"]
    for other in others:
        command += ["--also", other]
    command += ["--out", str(folder), "--sources", source_hash() or "", *names]
    return subprocess.run(command, env=settings).returncode

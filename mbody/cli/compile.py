"""`mbody compile`: libraries of all kernels, for wheels and for programs without Python."""

from __future__ import annotations

import subprocess
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

    from mbody.core.native import builder_command, place
    from mbody.errors import ModelError

    if find_spec("numba") is None:
        raise ModelError(
            "libraries are built by numba, which is not installed: pip install 'mbody[jit]'"
        )
    names = [place(one) for _, one in sorted(all_kernels().items())]
    first, *others = args.target or ["host"]
    also = [word for other in others for word in ("--also", other)]
    command, settings = builder_command(names, first, Path(args.out), "--whole", *also)
    return subprocess.run(command, env=settings).returncode

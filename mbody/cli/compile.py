"""`mbody compile`: libraries of all kernels for wheels, the kernels of images for programs without
Python, and the binary of co-simulation units.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["IMAGE_KERNELS", "all_kernels", "compile_libraries"]

#: What images call (`mbody.image`): a fourth of all kernels.
IMAGE_KERNELS = (
    "begin_motion",
    "close_at",
    "follow",
    "measures",
    "runge_kutta",
    "set_numbers",
)
#: How programs without Python open images; what makes a unit of co-simulation of them.
DOOR, UNIT = ("mbody.h", "mbody.c"), "fmi2.c"


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
    """Build a library for each target; with ``--images`` an object file of the kernels that images
    call, and with ``--fmu`` the binary of co-simulation units. ``mbody.h`` and ``mbody.c``, by
    which C programs open images, are put beside.
    """
    import shutil
    from importlib.util import find_spec

    from mbody.core.native import builder_command, place
    from mbody.core.sources import PACKAGE
    from mbody.errors import ModelError

    if find_spec("numba") is None:
        raise ModelError(
            "libraries are built by numba, which is not installed: pip install 'mbody[jit]'"
        )
    kernels, door = all_kernels(), PACKAGE / "image" / "c"
    chosen = IMAGE_KERNELS if args.images or args.fmu else sorted(kernels)
    names = [place(kernels[name]) for name in chosen]
    first, *others = args.target or ["host"]
    options = [word for other in others for word in ("--also", other)]
    if args.fmu:
        options += ["--with", str(door / DOOR[1]), "--with", str(door / UNIT)]
    elif args.images:
        options.append("--object")
    command, settings = builder_command(names, first, Path(args.out), "--whole", *options)
    status = subprocess.run(command, env=settings).returncode
    if status == 0 and not args.fmu:
        for name in DOOR:
            shutil.copyfile(door / name, Path(args.out) / name)
    return status

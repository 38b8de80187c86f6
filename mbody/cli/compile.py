"""`mbody compile`: libraries of all kernels for wheels, the kernels of images for programs without
Python and for browsers, and the binary of co-simulation units.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["DOOR", "all_kernels", "compile_libraries"]

#: How programs without Python open images.
DOOR = ("mbody.h", "mbody.c")


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
    """Build what the arguments name; its status."""
    from importlib.util import find_spec

    from mbody.errors import ModelError
    from mbody.image.webassembly import TARGET

    if find_spec("numba") is None:
        raise ModelError(
            "libraries are built by numba, which is not installed: pip install 'mbody[jit]'"
        )
    targets = args.target or ["host"]
    machines = [one for one in targets if one != TARGET]
    status = _for_machines(args, machines) if machines else 0
    if status == 0 and TARGET in targets:
        _for_browsers(Path(args.out))
    return status


def _for_machines(args: Any, targets: list[str]) -> int:
    """A library for each target; with ``--images`` an object file of the kernels that images call,
    and with ``--fmu`` the binary of co-simulation units. ``mbody.h`` and ``mbody.c``, by which C
    programs open images, are put beside.
    """
    import shutil

    from mbody.core.native import builder_command, place
    from mbody.image.fmu_binaries import SHELL, SOURCES
    from mbody.image.image_kernels import IMAGE_KERNELS

    chosen: Any = IMAGE_KERNELS
    if not (args.images or args.fmu):
        chosen = [one for _, one in sorted(all_kernels().items())]
    first, *others = targets
    options = [word for other in others for word in ("--also", other)]
    if args.fmu:
        options += [word for name in SOURCES for word in ("--with", str(SHELL / name))]
    elif args.images:
        options.append("--object")
    names = [place(one) for one in chosen]
    command, settings = builder_command(names, first, Path(args.out), "--whole", *options)
    status = subprocess.run(command, env=settings).returncode
    if status == 0 and not args.fmu:
        for name in DOOR:
            shutil.copyfile(SHELL / name, Path(args.out) / name)
    return status


def _for_browsers(out: Path) -> None:
    """The kernels that images call as WebAssembly: a file, or in a folder; the ES module that loads
    it is put beside.
    """
    import shutil
    import tempfile

    from mbody.image.webassembly import FILE, MODULE, build_browser_core

    file = out if out.suffix == Path(FILE).suffix else out / FILE
    file.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        build_browser_core(Path(folder))
        (Path(folder) / FILE).replace(file)
    shutil.copyfile(MODULE, file.parent / MODULE.name)

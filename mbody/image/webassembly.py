"""The compiled core for browsers: WebAssembly of the package, or built once on this machine."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from mbody.core.cache_folder import STAMP_DIGITS, cache_folder
from mbody.core.native import builder_command, builder_fails, place, progress
from mbody.core.sources import PACKAGE, source_hash
from mbody.errors import ModelError
from mbody.kernels.advance import advance_motion
from mbody.kernels.continuation import follow
from mbody.kernels.image_calls import begin_motion, close_at
from mbody.kernels.number_program import measures, set_numbers
from mbody.kernels.runge_kutta import runge_kutta

# -- The kernels that images call: a fourth of all ---------------------------------------------

IMAGE_KERNELS = (
    set_numbers,
    measures,
    close_at,
    follow,
    begin_motion,
    runge_kutta,
    advance_motion,
)


#: Name of the target of the compiler.
TARGET = "wasm32"
#: Name of the core for browsers, in the package and beside it.
FILE = "mbody.wasm"
#: The ES module that loads it.
MODULE = Path(__file__).parent / "browser" / "mbody.mjs"


def browser_core() -> Path:
    """The file of the core for browsers, built where neither the package nor the cache has it."""
    ready = ready_core()
    if ready is not None:
        return ready
    folder = _core_folder()
    if folder is None:
        raise ModelError(
            "the core for browsers has to be built, and no folder to keep it can be written: set "
            "MBODY_CACHE_DIR"
        )
    steps = len(IMAGE_KERNELS) + 1  # the last one is the file itself
    build_browser_core(folder, progress("the core for browsers", steps))
    return folder / FILE


def ready_core() -> Path | None:
    """The file of the core for browsers where the package or the cache has it."""
    sources, folder = source_hash() or "", _core_folder()
    places = [PACKAGE / "core_libraries" / FILE, *([] if folder is None else [folder / FILE])]
    return next((one for one in places if one.exists() and made_from(one, sources)), None)


def _core_folder() -> Path | None:
    """The folder of the cache for this core."""
    stamp = hashlib.sha256(f"{TARGET} {source_hash() or ''}".encode()).hexdigest()[:STAMP_DIGITS]
    return cache_folder(stamp)


def build_browser_core(folder: Path, say: Callable[[str], None] | None = None) -> None:
    """Build the core for browsers into a folder; `say` gets the name of each step."""
    missing = [name for name in ("numba", "ziglang") if find_spec(name) is None]
    if missing:
        raise ModelError(
            "the core for browsers is built by numba and ziglang, not all of which are installed: "
            f"pip install {' '.join(missing)}"
        )
    names = [place(kernel) for kernel in IMAGE_KERNELS]
    command, settings = builder_command(names, TARGET, folder, "--whole")
    last = builder_fails(command, settings, say)
    if last is not None:
        raise ModelError(f"the core for browsers could not be built; the builder said:\n{last}")


def made_from(file: Path, sources: str) -> bool:
    """Whether a core was made from these sources; their hash is among its data."""
    return bool(sources) and sources.encode() in file.read_bytes()

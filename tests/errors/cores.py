"""The choice of the core that runs the kernels."""

from pathlib import Path
from types import SimpleNamespace
from unittest import mock

from mbody.cli.compile import compile_libraries
from mbody.core import selection
from mbody.core import selection as library


def chosen(patches=(), **settings):
    """The choice anew where parts of the machine are others."""

    def go():
        names = ("MBODY_CORE", "MBODY_CORE_LEVEL", "NUMBA_DISABLE_JIT")
        with mock.patch.dict("os.environ", {name: settings.get(name, "") for name in names}):
            entered = [mock.patch.object(*patch) for patch in (CLONE, *patches)]
            for patch in entered:
                patch.start()
            try:
                selection.chosen.__wrapped__()
            finally:
                for patch in entered:
                    patch.stop()

    return go


def levels(name, *features):
    """The levels of an old processor."""

    def go():
        linux = mock.patch.object(library.sys, "platform", "linux")
        machine = mock.patch.object(library.platform, "machine", lambda: "x86_64")
        old = mock.patch.object(library, "processor_features", lambda: frozenset(features))
        with mock.patch.dict("os.environ", MBODY_CORE_LEVEL=name), linux, machine, old:
            list(library.best_levels())

    return go


def without_numba():
    with mock.patch("importlib.util.find_spec", lambda name: None):
        compile_libraries(SimpleNamespace(target=None, out=".", images=False, fmu=False))


CLONE = (selection, "PACKAGE", Path("nowhere"))
NO_LINKER = (selection, "linker", lambda: None)
NO_PACKAGE = (selection, "find_spec", lambda name: None)
NAMESAKE = (selection, "namesake", lambda: selection.NAMESAKE.format("0.1.0", "lib"))

SCENARIOS = {
    "a core that is not there": chosen(MBODY_CORE="fast"),
    "a core that cannot run": chosen([NO_LINKER], MBODY_CORE="native"),
    "no core but plain Python": chosen([NO_PACKAGE]),
    "a level that is not there": levels("x86-64-v9"),
    "a level that the processor has not": levels("x86-64-v3", "SSE42"),
    "libraries without numba": without_numba,
    "another project of the same name": chosen([NAMESAKE], MBODY_CORE="plain"),
}

SENTENCES = r"""
a core that is not there | ModelError | - | MBODY_CORE=fast is none of the cores native, numba, plain: set one of them
a core that cannot run | ModelError | - | MBODY_CORE=native, but that core cannot run here: the package has no libraries; no C compiler (cc) links it
no core but plain Python | ModelWarning | - | mbody runs in plain Python, some thousand times slower (the package has no libraries; numba, which builds it, is not installed; numba is not installed): install a wheel with libraries for this machine, or numba (pip install mbody-planar[jit])
a level that is not there | ModelError | - | MBODY_CORE_LEVEL=x86-64-v9 is none of the levels host, x86-64-v4, x86-64-v3, x86-64-v2, aarch64, arm64
a level that the processor has not | ModelError | - | MBODY_CORE_LEVEL=x86-64-v3, but this processor has no AVX2, FMA3: choose a lower level
libraries without numba | ModelError | - | libraries are built by numba, which is not installed: pip install 'mbody-planar[jit]'
another project of the same name | ModelWarning | - | a distribution 'mbody' 0.1.0 is installed in lib: on the public index this name is another project, and both have the import name mbody; this one is 'mbody-planar': pip uninstall mbody, then install mbody-planar again
"""

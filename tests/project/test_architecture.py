"""Imports run one way, and files stay short. The sources are parsed, so that nothing can hide."""

import ast
import functools
import subprocess
import sys

import pytest

import mbody
from mbody.core.selection import COMPILED
from tests.architecture import (
    PACKAGE,
    ROOT,
    arrows,
    between_folders,
    circles,
    folder_of,
    imports,
    module_of,
    sources,
    upward,
    within,
)

# Some folders may reach less than their layer allows: these imports and their own folder only.
PLAIN = {"__future__", "collections.abc", "functools", "math", "numpy", "typing"}
SHARED = {
    *("core", "errors", "laws", "model.driver", "model.element", "model.primitives"),
    *("model.element", "model.primitives", "model.driver"),
    *("quantities.formula",),
}
PHYSICS = PLAIN | {"dataclasses"} | {f"mbody.{name}" for name in SHARED}
ONLY = {
    "mbody.model.joints": PHYSICS,
    "mbody.model.loads": PHYSICS,
    "mbody.kernels": PLAIN
    | {
        f"mbody.{name}"
        for name in ("core", "laws", "model.joints", "model.loads", "model.primitives")
    },
}

COMPILER = {"numba", "llvmlite"}
BUILDERS = [
    "mbody.compiler",
    *(
        f"mbody.straight_line.{name}"
        for name in ("code_builder", "compiled_functions", "whole_function")
    ),
]
HEAVY = {
    *("matplotlib", "mujoco", "pandas", "scipy", "pint", "pymunk", "pinocchio"),
    *("distributed", "pyarrow"),
}
LONGEST = 1200
LOOSE = {"__init__.py", "__main__.py", "_version.py", "errors.py", "makers.py"}


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    return sources()


def report(found: list[str]) -> None:
    assert not found, "\n" + "\n".join(found)


# -- the package ------------------------------------------------------------------------------


def complaints(path: str, source: str) -> list[str]:
    """Every forbidden import of one file, `path` relative to the root, as sentences."""
    found = []
    for one in imports(path, source):
        reason = upward(one)
        home = next((name for name in ONLY if within(module_of(path), [name])), "")
        if home and not within(one.target, ONLY[home] | {home}):
            reason = f"{home} may import its own folder and the short list in ONLY, no more"
        if within(one.target, COMPILER) and not within(module_of(path), BUILDERS):
            reason = "numba is for those alone who build machine code"
        if one.at_load and within(one.target, HEAVY):
            reason = "too heavy to load with mbody: import it inside the function that needs it"
        if reason:
            found.append(f"{path}:{one.line}: {one.target}: {reason}")
    return found


@pytest.mark.slow
def test_imports_run_one_way(files):
    report([text for path, source in files.items() for text in complaints(path, source)])


def test_imports_close_no_circle(files):
    report([" ↔ ".join(ring) for ring in circles(arrows(files))])
    report([" ↔ ".join(ring) for ring in circles(between_folders(files))])


def test_every_folder_has_a_layer(files):
    report(
        [
            f"{path}: give its folder a layer in tests/architecture.py"
            for path in files
            if folder_of(module_of(path)) == "__init__" and path != "mbody/__init__.py"
        ]
    )


def test_nothing_is_loose_at_the_top():
    assert {file.name for file in PACKAGE.glob("*.py")} == LOOSE


def test_no_folder_bears_the_name_of_a_public_function(files):
    """Importing a folder would overwrite the function."""
    functions = {name for name in mbody.__all__ if callable(getattr(mbody, name))}
    folders = {part for path in files for part in path.split("/")[1:-1]}
    assert not functions & folders


def test_files_stay_short(files):
    lengths = {path: len(source.splitlines()) for path, source in files.items()}
    report([f"{path}: {n} lines, at most {LONGEST}" for path, n in lengths.items() if n > LONGEST])


@functools.cache
def compiled(source: str) -> list[tuple[ast.FunctionDef, set[str]]]:
    """Each function that is compiled, and the names that it reads."""
    return [
        (node, {part.id for part in ast.walk(node) if isinstance(part, ast.Name)})
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
        and any(
            ast.unparse(part).split("(")[0] in ("kernel", "njit", "inline", "overload")
            for part in node.decorator_list
        )
    ]


def stale(path: str, source: str, stamped: set[str]) -> list[str]:
    """Compiled functions that an edit would change without changing the name of the cache."""
    found = []
    outside = {
        one.target.rpartition(".")[2]: one.target
        for one in imports(path, source)
        if within(one.target, {"mbody"})
        and not {
            f"{part.replace('.', '/')}.py" for part in (one.target, one.target.rpartition(".")[0])
        }
        & stamped
    }
    for function, names in compiled(source):
        where = f"{path}:{function.lineno}: {function.name}"
        if path not in stamped:
            found.append(f"{where}: compiled, but not in COMPILED of core/selection.py")
        found += [f"{where}: reads {outside[name]}, not in COMPILED" for name in names & {*outside}]
    return found


def test_the_cache_is_filed_under_all_that_is_compiled(files):
    stamped = {
        f"mbody/{file.relative_to(PACKAGE).as_posix()}"
        for part in COMPILED
        for file in PACKAGE.glob(part)
    }
    assert sum(len(compiled(source)) for source in files.values()) > 100
    report([text for path, source in files.items() for text in stale(path, source, stamped)])
    source = "from mbody.model.body import deg\n@njit\ndef f(x): return deg(x)\n"
    assert len(stale("mbody/kernels/a.py", source, {"mbody/kernels/a.py"})) == 1
    assert len(stale("mbody/analysis/a.py", source, stamped)) == 2


#: Small numbers that are no tolerances: π in pieces, the radius of a point in MuJoCo.
SIZES = {"mbody/compiler/numba_lanes.py", "mbody/engines/mjcf_contacts.py"}


def small_constants(source: str) -> list[str]:
    """Constants of a module below 1e-5 that are written as numbers."""
    found = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            names, values = (target.elts, value.elts) if both else ([target], [value])
            found += [
                f"{node.lineno}: {ast.unparse(name)}"
                for name, number in zip(names, values, strict=True)
                if isinstance(number, ast.Constant)
                and isinstance(number.value, float)
                and 0.0 < number.value <= 1e-5
            ]
    return found


def test_tolerances_stand_in_one_file(files):
    home = "mbody/core/tolerances.py"
    report(
        [
            f"{path}:{one}: a tolerance belongs into {home}"
            for path, source in files.items()
            if path not in {home, *SIZES}
            for one in small_constants(source)
        ]
    )
    assert not [one for one in imports(home, files[home]) if one.target != "__future__.annotations"]
    assert len(small_constants(files[home])) > 300
    assert small_constants("MOST, ZERO = 3, 1e-9") == ["1: ZERO"]


def test_import_mbody_loads_nothing_heavy():
    code = "import sys; had = {*sys.modules}; import mbody; print(*{*sys.modules} - had)"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    loaded = sorted(name for name in run.stdout.split() if within(name, HEAVY | COMPILER))
    assert not loaded, loaded


# -- the checker itself -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "source", "arrow"),
    [
        (
            "model/joints/a.py",
            "import numpy\nfrom mbody.model.mechanism import M",
            "2: mbody.model",
        ),
        ("model/joints/a.py", "from mbody.model.loads.spring import S", "1: mbody.model.loads"),
        ("model/joints/a.py", "from mbody import Mechanism", "1: mbody.Mechanism"),
        ("model/loads/a.py", "import os", "1: os"),
        ("model/loads/a.py", "def f():\n    from .. import body", "2: mbody.model.body"),
        ("kernels/a.py", "from ..model.body import Body", "1: mbody.model.body.Body"),
        ("model/mechanism.py", "def f():\n    import mbody.system.assembler", "2: mbody.system"),
        (
            "errors.py",
            "if TYPE_CHECKING:\n    from mbody.solution.solution import S",
            "2: mbody.sol",
        ),
        ("errors.py", 'HOME = "mbody.solution.solution"', "1: mbody.solution.solution"),
        ("makers/a.py", "from mbody.cli import main", "1: mbody.cli.main"),
        ("views/a.py", "from mbody.engines import oracle", "1: mbody.engines.oracle"),
        ("views/a.py", "try:\n    import scipy.linalg\nexcept ImportError: ...", "2: scipy"),
        ("solution/a.py", "import mbody", "1: mbody"),
        ("analysis/driven/a.py", "from mbody.analysis.inverse import roots", "1: mbody.analysis"),
    ],
)
def test_the_checker_catches(path, source, arrow):
    (found,) = complaints(f"mbody/{path}", source)
    assert found.startswith(f"mbody/{path}:{arrow}")


def test_the_checker_catches_a_circle():
    ring = {
        "mbody/kernels/a.py": "from . import b",
        "mbody/kernels/b.py": "\nif TYPE_CHECKING:\n    from mbody.kernels.a import f",
    }
    assert circles(arrows(ring)) == [sorted(ring)]

"""Imports go one way. The sources are parsed, not imported, so a forbidden arrow cannot hide."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

from mbody.compiler import cache

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "mbody"

# Lowest first. A unit is a module or a folder directly below mbody/.
LAYERS = (
    {
        "_version",
        "_stop",
        "errors",
        "doubts",
        "read_only",
        "_cache",
        "_inner",
        "_jit",
        "_user",
        "_lanes_type",
        "_lanes",
        "_bundle",
        "_geometry",
    },
    {"units"},
    {"formulas"},
    {"laws"},
    {"primitives", "elements"},
    {"bodies", "hooks", "own_code"},
    {"joints", "loads", "drivers", "couplings"},
    {"core", "elimination", "groups", "histories"},
    {"square"},
    {"questions", "events", "simulation", "resolution", "compared"},
    {"mechanism"},
    {"named", "remarks", "system"},
    {
        *("assembler", "ends", "energy", "checks", "certify", "load_histories", "momenta"),
        "restart",
    },
    {"solution"},
    {"measures"},
    {"analysis"},
    {"io"},
    {"gallery", "makers", "testing", "views", "bridges", "engineering", "sweeps"},
    {"cli", "__main__", "__init__"},
)
LEVEL = {unit: level for level, units in enumerate(LAYERS) for unit in units}
FOLDERS = {
    *("laws", "joints", "loads", "core", "analysis", "views", "bridges", "io", "engineering"),
    "sweeps",
}

# Some units may reach less than their layer allows: these imports and their own folder only.
PLAIN = {"__future__", "collections.abc", "functools", "math", "numpy", "typing"}
SHARED = {"_geometry", "_jit", "_lanes", "primitives", "elements", "errors", "laws", "own_code"}
KERNELS = {"_jit", "_lanes", "_bundle", "_user", "laws", "joints", "loads"}
PHYSICS = PLAIN | {"dataclasses"} | {f"mbody.{unit}" for unit in SHARED}
ONLY = {
    "joints": PHYSICS,
    "loads": PHYSICS,
    "core": PLAIN | {f"mbody.{unit}" for unit in KERNELS},
}
CEILING = {"makers": LEVEL["mechanism"]}

# `print(run)` and `run.to_csv()` are asked of a solution, `print(report)` of an analysis, but how a
# result looks is told in io: the arrows upwards, taken only when they are asked for.
WHEN_ASKED = {("solution", "io"), ("analysis", "io"), ("solution", "measures")}

HEAVY = {
    *("matplotlib", "mujoco", "pandas", "scipy", "pint", "pymunk", "pinocchio"),
    *("distributed", "pyarrow"),
}
LONGEST = 500


# -- reading the sources ----------------------------------------------------------------------


def statements(
    node: ast.AST, in_function: bool = False
) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Each run-time import below `node`, and whether it waits inside a function."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        yield node, in_function
        return
    in_function |= isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    children = ast.iter_child_nodes(node)
    if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
        children = iter(node.orelse)
    for child in children:
        yield from statements(child, in_function)


def imports(path: str, source: str) -> Iterator[tuple[int, str, bool]]:
    """Line, absolute dotted target, and whether the import waits inside a function."""
    for node, in_function in statements(ast.parse(source, path)):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        else:
            above = path.split("/")[: -node.level] if node.level else []
            base = [*above, node.module] if node.module else above
            targets = [".".join([*base, alias.name]) for alias in node.names]
        for target in targets:
            yield node.lineno, target, in_function


def unit_of(target: str) -> str:
    """The unit that a target belongs to; mbody and what it re-exports are its front door."""
    head = target.split(".")[1:2]
    return head[0] if head and head[0] in LEVEL else "__init__"


def within(target: str, names: set[str]) -> bool:
    return any(target == name or target.startswith(name + ".") for name in names)


# -- the rules --------------------------------------------------------------------------------


def complaints(path: str, source: str) -> list[str]:
    """Every forbidden arrow out of one file, `path` relative to the root, as sentences."""
    unit = path.split("/")[1].removesuffix(".py")
    if unit not in LEVEL:
        return [f"{path}:1: {unit} has no layer: give it one in {Path(__file__).name}"]
    found = []
    for line, target, in_function in imports(path, source):
        reason = forbidden(unit, target, in_function)
        if reason:
            found.append(f"{path}:{line}: {unit} → {target}: {reason}")
    return found


def forbidden(unit: str, target: str, in_function: bool) -> str:
    """Why `unit` may not import `target`; empty if it may."""
    inside = within(target, {"mbody"})
    other = unit_of(target) if inside else ""
    if within(target, HEAVY) and not in_function:
        return "too heavy to load with mbody: import it inside the function that needs it"
    if inside and (other == unit or (in_function and (unit, other) in WHEN_ASKED)):
        return ""
    if unit in ONLY and not within(target, ONLY[unit]):
        return f"{unit} may import its own folder and the short list in ONLY, no more"
    if not inside:
        return ""
    if LEVEL[other] > CEILING.get(unit, LEVEL[unit]):
        return f"{other} lies above"
    if LEVEL[other] == LEVEL[unit] and FOLDERS & {unit, other}:
        return f"{other} lies beside, in another folder"
    return ""


def cycle(sources: dict[str, str]) -> list[str]:
    """One ring of imports among the files, arrow by arrow, or nothing."""
    files = {
        path.removesuffix(".py").replace("/", ".").removesuffix(".__init__"): path
        for path in sources
    }
    lines: dict[tuple[str, str], int] = {}
    for path, source in sources.items():
        unit = path.split("/")[1].removesuffix(".py")
        for line, target, in_function in imports(path, source):
            if in_function and (unit, unit_of(target)) in WHEN_ASKED:
                continue
            while target and target not in files:
                target = target.rpartition(".")[0]
            if target and files[target] != path:
                lines.setdefault((path, files[target]), line)
    graph: dict[str, set[str]] = {path: set() for path in sources}
    for importer, imported in lines:
        graph[importer].add(imported)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        ring = error.args[1][::-1]
        return [f"{a}:{lines[a, b]}: {a} → {b}: closes a ring" for a, b in pairwise(ring)]
    return []


# -- the package ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sources() -> dict[str, str]:
    files = sorted(PACKAGE.rglob("*.py"))
    return {file.relative_to(ROOT).as_posix(): file.read_text("utf-8") for file in files}


def report(found: list[str]) -> None:
    assert not found, "\n" + "\n".join(found)


def test_imports_go_one_way(sources):
    report([text for path, source in sources.items() for text in complaints(path, source)])


def test_imports_form_no_ring(sources):
    report(cycle(sources))


def test_files_stay_short(sources):
    lengths = {path: len(source.splitlines()) for path, source in sources.items()}
    report([f"{path}: {n} lines, at most {LONGEST}" for path, n in lengths.items() if n > LONGEST])


def compiled(source: str) -> Iterator[tuple[ast.FunctionDef, set[str]]]:
    """Each function that is compiled, and the names that it reads."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and any(
            ast.unparse(part).split("(")[0] in ("njit", "inline", "overload", "intrinsic")
            for part in node.decorator_list
        ):
            yield node, {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}


def stale(path: str, source: str, stamped: set[str]) -> list[str]:
    """Compiled functions that an edit would change without changing the name of the cache."""
    found = []
    outside = {
        target.rpartition(".")[2]: target
        for _, target, _ in imports(path, source)
        if within(target, {"mbody"})
        and not {f"{part.replace('.', '/')}.py" for part in (target, target.rpartition(".")[0])}
        & stamped
    }
    for function, names in compiled(source):
        where = f"{path}:{function.lineno}: {function.name}"
        if path not in stamped:
            found.append(f"{where}: compiled, but not in COMPILED of _cache.py")
        found += [f"{where}: reads {outside[name]}, not in COMPILED" for name in names & {*outside}]
    return found


def test_the_cache_is_filed_under_all_that_is_compiled(sources):
    stamped = {f"mbody/{file.relative_to(PACKAGE).as_posix()}" for file in cache._sources()}
    assert sum(len(list(compiled(source))) for source in sources.values()) > 100
    report([text for path, source in sources.items() for text in stale(path, source, stamped)])
    source = "from mbody.model.body import deg\n@njit\ndef f(x): return deg(x)\n"
    assert len(stale("mbody/core/a.py", source, {"mbody/core/a.py"})) == 1
    assert len(stale("mbody/analysis/a.py", source, stamped)) == 2


@pytest.mark.skipif(not (PACKAGE / "__init__.py").exists(), reason="no package yet")
def test_import_mbody_loads_nothing_heavy():
    # numba itself loads scipy's top module where it finds one, so it goes first.
    code = "import sys, numba; had = {*sys.modules}; import mbody; print(*{*sys.modules} - had)"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    loaded = sorted(name for name in run.stdout.split() if within(name, HEAVY))
    assert not loaded, loaded


# -- the checker itself -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "source", "arrow"),
    [
        (
            "joints/a.py",
            "import numpy\nfrom mbody.model.mechanism import M",
            "2: joints → mbody.model.mechanism.M",
        ),
        (
            "joints/a.py",
            "from mbody.model.loads.spring import S",
            "1: joints → mbody.model.loads.spring.S",
        ),
        ("joints/a.py", "from mbody import Mechanism", "1: joints → mbody.Mechanism"),
        ("loads/a.py", "import os", "1: loads → os"),
        ("loads/a.py", "def f():\n    from .. import bodies", "2: loads → mbody.model.body"),
        ("kernels/constraints.py", "from ..bodies import Body", "1: core → mbody.model.body.Body"),
        (
            "kernels/constraints.py",
            "from mbody.model.mechanism import M",
            "1: core → mbody.model.mechanism.M",
        ),
        (
            "mechanism.py",
            "def f():\n    import mbody.system.assembler",
            "2: mechanism → mbody.system.assembler",
        ),
        (
            "makers.py",
            "from mbody.analysis import simulate",
            "1: makers → mbody.analysis.dynamics.simulate",
        ),
        ("views/plot.py", "from mbody.cli import main", "1: views → mbody.cli.main"),
        (
            "views/plot.py",
            "try:\n    import scipy.linalg\nexcept ImportError: ...",
            "2: views → scipy",
        ),
        ("solution.py", "import mbody", "1: solution → mbody"),
        ("stray.py", "", "1: stray has no layer"),
    ],
)
def test_the_checker_catches(path, source, arrow):
    (found,) = complaints(f"mbody/{path}", source)
    assert found.startswith(f"mbody/{path}:{arrow}")


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("joints/a.py", "if TYPE_CHECKING:\n    from mbody.model.mechanism import Mechanism"),
        ("joints/a.py", "from collections.abc import Callable\nfrom ._shared import arm"),
        ("model/joints/__init__.py", "from .a import A\nfrom mbody.model.joints.b import B"),
        ("kernels/constraints.py", "from mbody.model.joints import revolute\nfrom . import kkt"),
        ("_cache.py", "from mbody import errors"),
        ("makers.py", "from mbody.model.mechanism import Mechanism"),
        ("solution.py", "def to_pandas(self):\n    import pandas"),
        ("__init__.py", "from .analysis import simulate"),
    ],
)
def test_the_checker_allows(path, source):
    assert not complaints(f"mbody/{path}", source)


def test_the_checker_catches_a_ring():
    ring = {
        "mbody/core/a.py": "from . import b",
        "mbody/core/b.py": "\nfrom mbody.kernels.a import f",
    }
    assert sorted(cycle(ring)) == [
        "mbody/core/a.py:1: mbody/core/a.py → mbody/core/b.py: closes a ring",
        "mbody/core/b.py:2: mbody/core/b.py → mbody/core/a.py: closes a ring",
    ]

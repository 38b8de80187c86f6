"""The map of imports: folders in layers, arrows, circles. `python -m tests.architecture` prints it.

Every import counts: at the top of a file, inside a function, under ``TYPE_CHECKING``, and a module
that is named in a string. The sources are parsed, not imported, so that nothing can hide.
"""

from __future__ import annotations

import ast
import functools
import re
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests.support.paths import ROOT

PACKAGE = ROOT / "mbody"

#: Lowest first; folders of one layer do not import each other. A folder that is not named belongs
#: to the one above it, as `model.joints` to `model`.
LAYERS = (
    ("errors", "_version"),
    ("core",),
    ("compiler",),
    ("quantities",),
    ("laws",),
    ("model",),
    ("kernels",),
    ("straight_line",),
    ("system",),
    ("solution",),
    ("analysis", "analysis.position"),
    ("analysis.assemblies",),
    ("analysis.contact",),
    ("analysis.singular",),
    ("analysis.driven",),
    ("analysis.freedom",),
    ("analysis.initial",),
    ("analysis.equilibria",),
    ("analysis.dynamics",),
    ("analysis.linear",),
    ("analysis.inverse",),
    ("files",),
    ("summaries",),
    ("gallery", "makers", "testing", "engineering"),
    ("views", "engines", "sweeps", "image"),
    ("derivatives",),
    ("live", "reports", "stepping", "exchange"),
    ("optimization", "synthesis", "teaching", "topologies"),
    ("envs", "inverse"),
    ("edit",),
    ("cli",),
    ("__main__", "__init__"),
)
LEVEL = {folder: level for level, folders in enumerate(LAYERS) for folder in folders}

_MODULE = re.compile(r"mbody(\.\w+)+(:\w+)?")


@dataclass(frozen=True)
class Import:
    """One import of something of mbody, or of another package."""

    path: str
    line: int
    target: str
    #: Runs when the file is loaded; else it waits inside a function, or is for type checkers.
    at_load: bool = True


def sources(package: Path = PACKAGE) -> dict[str, str]:
    """Every source by its path from the root."""
    found = sorted(package.rglob("*.py"))
    return {file.relative_to(package.parent).as_posix(): file.read_text("utf-8") for file in found}


@functools.cache
def imports(path: str, source: str) -> tuple[Import, ...]:
    """All imports of one file, `path` relative to the root; several tests ask for them."""
    found: list[Import] = []
    _below(path, ast.parse(source, path), True, found)
    return tuple(found)


def _below(path: str, node: ast.AST, at_load: bool, found: list[Import]) -> None:
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return  # a docstring may speak of any module
    if isinstance(node, ast.Import):
        for alias in node.names:
            found.append(Import(path, node.lineno, alias.name, at_load))
    elif isinstance(node, ast.ImportFrom):
        above = path.split("/")[: -node.level] if node.level else []
        base = [*above, node.module] if node.module else above
        for alias in node.names:
            found.append(Import(path, node.lineno, ".".join([*base, alias.name]), at_load))
    elif isinstance(node, ast.Constant) and _MODULE.fullmatch(str(node.value)):
        target = str(node.value).partition(":")[0]
        if _exists(target):
            found.append(Import(path, node.lineno, target, False))
    waits = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
    types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.Name | ast.expr_context):  # below which nothing is
            _below(path, child, at_load and not waits and not types, found)


def _exists(module: str) -> bool:
    file = ROOT / module.replace(".", "/")
    return file.with_suffix(".py").exists() or (file / "__init__.py").exists()


def folder_of(module: str) -> str:
    """The folder of a dotted module below mbody; what is none is the front door."""
    parts = module.split(".")[1:]
    for length in (2, 1):
        if ".".join(parts[:length]) in LEVEL and len(parts) >= length:
            return ".".join(parts[:length])
    return "__init__"


def module_of(path: str) -> str:
    """The dotted name of a file."""
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def home_of(path: str) -> str:
    """The folder in which a file is."""
    name = module_of(path)
    return "__init__" if name == "mbody" else folder_of(name)


def within(target: str, names: Iterable[str]) -> bool:
    """Whether a dotted name is one of these, or below one."""
    return any(target == name or target.startswith(name + ".") for name in names)


def upward(one: Import) -> str:
    """Why an import goes against the layers; empty where it does not."""
    if not within(one.target, ["mbody"]):
        return ""
    here, there = home_of(one.path), folder_of(one.target)
    if here == there:
        return ""
    if LEVEL[there] > LEVEL[here]:
        return f"{there} lies above {here}"
    if LEVEL[there] == LEVEL[here]:
        return f"{there} lies beside {here}"
    return ""


def arrows(files: dict[str, str]) -> dict[tuple[str, str], int]:
    """Which file imports which, with the first line that does."""
    modules = {module_of(path): path for path in files}
    found: dict[tuple[str, str], int] = {}
    for path, source in files.items():
        for one in imports(path, source):
            target = one.target
            while target and target not in modules:
                target = target.rpartition(".")[0]
            # what mbody itself offers is loaded by its front door, which stands above all files
            if target and target != "mbody" and modules[target] != path:
                found.setdefault((path, modules[target]), one.line)
    return found


def circles(graph: Iterable[tuple[str, str]]) -> list[list[str]]:
    """Every set of nodes that reach each other (Tarjan's strongly connected components)."""
    following: dict[str, list[str]] = {}
    for a, b in graph:
        following.setdefault(a, []).append(b)
        following.setdefault(b, [])
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = lowest[node] = len(order)
        stack.append(node)
        for other in following[node]:
            if other not in order:
                visit(other)
                lowest[node] = min(lowest[node], lowest[other])
            elif other in stack:
                lowest[node] = min(lowest[node], order[other])
        if lowest[node] == order[node]:
            members = []
            while not members or members[-1] != node:
                members.append(stack.pop())
            if len(members) > 1:
                found.append(sorted(members))

    for node in sorted(following):
        if node not in order:
            visit(node)
    return found


def between_folders(files: dict[str, str]) -> Counter[tuple[str, str]]:
    """Imports from one folder to another, counted by file."""
    pairs = ((home_of(a), home_of(b)) for a, b in arrows(files))
    return Counter(pair for pair in pairs if pair[0] != pair[1])


def main() -> int:
    """Print the map; 1 where an arrow goes upward or a circle is closed."""
    sys.setrecursionlimit(10_000)
    files = sources()
    counts = between_folders(files)
    lines = Counter({home_of(path): 0 for path in files})
    for path, source in files.items():
        lines[home_of(path)] += len(source.splitlines())
    print(f"{'layer':5}  {'folder':22}{'lines':>7}  imports from (files)")
    for level, folders in enumerate(LAYERS):
        for folder in folders:
            below = sorted((b for a, b in counts if a == folder), key=lambda b: LEVEL[b])
            told = ", ".join(f"{b} {counts[folder, b]}" for b in below)
            print(f"{level:5}  {folder:22}{lines[folder]:7}  {told}")
    against = [
        f"{one.path}:{one.line}: {one.target}: {reason}"
        for path, source in files.items()
        for one in imports(path, source)
        if (reason := upward(one))
    ]
    rings = circles(arrows(files))
    print(
        f"{len(counts)} arrows between folders, {sum(counts.values())} imports along them; "
        f"{len(against)} upward; {len(rings)} circles of files, {len(circles(counts))} of folders; "
        f"{sum(lines.values())} lines in {len(files)} files"
    )
    for text in [*against, *(" ↔ ".join(ring) for ring in rings)]:
        print(text)
    return int(bool(against or rings))


if __name__ == "__main__":
    raise SystemExit(main())

"""No file of mbody uses the private names of another one: what others need is public where it is.

The sources are parsed. A method of `self`, `cls` or `super()` may be inherited from another file.
"""

import ast
from collections.abc import Iterator

import pytest

from tests.architecture import sources

#: Names of the standard library that begin with an underscore and are public nevertheless.
PUBLIC = {"_asdict", "_exit", "_fields", "_make", "_replace"}
#: Functions that take the name of an attribute as text.
BY_TEXT = {"getattr", "hasattr", "setattr", "object.__setattr__"}
LAST_OF_THEM = {name.rpartition(".")[2] for name in BY_TEXT}
#: Files inside numba, which offers no public names for what they do.
NUMBA = {f"mbody/compiler/{name}.py" for name in ("builder", "c_interface", "cache", "linking")}


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in PUBLIC


def defined(nodes: list[ast.AST]) -> Iterator[str]:
    """Private names that a file defines: functions, classes, variables, fields, attributes."""
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and type(node.ctx) is ast.Store and own(node.value):
            yield node.attr


def own(node: ast.expr) -> bool:
    """Whether it is the object itself."""
    if isinstance(node, ast.Call):
        return ast.unparse(node) == "super()"
    return isinstance(node, ast.Name) and node.id in {"self", "cls"}


def by_text(function: ast.expr) -> bool:
    """Whether a function takes the name of an attribute as text."""
    last = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return last in LAST_OF_THEM and ast.unparse(function) in BY_TEXT


def of_others(path: str, source: str) -> Iterator[str]:
    """Every use of a private name that another file defines, as a sentence."""
    nodes = list(ast.walk(ast.parse(source, path)))
    names = set(defined(nodes))
    for node in nodes:
        found = ""
        if isinstance(node, ast.Attribute) and private(node.attr) and not own(node.value):
            found = node.attr
        elif isinstance(node, ast.Call) and by_text(node.func):
            key = node.args[1]
            if isinstance(key, ast.Constant) and not own(node.args[0]):
                found = str(key.value)
        elif isinstance(node, ast.ImportFrom):
            found = next((one.name for one in node.names if private(one.name)), "")
        if private(found) and (found not in names or isinstance(node, ast.ImportFrom)):
            yield f"{path}:{node.lineno}: {ast.unparse(node)}"


@pytest.mark.slow
def test_no_file_uses_private_names_of_another():
    files = {path: source for path, source in sources().items() if path not in NUMBA}
    found = [text for path, source in files.items() for text in of_others(path, source)]
    assert not found, "\n" + "\n".join(found)


def test_no_name_is_excused_in_vain():
    assert sources().keys() >= NUMBA
    for path in NUMBA:
        assert list(of_others(path, sources()[path]))


@pytest.mark.parametrize(
    "source",
    [
        "mechanism._elements",
        "run.system._compile(values)",
        "getattr(machine, '_scope')",
        "object.__setattr__(run, '_notes', ())",
        "from mbody.model.body import _points",
        "def f(made):\n    made._sorted = None",
    ],
)
def test_the_checker_catches(source):
    assert len(list(of_others("mbody/a.py", source))) == 1

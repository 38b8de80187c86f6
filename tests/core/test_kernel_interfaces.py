"""Interfaces of the kernels: few parameters, and no line that only quiets the formatter."""

import ast

from tests.support.cases import each
from tests.support.paths import ROOT

KERNELS = ROOT / "mbody" / "kernels"

#: Parameters of a function of the kernels, at most; what goes together is a bundle.
MOST = 8


def functions(path):
    """Name and parameters of every function of a file, inner ones and methods included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            a = node.args
            names = [one.arg for one in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
            names += [one.arg for one in (a.vararg, a.kwarg) if one is not None]
            yield node.name, names


@each("path", sorted(KERNELS.glob("*.py")))
def test_kernels_take_few_parameters(path):
    many = {name: len(names) for name, names in functions(path) if len(names) > MOST}
    assert not many


def test_no_line_begins_with_a_starred_tuple():
    """`*(a, b),` in a call or a list saves lines and hides what is passed."""
    found = {}
    for path in sorted((ROOT / "mbody").rglob("*.py")):
        lines = path.read_text(encoding="utf-8").splitlines()
        numbers = [n for n, line in enumerate(lines, 1) if line.lstrip().startswith("*(")]
        if numbers:
            found[path.relative_to(ROOT).as_posix()] = numbers
    assert not found


@each("path", sorted(KERNELS.glob("*.py")))
def test_slots_of_a_state_have_names(path):
    """`state[TIME]`, not `state[0]`."""
    found = [
        node.lineno
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Subscript)
        and isinstance(node.slice, ast.Constant)
        and "state" in (getattr(node.value, "id", ""), getattr(node.value, "attr", ""))
    ]
    assert not found

"""Few names in `mbody`, the same for type checkers and at run time, not hidden by folders."""

import ast
import subprocess
import sys
from pathlib import Path

import mbody

PACKAGE = Path(mbody.__file__).parent
#: Verbs and elements; of results only those that users name in their own programs.
MOST = 96
FOLDERS = [name for name, home in mbody._HOMES.items() if home == "mbody"]


def test_few_names():
    assert len(mbody.__all__) == len(set(mbody.__all__)) <= MOST
    assert dir(mbody) == sorted(mbody.__all__)


def test_type_checkers_and_users_find_the_same():
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    names = {alias.asname for node in imports for alias in node.names}
    assert names - {"__version__"} == {*mbody.__all__, *FOLDERS}
    for name in names:
        assert getattr(mbody, name) is not None


def public():
    """Every function and class that users are to know, but for kernels, which are called with
    arrays."""
    found = {f"mbody.{name}": getattr(mbody, name) for name in mbody.__all__}
    for folder in FOLDERS:
        module = getattr(mbody, folder)
        found |= {f"mbody.{folder}.{name}": getattr(module, name) for name in module.__all__}
    return {
        name: thing
        for name, thing in found.items()
        if callable(thing) and not thing.__module__.endswith(".kernels")
    }


def test_every_public_name_has_an_example():
    """They are run by `test_docstrings` of tests/docs/test_readme.py, with those of all modules."""
    names = public()
    assert len(names) > len(mbody.__all__) + 50
    assert not [name for name, thing in names.items() if ">>> " not in (thing.__doc__ or "")]
    ours = {name: thing.__module__ for name, thing in names.items()}
    assert not [name for name, module in ours.items() if not module.startswith("mbody")]


def test_import_loads_only_what_is_used():
    code = "import sys, mbody; print(*sorted(n for n in sys.modules if n.startswith('mbody')))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    core = ["mbody.core", "mbody.core.presentation", "mbody.core.registered"]
    assert found.stdout.split() == ["mbody", "mbody._version", *core]

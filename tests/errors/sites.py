"""Where mbody makes its sentences, read from its sources."""

import ast
import functools
import re
from dataclasses import dataclass

from tests.errors.catalogue import PACKAGE

CONSTRUCTORS = {"ModelError", "EditError", "SolveError", "UsageError", "FormulaError"}
CONSTRUCTORS |= {"NotANumber", "NotFinite"}
#: Checks that many functions share; what they are told is the name of an argument.
CHECKS = {"whole_number", "takes_one_design", "unknown_name"}
#: Functions that make sentences, or parts of them, without making the error.
MAKERS = {
    "analysis/driven/transmission.py": {"_contact_remedy"},
    "analysis/position/assembly_analysis.py": {"_too_few", "_say_branch"},
    "quantities/evaluate.py": {"misplaced_variable", "_meant"},
    "quantities/formula.py": {"_meant"},
    "quantities/parse.py": {"why_stray"},
    "cli/parser.py": {"refusal_of_verb", "refusal_of_words"},
    "system/assembler.py": {"__call__"},
    "files/model/read.py": {"_where", "_check_keys", "_unique", "_refused"},
    "files/model/problems.py": {"_sentence", "_unknown"},
    "model/joints/custom.py": {"physics"},
    "laws/times.py": {"_not_reached"},
    "model/loads/custom.py": {"physics"},
    "system/system.py": {"no_such_number"},
}


@dataclass(frozen=True)
class Site:
    """A call that makes an error: its file below mbody, its first and last line."""

    file: str
    first: int
    last: int

    def __str__(self):
        return f"mbody/{self.file}:{self.first}"


def _name(call):
    return getattr(call.func, "id", getattr(call.func, "attr", ""))


def makes_error(node):
    """Whether a node is the call that makes an error or a warning."""
    if not isinstance(node, ast.Call):
        return False
    name = _name(node)
    return name in CONSTRUCTORS or (name == "warn" and ast.unparse(node.func) == "warnings.warn")


@functools.cache
def sources():
    """(file below mbody, tree) of all sources."""
    return [
        (path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text("utf-8")))
        for path in sorted(PACKAGE.rglob("*.py"))
    ]


@functools.cache
def sites():
    """All calls that make an error."""
    return [
        Site(file, node.lineno, node.end_lineno)
        for file, tree in sources()
        for node in ast.walk(tree)
        if makes_error(node)
    ]


@functools.cache
def pieces():
    """(file, line, text) of every piece of a sentence: the literal texts of two words and more in
    functions that make errors or sentences.
    """
    found = []
    for file, tree in sources():
        for function in ast.walk(tree):
            if not isinstance(function, ast.FunctionDef):
                continue
            nodes = list(ast.walk(function))
            listed = function.name in MAKERS.get(file, ())
            if not listed and not any(map(makes_error, nodes)):
                continue
            own = ast.get_docstring(function, clean=False)
            checks = [n for n in nodes if isinstance(n, ast.Call) and _name(n) in CHECKS]
            names = {id(argument) for check in checks for argument in check.args}
            for node in nodes:
                if id(node) in names:
                    continue
                if not (isinstance(node, ast.Constant) and isinstance(node.value, str)):
                    continue
                if node.value == own or " " not in node.value.strip():
                    continue
                if len(re.findall("[A-Za-z']{2,}", node.value)) > 1:
                    found.append((file, node.lineno, node.value))
    return found

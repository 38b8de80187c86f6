"""Values and slopes of random formulas against SymPy's, differentiated by its rules and evaluated
with thirty digits.
"""

import numpy as np
import pytest
import sympy

from mbody import ModelError
from mbody.core.lanes import LANES, aligned
from mbody.kernels.number_program import number_duals
from mbody.quantities import parse
from mbody.solution.traced_instant import Recording, Rule
from tests.laws.test_formula_executors import NAMES, by_tree, drawn, pushed

SYMBOLS = sympy.symbols(NAMES, real=True)


def clamped(x, low, high):
    return sympy.Max(sympy.Min(x, high), low)


#: What the functions of formulas are in SymPy's words.
WORDS = dict(zip(NAMES, SYMBOLS, strict=True)) | {
    "pi": sympy.Float(np.pi, 30),
    "abs": sympy.Abs,
    "min": sympy.Min,
    "max": sympy.Max,
    "step": lambda x: sympy.Piecewise((1, x >= 0), (0, True)),
    "hypot": lambda a, b: sympy.sqrt(a**2 + b**2),
    "clamp": clamped,
    "deadband": lambda x, w: x - clamped(x, -w, w),
}
WORDS |= {name: getattr(sympy, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan")}
WORDS |= {name: getattr(sympy, name) for name in ("sqrt", "exp", "log", "sign", "atan2")}


def by_sympy(text, values):
    """Value and slopes with thirty digits; None where SymPy has no real number."""
    whole = eval(text.replace("^", "**"), {}, dict(WORDS))
    at = dict(zip(SYMBOLS, map(sympy.Float, values), strict=True))
    numbers = []
    for one in (whole, *(sympy.diff(whole, symbol) for symbol in SYMBOLS)):
        found = sympy.N(sympy.sympify(one).subs(at), 30)
        # slopes at steps and kinks are distributions
        real = found.is_Float or found.is_Rational
        numbers.append(float(found) if real else None)
    return numbers


def ours(text, values):
    """Value and slopes by dual numbers."""
    recording = Recording(dict.fromkeys(NAMES, Rule(0.0)))
    program = recording.program([by_tree(parse(text), *recording.inputs.values())])
    slots, found = aligned(len(program.slots), LANES), aligned(1, LANES)
    slots[: len(values), 0] = values
    slots[: len(values), 1 : 1 + len(values)] = np.eye(len(values))
    number_duals(program, slots, found)
    return found[0, : 1 + len(values)]


def compared(count, seed):
    """Formulas whose value or slope differs."""
    rng, done, wrong = np.random.default_rng(seed), 0, []
    while done < count:
        text, values = drawn(rng, int(rng.integers(1, 4))), (*rng.normal(size=2).tolist(), 0.7)
        try:
            if not parse(text).names & {"u", "w"}:
                continue
            pushed([text])
            found, wanted = ours(text, values), by_sympy(text, values)
        except (ModelError, ValueError, RecursionError):  # units, or what SymPy does not compare
            continue
        if not np.isfinite(found[0]):  # a part has no real value, which SymPy may simplify away
            if np.isinf(found[0]) and wanted[0] is not None:
                wrong.append((text, values, found[0], wanted[0]))
            continue
        done += 1
        for own, their in zip(found, wanted, strict=True):
            # both are exact but for the condition of formulas of some ten operations
            if their is not None and not abs(own - their) <= 1e-9 * (abs(their) + 1.0):
                wrong.append((text, values, own, their))
    return wrong


@pytest.mark.parametrize("count", [40, pytest.param(500, marks=pytest.mark.slow)])
def test_values_and_slopes(count):
    assert compared(count, seed=count) == []

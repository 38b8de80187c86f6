"""Random formulas by every executor: NumPy on the tree and on the recorded list, the kernels' steps
in a motion, recorded numbers as a present reading and as dual numbers.
"""

import math

import numpy as np
import pytest

from mbody import Body, Force, Input, Mechanism, ModelError, Prismatic, assemble
from mbody.core.lanes import LANES, DualNumber, aligned
from mbody.kernels.constraints import TO_SIGNAL
from mbody.kernels.finished_instants import each_load
from mbody.kernels.number_program import number_duals
from mbody.laws import Expression
from mbody.laws.kernels import ADD_CONSTANT, LOG, NEGATIVE, OPERATIONS, VARIABLE
from mbody.quantities import Scope, Valued, evaluate, parse
from mbody.quantities.evaluate import by_numpy
from mbody.solution.measures import formula_value
from mbody.solution.traced_instant import FUNCTIONS, STRICT, Recording, RowProgram, Rule
from mbody.system.formula_steps import Differentiated, StepList, by_time, step_values

ONE = ["sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "abs", "exp", "log", "sign", "step"]
TWO = ["atan2", "hypot", "min", "max", "deadband"]
POWERS = ["2", "3", "-1", "1.5", "-2", "0", "1"]
SPECIAL = (0.0, 1.0, -1.0, 0.5, -0.5, 2.0, 1e-8, 1e8, -1e8, 1e200, math.pi / 2)
NAMES = ("u", "w", "p")
#: Factors of the inputs, of which the first leaves them as they are.
NEARBY = (1.0, 1.0 - 1e-14, 1.0 + 1e-14)


def drawn(rng, depth):
    """The text of a random formula."""
    if depth == 0 or rng.random() < 0.12:
        return str(rng.choice([*NAMES, *NAMES, "1", "3", "pi", f"{rng.uniform(0.0, 2.0):.2f}"]))
    a, b, c = (drawn(rng, depth - 1) for _ in range(3))
    kind = rng.random()
    if kind < 0.4:
        return f"({a}){rng.choice(list('++--**/'))}({b})"
    if kind < 0.5:
        return f"({a})^{rng.choice(POWERS)}" if kind < 0.47 else f"({a})^({b})"
    if kind < 0.8:
        return f"{rng.choice(ONE)}({a})" if kind < 0.75 else f"-({a})"
    return f"{rng.choice(TWO)}({a}, {b})" if kind < 0.95 else f"clamp({a}, {b}, {c})"


def pushed(texts):
    """A body on a rail with those formulas as forces."""
    machine = Mechanism("formulas", parameters={"p": 0.7})
    machine.add(Body("b", mass=1.0, inertia=1.0), Prismatic("rail", "ground", "b"))
    machine.add(Input("u", 0.3), Input("w", 0.4))
    machine.add(*(Force(f"f{n}", "b", text) for n, text in enumerate(texts)))
    return machine


def by_tree(tree, *values):
    scope = Scope(names={name: Valued(one) for name, one in zip(NAMES, values, strict=True)})
    return evaluate(tree, scope, checked=False).value


def by_kernel(system):
    """The values of all formulas, as the kernels evaluate loads."""
    work, output = system.work(), np.empty((1, len(system.mechanism.loads), system.coordinates))
    each_load(system.runtime(), work, np.zeros((1, 3 * system.coordinates)), np.zeros(1), output)
    return [work.formula[step[1], 0] for step in system.layout.formula_step if step[0] == TO_SIGNAL]


def by_duals(program, values):
    slots, found = aligned(len(program.slots), LANES), aligned(1, LANES)
    slots[: len(values), 0] = values
    number_duals(program, slots, found)
    return found[0, 0]


def at_present(program, values):
    """As a Simulator reads it: by Python's numbers, and by NumPy's where these stop."""
    rows = RowProgram(program)
    try:
        return rows.function([lambda n=n: values[n] for n in rows.rows], STRICT)()
    except (ValueError, ArithmeticError):
        return rows.function([lambda n=n: np.float64(values[n]) for n in rows.rows], FUNCTIONS)()


def same(found, wanted, nearby):
    """Equal, or apart by what the last digits of functions make: those of NumPy and of the kernels
    are off by some units in the last place, as if what they take were moved by as much.
    """
    if not np.isfinite(wanted):
        return np.array_equal(found, wanted, equal_nan=True)
    spread = np.nanmax(np.abs(np.array(nearby) - wanted), initial=0.0)
    return abs(found - wanted) <= 64 * np.spacing(abs(wanted)) + spread


def disagreements(count, seed):
    """Formulas with values that executors do not share."""
    rng, texts, wrong = np.random.default_rng(seed), [], []
    while len(texts) < count:
        text = drawn(rng, int(rng.integers(1, 5)))
        try:
            if parse(text).names & {"u", "w"}:
                pushed([text])
                texts.append(text)
        except ModelError:  # a part has no value, or units do not fit
            continue
    machine = pushed(texts)
    system, trees = assemble(machine), [parse(text) for text in texts]
    recording = Recording(dict.fromkeys(NAMES, Rule(0.0)))
    programs = [recording.program([by_tree(t, *recording.inputs.values())]) for t in trees]
    for _ in range(4):
        ordinary, special = rng.normal(size=2) * 10.0 ** rng.integers(-2, 3), rng.choice(SPECIAL, 2)
        u, w = np.where(rng.random(2) < 0.5, ordinary, special).tolist()
        kernel = by_kernel(system.with_values({"u.value": u, "w.value": w}))
        for n, (text, tree, program) in enumerate(zip(texts, trees, programs, strict=True)):
            if "atan2" in text and 0.0 in (u, w):  # its cut goes by signs of zeros: no one's number
                continue
            law = machine[f"f{n}"].value
            wanted, *nearby = (float(by_tree(tree, u * k, w * k, 0.7)) for k in NEARBY)
            found = {
                "kernel": kernel[n],
                "list": formula_value(law, law.numbers(), {"u": u, "w": w}.get),
                "present": at_present(program, (u, w, 0.7)),
                "duals": by_duals(program, (u, w, 0.7)),
            }
            wrong += [
                (name, text, u, w, one, wanted)
                for name, one in found.items()
                if not same(one, wanted, nearby)
            ]
    return wrong


@np.errstate(all="ignore")
def test_random_formulas():
    assert disagreements(60, 0) == []


@pytest.mark.slow
@np.errstate(all="ignore")
def test_many_random_formulas():
    assert [disagreements(500, seed) for seed in range(1, 21)] == [[]] * 20


@pytest.mark.parametrize("name", ["min", "max"])
def test_a_present_reading_hides_no_nan(name):
    """Python's own would take the number, whichever comes first."""
    assert math.isnan(STRICT[name](1.0, math.nan)) and math.isnan(STRICT[name](math.nan, 1.0))


def in_duals(formula, x, y):
    """Value and slopes by x and y: of Python's dual numbers, and of the kernel of recorded ones."""
    recording = Recording({"x": Rule(0.0), "y": Rule(0.0)})
    numbers = DualNumber(x, [1.0, 0.0]), DualNumber(y, [0.0, 1.0])
    python, traced = (
        evaluate(parse(formula), Scope(names={"x": Valued(a), "y": Valued(b)}), checked=False).value
        for a, b in (numbers, recording.inputs.values())
    )
    program = recording.program([traced])
    slots, found = aligned(max(8, len(program.slots)), LANES), aligned(1, LANES)
    slots[0, :3], slots[1, :3] = (x, 1.0, 0.0), (y, 0.0, 1.0)
    number_duals(program, slots, found)
    return [python.value, *python.tangents], found[0, :3].tolist()


@pytest.mark.parametrize("x", [1e200, 5e-324, -5e-324, -1e200, math.inf])
def test_a_sign_is_one_however_large_or_small_its_number(x):
    """Recorded as a product that overflowed, it was NaN in dual numbers beyond 1.8e8."""
    for formula, wanted in (("sign(x)", math.copysign(1.0, x)), ("step(x)", float(x > 0.0))):
        assert in_duals(formula, x, 0.0) == ([wanted, 0.0, 0.0],) * 2


@pytest.mark.parametrize(
    ("formula", "x", "y", "wanted"),
    [
        ("max(x, y)", 1.0, 1.0, [1.0, 0.0, 1.0]),  # the second of equal ones
        ("min(x, y)", 1.0, 1.0, [1.0, 0.0, 1.0]),
        ("max(x, y)", 2.0, 1.0, [2.0, 1.0, 0.0]),
        ("abs(x)", -0.0, 0.0, [0.0, 1.0, 0.0]),
        ("sign(x)", 0.0, 0.0, [0.0, 0.0, 0.0]),
        ("x^0", 0.0, 0.0, [1.0, 0.0, 0.0]),
        ("x^y", 0.0, 3.0, [0.0, 0.0, 0.0]),
    ],
)
def test_slopes_at_corners_are_chosen_alike(formula, x, y, wanted):
    for found in in_duals(formula, x, y):
        assert found == wanted
        assert math.copysign(1.0, found[0]) == 1.0  # |−0| is 0


@pytest.mark.parametrize(
    ("function", "slope"),
    [
        (lambda x: 1.0 / x, -math.inf),
        (np.log, math.inf),
        (lambda x: np.arctan2(x, 0.0), math.nan),
        (lambda x: np.arctan2(0.0, x), math.nan),
        (lambda x: np.power(x, -1.0), -math.inf),
    ],
)
def test_dual_numbers_go_on_at_zero_as_floats_of_numpy_do(function, slope):
    """Python's floats would stop there; what does not change leaves no trace."""
    with np.errstate(all="ignore"):
        found = function(DualNumber(0.0, [1.0, 0.0]))
        assert found.value == function(np.float64(0.0))
    np.testing.assert_array_equal(found.tangents, [slope, 0.0])


@pytest.mark.parametrize("code", range(NEGATIVE, len(OPERATIONS)))
def test_rates_by_the_table_of_slopes_are_those_of_jets(code):
    """Of f(t), or f(t, 0.4 − t), in dual numbers and as recorded steps."""
    t, two, name = (
        np.random.default_rng(code).uniform(-0.95, 0.95, 200),
        code > LOG,
        OPERATIONS[code],
    )
    second = (VARIABLE, NEGATIVE, ADD_CONSTANT) if two else ()
    law = Expression(name, (VARIABLE, *second, code), (0.4,) if two else ())
    wanted = law.raw(t)[:, 1]
    known = np.isfinite(wanted)
    assert known.sum() > 20

    def applied(number):
        return by_numpy(name, *((number, 0.4 - number) if two else (number,)))

    with np.errstate(all="ignore"):
        dual = applied(DualNumber(t, np.ones((t.size, 1)))).tangents[:, 0]
    steps = StepList()
    rate = Differentiated(steps, by_time(lambda _: None)).of(applied(steps.read("time")))
    (recorded,) = step_values(steps, [(rate or steps.number(0.0)).place], lambda _: t, t.shape)
    for found in (dual, recorded):
        np.testing.assert_allclose(found[known], wanted[known], rtol=1e-12, atol=1e-13)


def test_a_step_of_no_number_is_none():
    assert math.isnan(evaluate(parse("step(log(x))"), Scope(names={"x": Valued(-1.0)})).value)

"""What must hold of every input: it is read, or there is a sentence."""

import math
import signal
import warnings
from collections.abc import Callable
from pathlib import Path

from mbody import Mechanism, ModelError
from mbody.errors import ModelWarning
from mbody.files.model import in_units
from mbody.laws import compile_formula
from mbody.model.mechanism import whole
from mbody.quantities import FormulaError, Scope, Valued, parse, read, text_of
from mbody.quantities.formula import Formula
from mbody.quantities.units import DIMENSIONS, unit_system
from tests.support.model_text import model_from, text_from

LONGEST = 20_000  # bytes of a message
SLOW = 20  # seconds

SCOPES = [
    Scope(
        unit_system(name),
        {"a": Valued(2.0), "b": Valued(0.5, DIMENSIONS["length"]), "p": Valued(-3.0)},
    )
    for name in ("SI", "in-lbf-s", "mm-N-s")
]
FIELDS = [None, *(DIMENSIONS[name] for name in ("length", "angle", "force", "inertia", "torque"))]
FOLDER = Path(__file__).parent


class Hangs(Exception):
    """An input that takes too long."""


def guarded(check: Callable[[], None]) -> None:
    """Run a check; too long a time and any warning but ours are failures too."""

    def stop(*_: object) -> None:
        raise Hangs(f"more than {SLOW} s")

    alarm = hasattr(signal, "SIGALRM")
    if alarm:
        signal.signal(signal.SIGALRM, stop)
        signal.alarm(SLOW)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", ModelWarning)
            check()
    finally:
        if alarm:
            signal.alarm(0)


def sentence(error: Exception) -> None:
    """A message that people can read."""
    told = str(error)
    assert told.strip(), "the message is empty"
    assert len(told.encode()) < LONGEST, f"the message has {len(told)} characters: {told[:200]}"


def formula(text: str) -> bool:
    """Read a formula, and everything that may be done with it; whether it is one."""
    which = sum(map(ord, text[:50]))
    dimension, scope = FIELDS[which % len(FIELDS)], SCOPES[which % len(SCOPES)]
    try:
        made = read(text, dimension, ("deg", "rad")[which % 2])
    except FormulaError as error:
        sentence(error)
        return False
    again = text_of(made.tree)
    try:
        assert parse(again) == made.tree, f"written as {again}"
    except FormulaError as error:  # exact numbers may be longer than what is read
        assert any(word in str(error) for word in ("at most", "computer holds")), again
    try:
        assert math.isfinite(made.value(scope))
    except FormulaError as error:
        sentence(error)
    for argument in ("time", "length"):
        try:
            law, numbers = compile_formula(made, scope, DIMENSIONS[argument])
        except (FormulaError, ModelError) as error:
            sentence(error)
            continue
        for name, number in numbers.items():
            assert isinstance(number, Formula) and number.value(scope) == law.numbers()[name]
    return True


def model(text: str, is_json: bool) -> bool:
    """Read a model, write and read it again; whether it is one."""
    try:
        made = model_from(text, is_json, folder=FOLDER)
    except ModelError as error:
        sentence(error)
        for line, field, message in error.problems:
            assert line is None or line > 0
            assert message and len(field) + len(message) < LONGEST
        return False
    assert isinstance(made, Mechanism)
    for as_json in (False, True):
        again = text_from(made, as_json)
        second = model_from(again, as_json)
        pairs = zip(whole(made), whole(second), strict=True)
        assert second == made, [f"{one!r} became {two!r}" for one, two in pairs if one != two]
    try:
        in_units(made, "in-lbf-s")
    except ModelError as error:
        sentence(error)
    return True

"""Values of options: models with their parameters, values, steps and units."""

from __future__ import annotations

import re
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.parser import finite_number
from mbody.cli.streams import UsageError
from mbody.errors import ModelError
from mbody.quantities.evaluate import short_degrees

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism


def in_degrees(angles: Any) -> Any:
    """An angle [rad], or a list of them, in degrees; None stays where there is none.

    >>> in_degrees([0.0, None])
    [0.0, None]
    """
    if isinstance(angles, list):
        return [in_degrees(one) for one in angles]
    return None if angles is None else short_degrees(angles)


def given(args: Any, *names: str) -> dict[str, Any]:
    """The options of these names that are given.

    >>> from argparse import Namespace
    >>> given(Namespace(count=3, seed=None, by=[]), "count", "seed", "by")
    {'count': 3}
    """
    found = {name: getattr(args, name) for name in names}
    return {name: value for name, value in found.items() if value not in (None, [], "")}


def plain_angle(option: str, text: str) -> Any:
    """A number or a formula; an angle without a unit is in degrees."""
    from mbody.quantities import FormulaError, read

    try:
        return read(text, None, "deg")
    except FormulaError as error:
        element = option.split()[-1]
        named = None if element.startswith("--") else element
        raise ModelError(f"{option}: {error}", named) from None


def low_and_high(option: str, text: str) -> tuple[str, str]:
    """Both parts of ``LOW:HIGH``.

    >>> low_and_high("--within", "3:5 N")
    ('3', '5 N')
    """
    low, sign, high = text.partition(":")
    if not sign:
        raise UsageError(f"{option}: bounds are LOW:HIGH, not {text[:60]!r}")
    return low.strip(), high.strip()


def bounds(option: str, text: str) -> tuple[Any, Any]:
    """Both parts as numbers or formulas; plain angles are in degrees.

    >>> [one.text for one in bounds("--span", "40:60 deg")]
    ['40', '60 deg']
    """
    low, high = low_and_high(option, text)
    return plain_angle(option, low), plain_angle(option, high)


# -- Values in equal steps, as an option names them: LOW:HIGH:COUNT ----------------------------

#: Values of one option.
MOST = 1_000_000

_END = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")


def equal_steps(option: str, text: str) -> list[str]:
    """The values as text with their unit; those between commas as they are.

    >>> equal_steps("--at crank", "0:90 deg:4")
    ['0 deg', '30 deg', '60 deg', '90 deg']
    >>> equal_steps("--at t", "1,2 s")
    ['1', '2 s']
    """
    if ":" not in text:
        return [part.strip() for part in text.split(",")]
    low, high, count = [*text.split(":"), "", ""][:3]
    ends = [_END.fullmatch(part) for part in (low, high)]
    units = {end[2] for end in ends if end and end[2]}
    whole = count.strip()
    steps = int(whole) if whole.isascii() and whole.isdigit() and len(whole) < 9 else 0
    if text.count(":") != 2 or len(units) > 1 or not 2 <= steps <= MOST:
        raise _refused(option, text)
    first, last = (float(end[1]) if end else None for end in ends)
    if first is None or last is None:
        raise _refused(option, text)
    unit = next(iter(units), "")
    values = [first + (last - first) * n / (steps - 1) for n in range(steps - 1)] + [last]
    return [f"{value:.15g} {unit}".strip() for value in values]


def _refused(option: str, text: str) -> UsageError:
    return UsageError(
        f"{option} takes LOW:HIGH:COUNT, two numbers of one unit and a count from 2 to {MOST}, as "
        f"in 0:360:25, or values with commas, not {text[:60]!r}"
    )


# -- Find the model that a command names, with the requested parameters and units --------------


def model_of(args: Any) -> Mechanism:
    """The mechanism that the arguments name."""
    mechanism = model_in(path_of(args.model), named_values(args.set, "--set"))
    if args.units:
        mechanism = in_units_of(mechanism, args.units)
    if angle := getattr(args, "angle", None):
        mechanism.output_units |= {"angle": angle}
    return mechanism


def in_units_of(mechanism: Mechanism, text: str) -> Mechanism:
    """The mechanism with results in other units: of ``--units``, a unit system, or units of
    quantities, or both, as in ``SI,power=kW``.
    """
    from mbody.files.model import in_units

    parts = [part.strip() for part in text.split(",")]
    systems = [part for part in parts if "=" not in part]
    if len(systems) > 1 or "" in parts:
        raise UsageError(
            "--units takes one unit system, units of quantities, or both, as in 'SI', "
            f"'mass=kg,power=W' or 'SI,power=kW', not {text[:60]!r}"
        )
    chosen = named_values([part for part in parts if "=" in part], "--units")
    made = in_units(mechanism, systems[0]) if systems else mechanism
    made.output_units = mechanism.output_units | chosen
    return made


def model_in(path: Path, values: Mapping[str, str] | None = None) -> Mechanism:
    """The mechanism of a file, with other values of its parameters and numbers of elements."""
    from mbody.files.model import load

    values = values or {}
    numbers = {name: text for name, text in values.items() if "." in name}
    try:
        machine = load(path, parameters={n: t for n, t in values.items() if n not in numbers})
        return with_texts(machine, numbers) if numbers else machine
    except ModelError as error:
        name = error.element or ""
        if name in values and name not in numbers:
            # perhaps a load of one number, which has no point in its name
            machine = model_in(path, {n: t for n, t in values.items() if n != name})
            if name in machine:
                return with_texts(machine, {name: values[name]})
        from mbody.exchange import other_program  # which takes as long to load as an analysis

        if whose := other_program(path):
            raise ModelError(
                f"'{path.name}' is a file of {whose}, not a model: make one of it, mbody import "
                f"{path.name} -o {path.stem}.toml"
            ) from None
        raise


def with_texts(mechanism: Mechanism, texts: Mapping[str, str]) -> Mechanism:
    """The mechanism with other numbers of elements, named as a sweep names them."""
    from mbody.model.closed_mechanism import with_numbers
    from mbody.sweeps.samples import drawn, grid
    from mbody.system.assembler import assemble

    given = {name: [plain_angle(f"--set {name}", text)] for name, text in texts.items()}
    made = drawn(assemble(mechanism), grid(given))
    return with_numbers(mechanism, dict(zip(made.names, made.values[0].tolist(), strict=True)))


def path_of(model: str) -> Path:
    """The file of a model: one that exists, else one of the gallery."""
    from mbody.gallery import model_path

    return model_path(model)


def named_values(texts: Sequence[str], option: str) -> dict[str, Any]:
    """``["a=2", "b=3 mm"]`` as a mapping of texts.

    >>> named_values(["a=2", "b=3 mm"], "--set")
    {'a': '2', 'b': '3 mm'}
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        name, value = name.strip(), value.strip()
        if not sign or not name or not value:
            such = ", such as crank=60" if option == "--at" else ""
            raise UsageError(f"{option} takes NAME=VALUE{such}, not {text[:60]!r}")
        if name in found:
            raise ModelError(f"{option} gives '{name}' twice: give it once", name)
        found[name] = value
    return found


def named_numbers(texts: Sequence[str], option: str) -> dict[str, float]:
    """``["a=2", "b=3"]`` as a mapping of plain numbers.

    >>> named_numbers(["a=2"], "--cost")
    {'a': 2.0}
    """
    found = {}
    for name, text in named_values(texts, option).items():
        try:
            found[name] = finite_number(text)
        except ArgumentTypeError as error:
            raise UsageError(f"{option} {name} {error}") from None
    return found

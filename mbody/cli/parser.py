"""The words of the command: which verb they name, and its arguments.

Only argparse is loaded, and only the verb that is named gets a parser: a command begins at once.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
import re
from argparse import ArgumentTypeError
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from mbody.cli.streams import UsageError
from mbody.cli.verbs import VERBS
from mbody.core.other_words import meant
from mbody.errors import ModelError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism


# -- Words that the command does not know, answered by those that it does ----------------------

#: What others call a verb.
VERB_WORDS = """\
simulate: sim simulation run dynamics forward forward-dynamics fd integrate transient dynamic \
motion time
kinetostatics: forces force reactions reaction inverse inverse-dynamics newton-euler \
inversedynamics dynamic-force dynamics torque torques effort efforts analyze analyse analysis
kinematics: positions position velocity velocities acceleration accelerations motion fk ik pva
statics: static rest
equilibrium: equilibria balance-point settle rest static-equilibrium
modes: eigen eigenvalues eig modal frequencies frequency vibration linearize linearise
solve: solve-for question find inverse unknowns
check: validate validation verify lint dof mobility grubler gruebler freedom test info inspect
assemblies: assembly branches circuits configurations dead-centres dead-centers modes-of-assembly
transmission: advantage mechanical-advantage pressure-angle
poles: centres centers instant-centres instant-centers ic polygons velocity-polygon
internal: stress stresses bending moments shear beam internal-loads
crosscheck: compare cross-check benchmark check-against engines
cam: cams profile cam-design
balance: counterweight counterweights balancing springs
shaking: shake balancing vibration orders
flywheel: fluctuation
motor: motors drive gearbox sizing
bearings: bearing life l10
sweep: vary scan study parametric parameter-study grid doe monte-carlo
sensitivity: sensitivities gradient gradients derivative derivatives
optimize: optimise optimization optimisation opt minimize minimise maximize
tolerances: tolerance scatter tolerancing monte-carlo
fit: identify identification calibrate calibration estimate regression
synthesize: synthesise synthesis design synth path-generation function-generation
cognates: cognate roberts
atlas: curves coupler-curves
linkages: dataset data-set random generate
draw: picture sketch image diagram figure render png svg
plot: graph chart curve diagram curves
view: show-page page browser html live open display viewer web gui
animate: animation movie film gif video mp4 anim
freebody: fbd free-body freebodies free-bodies free-body-diagram fbds
report: document pdf reports doc
demo: example tutorial start
derive: equations derivation eom equations-of-motion symbolic
exercise: exercises questions sheet quiz homework
explain: element elements docs reference man describe
new: create init template make
models: gallery examples list ls library model
show: cat print dump type
import: convert load from read
export: fmu mjcf mujoco dxf convert to save urdf
schema: json-schema
doctor: check-install diagnose status version-info env
warmup: warm-up precompile build
compile: wasm build-kernels
"""

#: What others call an option.
OPTION_WORDS = """\
over: turn cycle revolution full-turn rev rotation
to: until end time tend t-end end-time duration stop
at: position theta angle-of where input-angle crank t time
instants: steps samples points frames number n n-steps positions
every: dt interval sampling timestep time-step
step: dt h timestep time-step
rtol: tol tolerance error reltol precision
atol: abstol
method: solver integrator scheme
set: param params parameter parameters define with value
output: out file save outfile write to-file
csv: table export output out file save
json: data format machine
units: unit system
vary: range sweep from scan
by: variables vars design numbers over-numbers parameters
subject-to: constraint constraints st limit limits
measure: quantity objective output-quantity
minimize: min minimise objective cost
maximize: max maximise
path: paths trace trajectory curve
show: display
free: release
assembly: branch mode configuration circuit
count: number n size designs
seed: random-seed rng
plot: plots curves
title: name heading
against: engine engines with
rate: fps frames-per-second
open: browser
"""


def _by_word(table: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for line in table.splitlines():
        word, _, others = line.partition(": ")
        for other in others.split():
            found.setdefault(other, []).append(word)
    return found


def _intended(word: str, table: str, known: Iterable[str], cutoff: float) -> list[str]:
    """The known words that others call so, else the one that is spelled most like it."""
    there = list(known)
    plain = word.lower().replace("_", "-")
    if plain in there:
        return [plain]
    others = _by_word(table)
    for one in (plain, plain.removesuffix("s")):
        if said := [name for name in others.get(one, ()) if name in there]:
            return said
    for spelled in (meant(plain, there, cutoff), meant(plain, others, max(cutoff, 0.8))):
        if spelled in there:
            return [str(spelled)]
        if said := [name for name in others.get(str(spelled), ()) if name in there]:
            return said
    return []


# -- Verbs ------------------------------------------------------------------------------------


def refusal_of_verb(words: Sequence[str]) -> str:
    """What is wrong with a command that does not begin with a verb."""
    word = words[1] if words[0] == "help" else words[0]
    brief = word[:60]
    if word.startswith("-"):
        such = f"mbody kinetostatics MODEL {brief}"
        return f"a command comes first, as in {such} (mbody --help lists all)"
    if not (verb := _of_model(word)):
        close = _intended(word, VERB_WORDS, verbs(), 0.6)
        named = " or ".join(f"{name} ({verbs()[name].about})" for name in close[:2])
        return f"there is no command '{brief}': " + (
            f"did you mean {named}?" if close else "mbody --help lists them"
        )
    return f"say what to do with '{brief}', as in mbody {verb} {brief} (mbody --help lists all)"


#: What a file is for, by its ending.
ENDINGS = {
    **dict.fromkeys((".toml", ".json"), "kinetostatics"),
    **dict.fromkeys((".linkage2", ".pmks", ".urdf", ".xml", ".mjcf"), "import"),
    ".csv": "synthesize",
}


def _of_model(word: str) -> str:
    """The verb for what is a file, or a model of the gallery; "" of anything else."""
    from mbody.gallery import names, path

    ending = os.path.splitext(word)[1].lower()
    if ending not in ENDINGS and word not in names():
        return ""
    verb = ENDINGS.get(ending, "kinetostatics")
    if verb == "kinetostatics":
        file = word if ending else str(path(word))
        try:
            with open(file, encoding="utf-8") as lines:
                text = lines.read(1_000_000)
        except (OSError, ValueError):
            return verb
        if "[drivers" not in text and "[simulate" in text:
            return "simulate"
    return verb


# -- Options ------------------------------------------------------------------------------------


def refusal_of_words(verb: Verb, words: Sequence[str], line: Sequence[str] = ()) -> str:
    """What is wrong with words of a line that a verb has no use for."""
    word = words[0]
    name, sign, _ = word[:60].partition("=")
    more = f"(see mbody {verb.name} --help)"
    if not word.startswith("-"):
        taking = "--vary", "--by", "--scatter", "--at", "--set"
        options = [one for one in taking if one[2:] in verb.long_options()][:2]
        if sign and name and options:
            said = " or ".join(f"{one} {word[:60]}" for one in options)
            return f"'{word[:60]}' goes with an option: did you mean {said}? {more}"
        at = line.index(word) if word in line else 0
        option = line[at - 2] if at > 1 else ""
        if option[2:] in verb.long_options():
            return (
                f"'{word[:60]}' is one word too many: {option} takes one; with commas several "
                f"names, or give {option} again; quotes hold together what has spaces {more}"
            )
        return f"'{word[:60]}' is one word too many; quotes hold together what has spaces {more}"
    if not word.startswith("--"):
        return f"{verb.name} has no option {name} {more}"
    for option in verb.long_options():
        rest = word.removeprefix(f"--{option}")
        if rest != word and len(rest) > 2:
            said = f"--{option} {rest}"
            return f"{verb.name} has no option {name}: did you mean {said}? {more}"
    close = _intended(name[2:], OPTION_WORDS, verb.long_options(), 0.8)
    if close and close != [name[2:]]:
        return f"{verb.name} has no option {name}: did you mean --{close[0]}? {more}"
    having = [one.name for one in verbs().values() if name[2:] in one.long_options()]
    if having:
        rest = " and others" if len(having) > 3 else ""
        return f"{verb.name} has no option {name}, which is of {', '.join(having[:3])}{rest} {more}"
    return f"{verb.name} has no option {name} {more}"


# -- Values of options: models with their parameters, values, steps and units ------------------


def in_degrees(angles: Any) -> Any:
    """An angle [rad], or a list of them, in degrees; None stays where there is none.

    >>> in_degrees([0.0, None])
    [0.0, None]
    """
    from mbody.quantities.evaluate import short_degrees

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
    from mbody.model.model_notes import with_numbers
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


# -- Values of options: numbers, names, files -------------------------------------------------


def table_place(path: str) -> str:
    """Where a table goes: standard output by any of its names is printed to, once."""
    return "-" if path == "/dev/stdout" else path


def printed(path: str) -> str | None:
    """A file of text; standard output by any of its names is no file, and the text is printed.

    >>> printed("-"), printed("a.md")
    (None, 'a.md')
    """
    return None if table_place(path) == "-" else path


def model_file(path: str) -> str:
    """A file of a model that is written beside what is printed.

    >>> model_file("design.toml")
    'design.toml'
    """
    if table_place(path) == "-":
        raise argparse.ArgumentTypeError(
            "the model goes to a file, results are printed: give -o a name, such as design.toml"
        )
    return path


def whole_number(text: str) -> int:
    """A number without a sign.

    >>> whole_number("30")
    30
    """
    if not (text.isascii() and text.isdigit()) or len(text) > 9:
        raise argparse.ArgumentTypeError(f"takes a whole number, not {text[:40]!r}")
    return int(text)


def finite_number(text: str) -> float:
    """A number.

    >>> finite_number("2.5")
    2.5
    """
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise argparse.ArgumentTypeError(f"takes a number, not {text[:40]!r}")
    return found


def names_in(text: str) -> list[str]:
    """Names with commas between them.

    >>> names_in("A, B")
    ['A', 'B']
    """
    found = [part.strip() for part in text.split(",") if part.strip()]
    if not found:
        raise argparse.ArgumentTypeError("takes names with commas between them")
    return found


#: What a value becomes, by its name in the declaration, or by the kind of file.
KINDS = {
    "N": whole_number,
    "R": finite_number,
    **dict.fromkeys(("NAMES", "BODIES", "JOINTS", "ENGINES"), names_in),
    "<table>": table_place,
    "<text>": printed,
    "<model>": model_file,
}

# -- The declarations of `mbody.cli.verbs`, read ----------------------------------------------


class Option(NamedTuple):
    """An argument of a verb.

    `value`: The name of its value in help; "" of a switch.
    `python`: Arguments of Python that it gives.
    `settings`: Those of `argparse` besides.
    `title`: Below which help lists it.
    `other`: Whether it excludes the one above it.
    `text`: Its help, "" where a docstring has it.
    """

    names: tuple[str, ...]
    value: str
    python: tuple[str, ...]
    settings: dict[str, Any]
    title: str
    other: bool
    text: str

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        plain = not self.names[0].startswith("-") and self.settings.get("nargs") in (None, "+")
        return plain or self.settings.get("required", False)


class Verb(NamedTuple):
    """A verb of the command.

    `answer`: The function in `mbody.cli` that answers.
    `functions`: The Python functions that it offers, as paths in `mbody`.
    `about`: What it is for, in a few words.
    `reasons`: Why there is no option, by arguments of Python.
    """

    name: str
    group: str
    answer: str
    functions: tuple[str, ...]
    about: str
    options: list[Option]
    examples: list[str]
    reasons: dict[str, str]

    def long_options(self) -> list[str]:
        """Its options, without their hyphens."""
        return [name[2:] for one in self.options for name in one.names if name.startswith("--")]


@functools.cache
def verbs() -> dict[str, Verb]:
    """All verbs by name."""
    shared: dict[str, Verb] = {}
    found: dict[str, Verb] = {}
    group = ""
    for line in re.sub(r"\n {8}", " ", VERBS).splitlines():
        if line.startswith("= "):
            group = line[2:]
        elif line.startswith("@"):
            name, _, group = line.partition(" ")
            verb = shared[name] = Verb(name, group, "", (), "", [], [], {})
        elif not line.startswith(" "):
            head, _, about = line.partition(": ")
            name, answer, *functions = head.split()
            verb = Verb(name, group, answer, tuple(functions), about, [], [], {})
            found[name] = verb
        else:
            _add(verb, line.strip(), shared)
    return found


def _add(verb: Verb, line: str, shared: dict[str, Verb]) -> None:
    """Add what a line below a verb, or below arguments of several, declares."""
    if line.startswith("@"):
        for name in line.split():
            verb.options.extend(shared[name].options)
            verb.reasons.update(shared[name].reasons)
    elif line.startswith("$ "):
        verb.examples.append(line[2:])
    elif line.startswith("not "):
        names, _, why = line[4:].partition(": ")
        verb.reasons.update(dict.fromkeys(names.split(), why))
    else:
        verb.options.append(_option(line, "" if verb.answer else verb.group))


def _option(line: str, title: str) -> Option:
    """An argument from its declaration."""
    head, _, text = line.removeprefix("or ").partition(": ")
    names: list[str] = []
    settings: dict[str, Any] = {}
    value, target = "", ""
    python: tuple[str, ...] = ()
    for word in head.split():
        if word.startswith("->"):
            target = word[2:]
        elif word.startswith("-") or not names:
            names.append(word)
        elif word == "...":
            settings |= {"action": "append", "default": []}
        elif word == "!":
            settings["required"] = True
        elif word in ("?", "*", "+"):
            settings["nargs"] = word
            if word == "*":
                settings["default"] = []
        elif word.startswith("="):
            settings["default"] = word[1:]
        elif word.startswith("("):
            python = tuple(word[1:-1].split(","))
        elif word.startswith("<"):
            settings["type"] = KINDS[word]
        else:
            value = word
            if word.startswith("{"):
                settings["choices"] = tuple(word[1:-1].split(","))
            elif word in KINDS:
                settings["type"] = KINDS[word]
    if settings.get("type") is names_in:
        settings |= {"action": "extend", "default": []}
    if names[0].startswith("-"):
        target = target or names[-1].lstrip("-").replace("-", "_")
        settings["dest"] = target
        if not value:
            settings["action"] = "store_true"
    elif names[0].isupper():
        value, target = names[0], names[0].lower()
        names[0] = target
    if value and not value.startswith("{"):
        settings["metavar"] = value
    own = python or (target or names[0],)
    return Option(tuple(names), value, own, settings, title, line.startswith("or "), text)


# -- The words of a command line ---------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Errors are raised, so that they are reported like all others.

    `verb`: Whose arguments they are.
    """

    verb: Verb

    def error(self, message: str) -> NoReturn:
        """Raise what is wrong with the arguments."""
        if lacking := re.match(r"the following arguments are required: (.*)", message):
            such = f", as in mbody {self.verb.examples[0]}" if self.verb.examples else ""
            message = f"{self.verb.name} needs {lacking[1]}{such}"
        if said := re.match(r"argument (?:\S+/)?(\S+): (takes .*)", message):
            raise UsageError(f"{said[1]} {said[2]}")
        message = message if len(message) <= 300 else f"{message[:297]}..."
        raise UsageError(f"{message} (see {self.prog} --help)")


def parser_of(verb: Verb) -> argparse.ArgumentParser:
    """The parser of a verb; `answer` of what it parses names the function in `mbody.cli`."""
    made = _Parser(prog=f"mbody {verb.name}", allow_abbrev=False, add_help=False)
    made.verb = verb
    made.set_defaults(answer=verb.answer, command=verb.name)
    either: Any = made
    for n, option in enumerate(verb.options):
        if not option.other:
            excludes = n + 1 < len(verb.options) and verb.options[n + 1].other
            either = made.add_mutually_exclusive_group() if excludes else made
        either.add_argument(*option.names, **option.settings)
    return made

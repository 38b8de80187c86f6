"""Words that the command does not know, answered by those that it does."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

from mbody.cli.parser import Verb, verbs
from mbody.core.other_words import meant

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

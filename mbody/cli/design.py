"""The commands for designers: sweeps, sensitivity, tolerances, optima, answers, fits, balance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import answered, exit_status, head_of, print_data, question
from mbody.cli.interrupts import interrupt
from mbody.cli.parser import (
    bounds,
    given,
    low_and_high,
    model_in,
    model_of,
    named_numbers,
    named_values,
    path_of,
    plain_angle,
)
from mbody.cli.streams import PRINTED, UsageError, check_printed, message, write_rows
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed
from mbody.quantities.output_units import OutputUnits
from mbody.solution.doubts import heading

if TYPE_CHECKING:
    from mbody.engineering import ForceBalance, SpringBalance
    from mbody.model.mechanism import Mechanism
    from mbody.model.simulation import OptimizationTask, Question
    from mbody.optimization.optimize import Optimum
    from mbody.sweeps import Sweep


# -- The commands that find mechanisms: `synthesize`, `cognates`, `atlas`, `linkages` ----------


def synthesize(args: Any) -> int:
    """Find designs, write them as model files, and print them as a table or as data."""
    from mbody.synthesis import synthesize as designs_for
    from mbody.synthesis.request import read_demand

    if args.model is not None and args.point is None:
        raise UsageError(
            "--model needs --point NAME: the point of the path, as coupler.P, or the output, as "
            "rocker.angle"
        )
    options: dict[str, Any] = dict(read_demand(args.points))
    names = ("count", "search", "starts", "seed", "ground", "tolerance", "kind", "units", "atlas")
    options |= given(args, *names)
    by = {name: bounds(name, text) for name, text in named_values(args.by, "--by").items()}
    if args.point is not None:
        options["of"] = args.point
    if args.span is not None:
        options["span"] = bounds("--span", args.span)
    model = None if args.model is None else model_in(path_of(args.model))
    found = designs_for(
        model,
        by=by or None,
        subject_to=args.subject_to,
        full_turn=args.full_turn,
        defective=args.defective,
        **options,
    )
    files = [numbered_file(args.output, n) for n in range(len(found))] if args.output else []
    for design, file in zip(found, files, strict=False):
        design.save(file)
        message(f"wrote {file}")
    if args.json:
        units = OutputUnits(found[0].mechanism.units).having({"angle": "deg"}).symbols()
        head = heading(found[0].mechanism.name, "synthesize", units, found)
        rows = [
            {"file": files[n] if files else None} | design.data("deg")
            for n, design in enumerate(found)
        ]
        data = head | {"designs": rows, "searched": found.searched, "seed": found.seed}
        print_data(data)
    else:
        print(found)
    return 0


def numbered_file(output: str, n: int) -> str:
    """The file of one design: design.toml, then design-2.toml."""
    path = Path(output)
    return output if n == 0 else str(path.with_name(f"{path.stem}-{n + 1}{path.suffix}"))


# -- `mbody cognates MODEL --point coupler.P`: other linkages with the same coupler curve ------


def cognates(args: Any) -> int:
    """Print the cognates, and write them as model files."""
    from mbody.synthesis import cognates as cognates_of

    mechanism = model_of(args)
    found = cognates_of(mechanism, args.point)
    files = [numbered_file(args.output, n) for n in range(len(found))] if args.output else []
    for one, file in zip(found, files, strict=False):
        one.save(file)
        message(f"wrote {file}")
    if args.json:
        rows = [{"file": files[n] if files else None} | one.data() for n, one in enumerate(found)]
        head = heading(mechanism.name, "cognates", OutputUnits(mechanism.units).symbols())
        data = head | {"point": args.point, "first": found.first.data(), "cognates": rows}
        print_data(data | {"notes": list(found.notes)})
    else:
        print(found)
    return 0


# -- `mbody atlas --to FILE`: an atlas of coupler curves, to start a synthesis from ------------


def atlas(args: Any) -> int:
    """Make an atlas and write it to a file."""
    from mbody.synthesis import Atlas

    found = Atlas.made(**given(args, "kind", "count", "seed"))
    found.save(args.to)
    message(f"wrote {args.to}: {len(found)} curves")
    return 0


# -- `mbody linkages --to FOLDER`: a data set of random linkages with their motion and forces --


def linkages(args: Any) -> int:
    """Write a data set of random linkages with motion and forces, or go on with one."""
    from mbody.analysis.dynamics.interruptions import counted
    from mbody.sweeps.run import cores
    from mbody.topologies.dataset import LinkageSet, write_linkages

    options = given(args, "count", "nodes", "seed", "instants", "speed")
    if args.groups:
        options["groups"] = tuple(args.groups)
    if args.turn is not None:
        options["turn"] = math.radians(args.turn)
    show = counted("linkages")

    def progress(done: int, total: int) -> None:
        interrupt.mark()
        show(done, total)

    what = LinkageSet(**({"count": 1000} | options))
    found = write_linkages(
        args.to,
        what,
        threads=args.threads or cores(),
        scheduler=args.scheduler,
        part=_share(args.part),
        progress=progress,
    )
    interrupt.done()
    if found.status != "completed":
        message(found.status)
    message(f"wrote {found.folder}: {found.done} of {found.count} linkages")
    return 0 if found.status == "completed" else 1


def _share(text: str | None) -> tuple[int, int]:
    own, _, parts = ("1/1" if text is None else text).partition("/")
    if not (own.isdecimal() and parts.isdecimal()):
        raise UsageError(f"--part takes numbers such as 3/16, not {str(text)[:40]!r}")
    return int(own), int(parts)


def _read_by_people(args: Any) -> Mechanism:
    """The mechanism that the arguments name, measured in the units that people read where text is
    printed; data are in its own units, where none are chosen.
    """
    mechanism = model_of(args)
    if not (args.json or getattr(args, "csv", None)):
        mechanism.output_units = mechanism.shown.names()
    return mechanism


def sweep(args: Any) -> int:
    """Run a sweep and print its results."""
    from mbody.sweeps import sweep as solved

    check_printed(args)
    if not args.vary:
        raise UsageError("choose what differs between designs: --vary NAME=LOW:HIGH:COUNT")
    mechanism = _read_by_people(args)
    varied = named_values(args.vary, "--vary")
    parameters = {name: values_of(name, text) for name, text in varied.items()}
    note_plain(mechanism, varied)
    ask = question(args, mechanism.ask)
    options: dict[str, Any] = (
        {}
        if ask is None
        else {"at": ask.at, "over": ask.over, "instants": ask.instants, "turns": ask.turns}
    )
    options |= {"progress": lambda done, of: interrupt.mark()}
    options |= given(args, "to", "threads", "scheduler")
    found = solved(mechanism, parameters, args.analysis, args.measure or None, **options)
    interrupt.done()
    angle = args.angle or "rad"
    if args.csv:
        _write_sweep(found, args, angle)
    if args.json:
        print_data(_data(found, angle))
    elif args.csv != PRINTED:
        print(found)
    return exit_status(found, printed=args.json or args.csv != PRINTED)


def note_plain(mechanism: Mechanism, varied: Mapping[str, str]) -> None:
    """Note plain values of parameters that the model has in another unit."""
    from mbody.quantities.formula import plain_otherwise

    for name, text in varied.items():
        plain = all(map(_is_plain, text.split(":")[:2] if ":" in text else text.split(",")))
        own = mechanism.parameters.get(name) if plain else None
        if own is not None and (said := plain_otherwise(name, own, mechanism.units)):
            message(f"note: {said}")


def _is_plain(text: str) -> bool:
    """Whether a value is a number without a unit, and not 0."""
    try:
        return float(text) != 0.0
    except ValueError:
        return False


def values_of(name: str, text: str) -> Any:
    """Values of a parameter: LOW:HIGH:COUNT, or a list with commas."""
    from mbody.sweeps import Steps

    option = f"--vary {name}"
    low, sign, tail = text.partition(":")
    if not sign:
        return [plain_angle(option, part) for part in text.split(",")]
    high, _, count = tail.partition(":")
    if not (count.strip().isascii() and count.strip().isdigit()) or len(count) > 9:
        raise UsageError(f"--vary takes LOW:HIGH:COUNT, or values with commas, not {text[:60]!r}")
    return Steps(plain_angle(option, low), plain_angle(option, high), int(count))


def _data(found: Sweep, angle: str) -> dict[str, Any]:
    """The result as plain lists; None where a design has no number."""
    columns: dict[str, Any] = {}
    for name, column in found.columns(angle).items():
        rows = column if isinstance(column, list) else column.tolist()
        columns[name] = [_plain(value) for value in rows]
    units = {name: found.unit_of(name, angle) for name in found.samples.given_names} | found.units
    return heading(found.system.mechanism.name, "sweep", units, found) | {"columns": columns}


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return [_plain(part) for part in value.tolist()]
    return None if isinstance(value, float) and value != value else value


def _write_sweep(found: Sweep, args: Any, angle: str) -> None:
    """A line for each design; of histories a column for each instant. Headings have units."""
    units = {name: found.unit_of(name, angle) for name in found.samples.given_names} | found.units
    table: dict[str, Any] = {}
    for name, column in found.columns(angle).items():
        unit = f" [{units[name]}]" if units.get(name) else ""
        if len(column) and hasattr(column[0], "__len__") and not isinstance(column[0], str):
            parts = enumerate(zip(*column, strict=True))
            table |= {f"{name}[{n}]{unit}": list(part) for n, part in parts}
        else:
            table[name + unit] = column if isinstance(column, list) else column.tolist()
    rows = zip(*table.values(), strict=True)
    write_rows(args, list(table), rows, f": {len(found)} designs")


# -- `mbody sensitivity MODEL MEASURE`: which number changes a measured quantity most ----------


def sensitivity(args: Any) -> int:
    """Take the derivatives of one measured quantity by all numbers, and print them as a table."""
    from mbody.analysis.driven.driven import analyse_system_at
    from mbody.derivatives.dual_solution import checked_names
    from mbody.derivatives.gradient import gradient_at, sensitivity_of
    from mbody.model.simulation import Instants
    from mbody.system.assembler import assemble

    mechanism = _read_by_people(args)
    ask = question(args, mechanism.ask) or Instants()
    system = assemble(mechanism)
    run = analyse_system_at(system, args.analysis, ask)
    by = args.by or None
    names = checked_names(system, by, "sensitivity")
    gradient = gradient_at(run, [args.measure], by, ask.over)
    found = sensitivity_of(run, gradient, names, by is None)
    head = heading(mechanism.name, "sensitivity", mechanism.data_units.symbols(), found)
    return answered(args, found, lambda: head | found.data(), printed=True)


# -- `mbody tolerances MODEL MEASURE`: the band of a quantity whose numbers scatter ------------

KINDS = ("normal", "uniform", "triangular")


def tolerances(args: Any) -> int:
    """Find the bands, the contributions and the loosest tolerances, and print them."""
    from mbody.derivatives.tolerance_study import tolerances as solved

    if not args.scatter:
        raise UsageError("choose what scatters: --scatter NAME=WIDTH")
    mechanism = _read_by_people(args)
    scatter = {n: _scatter(text) for n, text in named_values(args.scatter, "--scatter").items()}
    ask = question(args, mechanism.ask)
    options: dict[str, Any] = {}
    if ask is not None:
        options = {"at": ask.at}
        if ask.over:
            options = {"over": ask.over, "instants": ask.instants, "turns": ask.turns}
    within = None
    if args.within is not None:
        within = low_and_high("--within", args.within)
    options |= given(args, "count", "seed")
    if args.cost:
        options["cost"] = named_numbers(args.cost, "--cost")
    found = solved(mechanism, args.measure, scatter, args.analysis, within=within, **options)
    if args.json:
        print_data(head_of(mechanism, "tolerances", found) | found.data())
    else:
        print(found)
    return 0


def _scatter(text: str) -> Any:
    """A distribution from its name and its width."""
    from mbody.sweeps import Normal, Triangular, Uniform

    kind, _, width = text.partition(" ")
    if kind not in KINDS:
        return Normal(text)
    return {"normal": Normal, "uniform": Uniform, "triangular": Triangular}[kind](width.strip())


# -- `mbody optimize MODEL [NAME]`: the tasks [optimize.NAME] of a model, or one of options ----

#: The name of a task that the file does not have.
OF_OPTIONS = "task"


def optimize(args: Any) -> int:
    """Carry out one task of a model, or all of them; 1 where one has no answer, or a doubt."""
    from mbody.files.model.study_tables import optimization_tasks
    from mbody.files.results import error_data
    from mbody.optimization.optimize import optimize as solved
    from mbody.solution.doubts import Doubt, Inherited, inherited

    check_printed(args)
    mechanism = model_of(args)
    own = _of_options(args)
    tasks = {OF_OPTIONS: own} if own else optimization_tasks(mechanism)
    if not tasks:
        raise ModelError(
            f"'{mechanism.name}' has nothing to optimize: give --minimize and --by, or its file a "
            "table [optimize.NAME] with minimize, by and subject_to"
        )
    if args.name and args.name not in tasks:
        raise ModelError(
            f"'{mechanism.name}' has no optimization '{args.name[:60]}' (it has: {listed(tasks)})",
            args.name,
        )
    names = [args.name] if args.name else list(tasks)
    if (args.csv or args.output) and len(names) > 1:
        raise ModelError(
            f"'{mechanism.name}' has {len(names)} optimizations ({listed(names)}): name the one "
            "that is to be written"
        )
    cases: dict[str, Any] = {}
    texts: list[str] = []
    doubts: list[Doubt] = []
    notes: list[str] = []
    stopped = ""
    for name in names:
        try:
            found = solved(mechanism, tasks[name], progress=_progress(name))
        except SolveError as error:
            doubts.append(Doubt("incomplete", f"{name}: {error}"))
            cases[name] = {"values": {}, **error_data(error)}
            texts.append("\n".join([f"{mechanism.name}: {name}", "", "no optimum:", str(error)]))
            continue
        doubts += found.doubts
        notes += found.notes
        cases[name] = found.data()
        texts.append(str(replace(found, case=name)))
        if args.csv:
            _write_optimum(found, args)
        if args.output:
            found.save(args.output)
            message(f"wrote {args.output}")
        if found.status.startswith("stopped"):
            stopped = found.status
            break
    interrupt.done()
    whole = Inherited(**inherited(Inherited(doubts=tuple(doubts)), notes=tuple(notes)))
    if args.json:
        head = head_of(mechanism, "optimize", whole)
        if stopped and not doubts:
            head["status"] = stopped
        print_data(head | {"cases": cases})
    elif args.csv != PRINTED or not any(cases[name]["values"] for name in cases):
        print("\n\n\n".join(texts))
    else:
        exit_status(whole, printed=False)
    return 1 if doubts or stopped else 0


def _of_options(args: Any) -> OptimizationTask | None:
    """The task that the options are, if any is given."""
    from mbody.model.simulation import OptimizationTask

    names = ("subject_to", "by", "over", "analysis", "instants", "turns", "until")
    options = given(args, *names, "start", "starts", "points", "seed")
    if "by" in options:
        options["by"] = {n: bounds(n, text) for n, text in named_values(args.by, "--by").items()}
    if "start" in options:
        options["start"] = {
            name: plain_angle(f"--start {name}", text)
            for name, text in named_values(args.start, "--start").items()
        }
    if not args.minimize and not args.maximize:
        if options:
            option = next(iter(options)).replace("_", "-")
            raise UsageError(f"--{option} needs --minimize or --maximize: what is to be best")
        return None
    if "by" not in options:
        raise UsageError("choose the numbers that may change: --by NAME=LOW:HIGH")
    if args.name:
        raise UsageError(
            f"--minimize and --maximize make a task of their own: leave out {args.name[:40]!r}"
        )
    return OptimizationTask(tuple(args.minimize), tuple(args.maximize), **options)


def _progress(name: str) -> Any:
    """Where Ctrl-C may stop a task; it says how many searches have ended."""
    said = [-1]

    def seen(done: int, total: int) -> None:
        interrupt.mark()
        if done != said[0] and done:
            message(f"{name}: {done} of {total} searches")
        said[0] = done

    return seen


def _write_optimum(found: Optimum, args: Any) -> None:
    """A line for each number: before, at the optimum, unit, band; or the designs of a front."""
    rows: list[list[Any]]
    if found.pareto:
        units = [*found.aims, *((name, found.units[name]) for name in found.values)]
        head = [f"{name} [{unit}]" if unit else name for name, unit in units]
        rows = [[*one.objective, *one.values.values()] for one in found.pareto]
    else:
        head = ["number", "before", "optimum", "unit", "band from", "band to"]
        rows = [
            [name, found.start_values[name], value, found.units[name], *found.band[name]]
            for name, value in found.values.items()
        ]
    write_rows(args, head, rows)


# -- `mbody solve MODEL [NAME]`: the questions of a model, answered ----------------------------

NONE = "no solution:"
#: The name of a question that the file does not have.
QUESTION = "question"


def solve(args: Any) -> int:
    """Answer one question of a model, or all of them; 1 where one has none, or a doubt."""
    from mbody.files.results import answer_data, error_data
    from mbody.inverse.solve_for import solve_for
    from mbody.solution.doubts import Doubt, Inherited, inherited
    from mbody.summaries.analyses import answers_summary

    mechanism = model_of(args)
    own = _question_of(args)
    questions = {QUESTION: own} if own else mechanism.questions
    if not questions:
        raise ModelError(
            f"'{mechanism.name}' has no questions: give --unknowns and --conditions, or its file a "
            "table [solve.NAME] with unknowns and conditions"
        )
    if args.name and args.name not in questions:
        raise ModelError(
            f"'{mechanism.name}' has no question '{args.name[:60]}' (it has: {listed(questions)})",
            args.name,
        )
    cases: dict[str, Any] = {}
    texts: list[str] = []
    doubts: list[Doubt] = []
    notes: list[str] = []
    for name in [args.name] if args.name else questions:
        try:
            answer = solve_for(mechanism, questions[name])
        except SolveError as error:
            doubts.append(Doubt("incomplete", f"{name}: {error}"))
            cases[name] = {"solutions": [], **error_data(error)}
            texts.append("\n".join([f"{mechanism.name}: {name}", "", NONE, str(error)]))
        else:
            doubts += answer.doubts
            notes += answer.notes
            cases[name] = answer_data(answer)
            texts.append(answers_summary(answer, name))
    if args.json:
        whole = Inherited(**inherited(Inherited(doubts=tuple(doubts)), notes=notes))
        units = mechanism.data_units.with_angle(None, "deg")
        head = heading(mechanism.name, "solve", units.symbols(), whole)
        print_data(head | {"cases": cases})
    else:
        print("\n\n\n".join(texts))
    return 1 if doubts else 0


def _question_of(args: Any) -> Question | None:
    """The question that the options ask, if any is given."""
    from mbody.model.simulation import Question

    names = "unknowns", "conditions", "side_conditions", "greatest", "least", "analysis"
    options = given(args, *names)
    args.over = args.instants = args.turns = None
    if asked := question(args, None):
        options["at"] = asked.at
    if options and not args.unknowns:
        raise UsageError("choose what is to be found: --unknowns NAMES")
    if options and args.name:
        raise UsageError(f"--unknowns makes a question of its own: leave out {args.name[:40]!r}")
    return Question(**options) if options else None


# -- `mbody fit MODEL DATA.csv`: numbers from measured histories, by options or a table [fit] --


def fit(args: Any) -> int:
    """Fit the numbers, and print them with their intervals."""
    from mbody.derivatives.fit import fit as solved
    from mbody.files.model.study_tables import fit_settings

    mechanism = model_of(args)
    kept = fit_settings(mechanism)
    how = kept.arguments() if kept is not None else {}
    how |= given(args, "by", "offsets", "analysis", "confidence")
    if args.deviations:
        how["deviations"] = named_numbers(args.deviations, "--deviations")
    if "by" not in how:
        raise UsageError(
            "choose the unknown numbers: --by NAMES, or by = [...] in a table [fit] of the file"
        )
    found = solved(mechanism, list(args.data), **how)
    head = head_of(mechanism, "fit", found)
    return answered(args, found, lambda: head | found.data(), printed=True)


# -- `mbody balance MODEL`: counterweights and springs that balance a mechanism ----------------


def balance(args: Any) -> int:
    """Find counterweights or stiffnesses, print them, and write the balanced model."""
    from mbody.engineering import force_balance, spring_balance
    from mbody.files.model import save
    from mbody.files.model.other_units import rounded

    on = named_values(args.on, "--on")
    if bool(on) == bool(args.springs):
        raise UsageError(
            "choose what is to balance: --on LINK=RADIUS for counterweights, or --springs NAMES"
        )
    mechanism = model_of(args)
    ask = question(args, None)
    options: dict[str, Any] = {}
    if ask is not None:
        options = {"at": ask.at}
        if ask.over:
            options = {"over": ask.over, "instants": ask.instants, "turns": ask.turns}
    found: ForceBalance | SpringBalance
    found = (
        force_balance(mechanism, on, **options)
        if on
        else spring_balance(mechanism, args.springs, args.against or None, **options)
    )
    if args.output:
        save(rounded(found.mechanism, mechanism), args.output)
        message(f"wrote {args.output}")
    return answered(args, found, printed=True)

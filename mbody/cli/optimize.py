"""`mbody optimize MODEL [NAME]`: the tasks [optimize.NAME] of a model, or one of options."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import exit_status
from mbody.cli.interrupts import interrupt
from mbody.cli.models import model_of, named_values
from mbody.cli.option_values import bounds, whole_number
from mbody.cli.streams import message
from mbody.cli.table_output import PRINTED, check_printed, write_rows
from mbody.cli.usage import UsageError
from mbody.errors import ModelError, SolveError
from mbody.model.element import listed

if TYPE_CHECKING:
    from mbody.model.optimization_task import OptimizationTask
    from mbody.optimization.optimum import Optimum

__all__ = ["optimize"]

#: The name of a task that the file does not have.
OF_OPTIONS = "task"


def optimize(args: Any) -> int:
    """Carry out one task of a model, or all of them; 1 where one has no answer, or a doubt."""
    from mbody.files.model.optimize_table import optimization_tasks
    from mbody.files.results import error_data
    from mbody.optimization.optimize import optimize as solved
    from mbody.optimization.sheet import sheet
    from mbody.solution.doubts import Doubt, Inherited, inherited
    from mbody.solution.heading import heading, unit_symbols

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
            texts.append(_unsolved(mechanism.name, name, error))
            continue
        doubts += found.doubts
        notes += found.notes
        cases[name] = found.data()
        texts.append(sheet(found, name))
        if args.csv:
            _write(found, args.csv)
        if args.output:
            found.save(args.output)
            message(f"wrote {args.output}")
        if found.status.startswith("stopped"):
            stopped = found.status
            break
    interrupt.done()
    whole = Inherited(**inherited(Inherited(doubts=tuple(doubts)), notes=tuple(notes)))
    if args.json:
        head = heading(mechanism.name, "optimize", unit_symbols(mechanism.units), whole)
        if stopped and not doubts:
            head["status"] = stopped
        print(json.dumps(head | {"cases": cases}, ensure_ascii=False, allow_nan=False))
    elif args.csv != PRINTED or not any(cases[name]["values"] for name in cases):
        print("\n\n\n".join(texts))
    else:
        exit_status(whole, shown=False)
    return 1 if doubts or stopped else 0


def _of_options(args: Any) -> OptimizationTask | None:
    """The task that the options are, if any is given."""
    from mbody.model.optimization_task import OptimizationTask

    others = {
        "subject_to": args.subject_to,
        "by": {name: bounds(name, text) for name, text in named_values(args.by, "--by").items()},
        "over": args.over,
        "analysis": args.analysis,
        "turns": whole_number("--turns", args.turns),
        "until": args.until,
        "starts": whole_number("--starts", args.starts),
        "seed": whole_number("--seed", args.seed),
    }
    given = {name: value for name, value in others.items() if value not in (None, [], {})}
    if not args.minimize and not args.maximize:
        if given:
            option = next(iter(given)).replace("_", "-")
            raise UsageError(f"--{option} needs --minimize or --maximize: what is to be best")
        return None
    if "by" not in given:
        raise UsageError("choose the numbers that may change: --by NAME=LOW:HIGH")
    if args.name:
        raise UsageError(
            f"--minimize and --maximize make a task of their own: leave out {args.name[:40]!r}"
        )
    return OptimizationTask(tuple(args.minimize), tuple(args.maximize), **given)


def _unsolved(model: str, name: str, error: SolveError) -> str:
    """The sheet of a task that has no answer."""
    return "\n".join([f"{model}: {name}", "", "no optimum:", str(error)])


def _progress(name: str) -> Any:
    """Where Ctrl-C may stop a task; it says how many searches have ended."""
    said = [-1]

    def seen(done: int, of: int) -> None:
        interrupt.mark()
        if done != said[0] and done:
            message(f"{name}: {done} of {of} searches")
        said[0] = done

    return seen


def _write(found: Optimum, path: str) -> None:
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
    write_rows(path, head, rows)

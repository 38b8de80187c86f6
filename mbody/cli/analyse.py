"""`mbody kinematics | kinetostatics | statics MODEL`."""

from __future__ import annotations

import dataclasses
import json
import sys
from typing import TYPE_CHECKING, Any

from mbody.cli.equal_steps import equal_steps
from mbody.cli.models import model_of, named_values
from mbody.cli.option_values import whole_number
from mbody.cli.streams import message
from mbody.cli.table_output import check_printed
from mbody.cli.usage import UsageError
from mbody.errors import ModelError
from mbody.solution.doubts import succeeded

if TYPE_CHECKING:
    from mbody.model.study import Instants
    from mbody.solution.solution import Solution

__all__ = ["analyse", "assembly_of", "check_forms", "question", "exit_status", "write"]


def analyse(args: Any) -> int:
    """Run an analysis and print its results."""
    from mbody.analysis.driven.requests import analyse_at as solved
    from mbody.sheets.friction import efficiency_line

    check_forms(args)
    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    run = solved(mechanism, args.command, wanted, assembly_of(args))
    wants_equations = getattr(args, "equations", False)
    if wants_equations and len(run) > 1:
        raise ModelError("--equations shows one instant: choose it with --at")
    write(run, args)
    output = getattr(args, "efficiency", None)
    found = run.efficiency(output) if output else None
    if args.json:
        data = run.data(args.angle or "deg")
        if found is not None:
            data["efficiency"] = dataclasses.asdict(found)
        if wants_equations:
            data["equations"] = run.equations().data()
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    elif wants_equations:
        print(run.equations())
    elif args.csv != "-":
        print(run)
        if found is not None and output:
            print(efficiency_line(run, output, found))
    return exit_status(run, shown=args.json or (args.csv != "-" and not wants_equations))


def exit_status(result: Any, shown: bool = True) -> int:
    """The exit status of a result; what it says of itself goes to stderr unless stdout has `shown`
    it.
    """
    if not shown:
        for doubt in result.doubts:
            message(f"mbody: doubtful: {doubt.message}")
        doubtful = {doubt.message for doubt in result.doubts}
        for note in result.notes:
            if note not in doubtful:
                message(f"note: {note}")
    return 0 if succeeded(result.status) else 1


def question(args: Any, own: Instants | None) -> Instants | None:
    """The instants that the arguments ask for, or those of the model."""
    from mbody.model.study import Instants
    from mbody.quantities import FormulaError, read

    if args.at and args.over:
        raise UsageError("give --at or --over, not both")
    turning = [f"--{name}" for name in ("instants", "turns") if getattr(args, name) is not None]
    if args.at and turning:
        raise UsageError(
            f"{turning[0]} is of whole turns, --at of single instants: give one of them; in equal "
            "steps --at crank=0:360:25"
        )
    over = args.over or (own.over if own and not args.at else "") or ("turn" if turning else "")
    if args.over or turning:
        turns = whole_number("--turns", args.turns)
        if turns is None:
            turns = own.turns if own and not args.over else 1
        try:
            count = whole_number("--instants", args.instants)
            return Instants(over=over, instants=count, turns=turns)
        except ModelError as error:
            raise ModelError(str(error).replace("ask: ", "--", 1)) from None
    at: dict[str, Any] = {}
    for name, text in named_values(args.at, "--at").items():
        parts = equal_steps(f"--at {name}", text)
        try:
            at[name] = [read(part, None, "deg") for part in parts]
        except FormulaError as error:
            raise ModelError(f"--at {name}: {error}", name) from None
    return Instants(at=at) if at else own


def assembly_of(args: Any) -> str | int | None:
    """The assembly mode of the arguments: a number, or a name."""
    text: str | None = args.assembly
    if text is not None and text.isascii() and text.isdigit():
        return int(text[:9])
    return text


def check_forms(args: Any) -> None:
    """Refuse outputs that would mix, before an analysis runs."""
    check_printed(args)
    if args.npz == "-":
        raise UsageError("--npz takes a file: its arrays cannot be printed")


def write(run: Solution, args: Any) -> None:
    """Write the requested files and report them."""
    angle = args.angle or "rad"
    if args.csv == "-":
        from mbody.files.tables import print_csv

        print_csv(run, sys.stdout, angle)
    elif args.csv:
        run.to_csv(args.csv, angle)
    if args.npz:
        run.to_npz(args.npz)
    for path in (args.csv, args.npz):
        if path and path != "-":
            message(f"wrote {path}: {len(run)} instants")

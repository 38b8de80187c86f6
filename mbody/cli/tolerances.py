"""`mbody tolerances MODEL MEASURE`: the band of a quantity whose numbers scatter."""

from __future__ import annotations

import json
from typing import Any

from mbody.cli.analyse import question
from mbody.cli.angle_measures import measures_in_degrees
from mbody.cli.models import model_of, named_values
from mbody.cli.option_values import low_and_high, whole_number
from mbody.cli.usage import UsageError

__all__ = ["tolerances"]

KINDS = ("normal", "uniform", "triangular")


def tolerances(args: Any) -> int:
    """Find the bands, the contributions and the loosest tolerances, and print them."""
    from mbody.derivatives.tolerance_study import tolerances as solved
    from mbody.solution.heading import heading, unit_symbols

    if not args.scatter:
        raise UsageError("choose what scatters: --scatter NAME=WIDTH")
    mechanism = model_of(args)
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
    count, seed = (whole_number(f"--{name}", getattr(args, name)) for name in ("count", "seed"))
    wanted: Any = args.measure
    if args.angle == "deg":
        wanted = measures_in_degrees(mechanism, [args.measure])[args.measure]
    found = solved(
        mechanism,
        wanted,
        scatter,
        args.analysis,
        count=count,
        seed=seed,
        within=within,
        **options,
    )
    if args.json:
        head = heading(mechanism.name, "tolerances", unit_symbols(mechanism.units), found)
        print(json.dumps(head | found.data(), ensure_ascii=False, allow_nan=False))
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

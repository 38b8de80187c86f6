"""`mbody synthesize FILE`: mechanisms for a path, a function or poses in a table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mbody.cli.models import model_in, named_values, path_of
from mbody.cli.option_values import bounds, whole_number
from mbody.cli.streams import message
from mbody.cli.usage import UsageError
from mbody.solution.heading import heading, unit_symbols

__all__ = ["numbered_file", "synthesize"]


def synthesize(args: Any) -> int:
    """Find designs, write them as model files, and print them as a table or as data."""
    from mbody.synthesis import synthesize as designs_for
    from mbody.synthesis.point_files import read_demand

    if args.model is not None and args.point is None:
        raise UsageError(
            "--model needs --point NAME: the point of the path, as coupler.P, or the output, as "
            "rocker.angle"
        )
    options: dict[str, Any] = dict(read_demand(args.points))
    options |= {
        name: whole_number(f"--{name}", getattr(args, name)) for name in ("count", "search", "seed")
    }
    if args.ground is not None:
        options["ground"] = args.ground
    by = {name: bounds(name, text) for name, text in named_values(args.by, "--by").items()}
    options |= {"kind": args.kind, "units": args.units, "of": args.point, "atlas": args.atlas}
    if args.span is not None:
        options["span"] = bounds("--span", args.span)
    model = None if args.model is None else model_in(path_of(args.model))
    found = designs_for(
        model,
        by=by or None,
        subject_to=args.subject_to,
        full_turn=args.full_turn,
        defective=args.defective,
        **{name: value for name, value in options.items() if value is not None},
    )
    files = [numbered_file(args.output, n) for n in range(len(found))] if args.output else []
    for design, file in zip(found, files, strict=False):
        design.save(file)
        message(f"wrote {file}")
    if args.json:
        units = unit_symbols(found[0].mechanism.units, "deg")
        head = heading(found[0].mechanism.name, "synthesize", units, found)
        rows = [
            {"file": files[n] if files else None} | design.data("deg")
            for n, design in enumerate(found)
        ]
        data = head | {"designs": rows, "searched": found.searched, "seed": found.seed}
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return 0


def numbered_file(output: str, n: int) -> str:
    """The file of one design: design.toml, then design-2.toml."""
    path = Path(output)
    return output if n == 0 else str(path.with_name(f"{path.stem}-{n + 1}{path.suffix}"))

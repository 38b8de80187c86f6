"""The commands that find mechanisms: `synthesize`, `cognates`, `atlas`, `linkages`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from mbody.cli.analyse import print_data
from mbody.cli.interrupts import interrupt
from mbody.cli.option_values import (
    bounds,
    given,
    model_in,
    model_of,
    named_values,
    path_of,
)
from mbody.cli.streams import UsageError, message
from mbody.quantities.output_units import OutputUnits
from mbody.solution.doubts import heading


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

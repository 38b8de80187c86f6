"""`mbody assemblies MODEL`: every way in which a mechanism closes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.cli.analyse import exit_status, question
from mbody.cli.models import model_of
from mbody.cli.streams import message
from mbody.cli.usage import UsageError
from mbody.errors import SolveError

if TYPE_CHECKING:
    from mbody.model.study import Instants
    from mbody.system.system import System

__all__ = ["assemblies"]


def assemblies(args: Any) -> int:
    """Print assembly modes, circuits and dead centres, and draw the modes."""
    from mbody.analysis.assemblies.assembly_modes import assembly_modes
    from mbody.analysis.assemblies.circuits import circuits
    from mbody.system.assembler import assemble
    from mbody.views.backend import check_ending

    if args.output:
        check_ending(args.output)
    args.over = args.instants = args.turns = None
    mechanism = model_of(args)
    system = assemble(mechanism)
    wanted = question(args, None)
    drive, used = _values(system, wanted)
    found: Any
    if system.leaders:
        name = args.driver or system.leaders[0].name
        found = circuits(system, drive, driver=name, used=used)
    else:
        found = assembly_modes(system)
    if args.output:
        from mbody.views import save
        from mbody.views.assemblies import draw_assemblies

        save(draw_assemblies(found if not system.leaders else found.modes), args.output)
        message(f"wrote {args.output}")
    if args.json:
        data = found.data(args.angle or "deg")
        if not system.leaders:
            data |= {"circuits": [], "dead_centres": []}
        print(json.dumps(data, ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found, shown=args.json)


def _values(system: System, wanted: Instants | None) -> tuple[dict[str, float], np.ndarray | None]:
    """Values of the drivers at the one instant requested, and the position that analyses find."""
    from mbody.analysis.driven.requests import analyse_system_at, arguments_at
    from mbody.model.study import Instants

    if wanted is None:
        return {}, None
    how, _ = arguments_at(system, wanted)
    if "t" in how:
        times = np.asarray(how["t"])[1:]
        values = {
            d.name: [float(system.law_of(d)(float(t))) for t in times] for d in system.leaders
        }
    else:
        values = {name: np.asarray(row)[1:].tolist() for name, row in how["drive"].items()}
    if max(map(len, values.values()), default=1) != 1:
        raise UsageError("assemblies are those of one position: give --at one value")
    drive = {name: row[0] for name, row in values.items()}
    try:
        run = analyse_system_at(system, "kinematics", Instants(at=wanted.at))
    except SolveError:
        return drive, None
    return drive, np.concatenate([_coordinates(run), np.zeros(3)])


def _coordinates(run: Any) -> np.ndarray:
    return np.asarray(run.record.table(slice(None))[0, : run.system.coordinates])

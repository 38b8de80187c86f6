"""`mbody freebody MODEL`: free-body diagrams."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import assembly_of, question
from mbody.cli.models import model_of, path_of
from mbody.cli.streams import message
from mbody.cli.usage import UsageError

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism
    from mbody.solution.solution import Solution

__all__ = ["freebody", "motion_or_driven", "named_bodies"]


def freebody(args: Any) -> int:
    """Write the free-body diagrams of a model."""
    from mbody.views import save
    from mbody.views.backend import check_ending
    from mbody.views.free_bodies import draw_free_bodies, force_peak

    output = args.output or f"{path_of(args.model).stem}.svg"
    check_ending(output)
    mechanism = model_of(args)
    run = motion_or_driven(args, mechanism)
    instants = list(range(len(run)))
    if not args.at and len(run) > 1:
        instants = [force_peak(run)]
        message("mbody: at the instant of the greatest joint force; choose others with --at")
    save(draw_free_bodies(run, named_bodies(args.bodies), instants), output)
    message(f"wrote {output}")
    return 0


def motion_or_driven(args: Any, mechanism: Mechanism, forces: bool = True) -> Solution:
    """The driven analysis at the requested instants; of what nothing drives its free motion."""
    from mbody.analysis.driven.requests import analyse_at
    from mbody.analysis.dynamics.simulate import simulate

    wanted = question(args, mechanism.ask)
    to = getattr(args, "to", None)
    if to is not None and (args.at or args.over):
        raise UsageError("--to follows the free motion, --at and --over are driven: give one")
    if to is not None or (mechanism.simulation is not None and wanted is mechanism.ask):
        if args.assembly is not None:
            raise UsageError("--assembly is of driven analyses: this is a free motion")
        return simulate(mechanism, to)
    analysis = "kinetostatics" if forces else "kinematics"
    return analyse_at(mechanism, analysis, wanted, assembly_of(args))


def named_bodies(given: list[str]) -> list[str] | None:
    """Names of bodies, with commas or several options; None where there are none."""
    names = [name.strip() for text in given for name in text.split(",") if name.strip()]
    return names or None

"""`mbody transmission MODEL --output BODY`: how well a force comes through."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mbody.cli.analyse import assembly_of, exit_status, question
from mbody.cli.models import model_of

if TYPE_CHECKING:
    from mbody.model.mechanism import Mechanism

__all__ = ["transmission"]


def transmission(args: Any) -> int:
    """Print transmission angle, mechanical advantage and velocity ratio, over the turn; of an
    output that another link drives by contact, over the motion of its simulation.
    """
    from mbody.analysis.driven.requests import analyse_at
    from mbody.analysis.driven.transmission import transmission as found_through
    from mbody.views.cycle import cycle

    mechanism = model_of(args)
    wanted = question(args, mechanism.ask)
    if wanted is None and _by_contact(mechanism, args.output):
        from mbody.analysis.dynamics.simulate import simulate

        run = simulate(mechanism)
    else:
        if not args.at and not args.over:
            wanted = cycle(mechanism, wanted)
        run = analyse_at(mechanism, "kinematics", wanted, assembly_of(args))
    found = found_through(run, args.driver, args.output, args.joint)
    if args.json:
        print(json.dumps(found.data(args.angle or "deg"), ensure_ascii=False, allow_nan=False))
    else:
        print(found)
    return exit_status(found, shown=args.json)


def _by_contact(mechanism: Mechanism, output: str) -> bool:
    """Whether contacts with another moving link, which open and close, drive the output."""
    from mbody.system.assembler import assemble

    if mechanism.simulation is None or not (mechanism.contacts or mechanism.groups):
        return False
    body = output.partition(".")[0]
    every = assemble(mechanism).mechanism.contacts  # those of groups, too
    touching = (one.bodies for one in every if len(one.bodies) == 2)
    return any(body in pair and "ground" not in pair for pair in touching)

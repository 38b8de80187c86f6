"""The instants that a function which analyses is called with, as options of the analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mbody.analysis.driven.requests import ANALYSES, analyse_system_at
from mbody.errors import ModelError, brief
from mbody.model.element import listed
from mbody.model.study import Instants
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["RequestedInstants", "analyse_with", "requested_instants", "turned_driver"]

#: Those of an analysis, then those of `Instants`.
KNOWN = ("t", "drive", "turn", "instants", "turns", "guess", "at", "over")


@dataclass(frozen=True)
class RequestedInstants:
    """A driven analysis and its instants.

    Attributes
    ----------
    options : mapping
        Arguments of the analysis; not used where `ask` is given.
    ask : Instants or None
    turning : str
        The driver whose turn it is; empty where none turns.
    """

    analysis: str
    options: Mapping[str, Any]
    ask: Instants | None
    turning: str

    def analysed(self, system: System) -> Solution:
        """The result of a system."""
        if self.ask is not None:
            return analyse_system_at(system, self.analysis, self.ask)
        return ANALYSES[self.analysis](system, **self.options)


def requested_instants(
    system: System,
    analysis: str,
    options: Mapping[str, Any],
    verb: str,
    others: Sequence[str] = (),
) -> RequestedInstants:
    """What was requested; by default the instants of the mechanism itself. Sentences begin with
    the verb; `others`: analyses that it takes besides.

    Raises
    ------
    ModelError
        For an unknown analysis or option.
    """
    if analysis not in ANALYSES:
        raise ModelError(
            f"{verb}: there is no analysis {brief(analysis)} with derivatives (there are: "
            f"{listed([*ANALYSES, *others])})"
        )
    for name in options:
        if name not in KNOWN:
            raise ModelError(f"{verb}: there is no option {name!r} (there are: {listed(KNOWN)})")
    ask = None
    if not options or "at" in options or "over" in options:
        ask = Instants(**options) if options else system.mechanism.ask or Instants()
    turn = options.get("turn") if ask is None else ask.over
    return RequestedInstants(analysis, options, ask, turned_driver(system, turn))


def analyse_with(system: System, analysis: str, options: Mapping[str, Any], verb: str) -> Solution:
    """The result at the instants that `requested_instants` finds in the options."""
    return requested_instants(system, analysis, options, verb).analysed(system)


def turned_driver(system: System, turn: Any) -> str:
    """The driver whose turn it is, by its own name or that of its body, or `True` or "turn" for the
    first; empty where none turns.
    """
    if not turn:
        return ""
    if turn is True or turn == "turn":
        return str(system.drivers[0].name) if system.drivers else ""
    found = [d for d in system.drivers if turn in (d.name, getattr(d, "body", None))]
    return str(found[0].name) if found else ""

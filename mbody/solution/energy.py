"""The account of energy of a motion: what it has, what loads and drivers gave, what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.system.read_only import lock

if TYPE_CHECKING:
    from mbody.model.own_equations import AccountedEnergy
    from mbody.system.system import System

__all__ = ["Energy", "account", "causes"]

Array = np.ndarray

#: Loads whose work is accounted one by one.
ACCOUNTED = 64


@dataclass(frozen=True, eq=False, repr=False)
class Energy:
    """Energies at every instant [force·length], arrays (instants,).

    Attributes
    ----------
    kinetic : array
        ½ vᵀ M v of all bodies.
    potential : array
        Of loads that have one (constant gravity, springs, a plane that turns at constant speed), as
        the negative of the work that they have done, and of the magnetic fields of motors: zero at
        the beginning.
    work : array
        Done by all other loads and by the drivers since the beginning; of electric motors what
        they took from their terminals.
    dissipated : array
        Taken by dampers, by resistances of motors and by impacts on stops, since the beginning.
    balance : array
        kinetic + potential + dissipated − work, less what it was at the beginning: the error of the
        motion, by a route that its steps did not take.
    by : dict
        Work of every load and driver since the beginning, by name; of very many loads "loads"; of
        every stop what its impacts gave, below zero where they took; of a motor also what it was
        "supplied", what it "lost" and what its "field" took, as "motor.lost".
    """

    kinetic: Array
    potential: Array
    work: Array
    dissipated: Array
    balance: Array
    by: dict[str, Array]

    def __post_init__(self) -> None:
        lock(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        lock(self)  # arrays forget in a file that they are locked

    def __repr__(self) -> str:
        return (
            f"Energy({len(self.balance)} instants, up to {self.size:.6g}, balance "
            f"{self.error:.1e} of it)"
        )

    @property
    def size(self) -> float:
        """The greatest energy that took part, by which the balance is to be judged."""
        parts = [self.kinetic, *self.by.values()]
        return float(max((np.abs(part).max(initial=0.0) for part in parts), default=0.0))

    @property
    def error(self) -> float:
        """The greatest balance as a part of `size`; NaN where one is no number."""
        worst = float(np.abs(self.balance).max(initial=0.0))
        return worst / (self.size or 1.0)

    def take(self, index: Any) -> Energy:
        """Only some of the instants."""
        plain = [f.name for f in fields(self) if f.name != "by"]
        own = {name: getattr(self, name)[index] for name in plain}
        return Energy(**own, by={name: part[index] for name, part in self.by.items()})

    def data(self) -> dict[str, Any]:
        """The same as lists, ready for JSON."""
        plain = [f.name for f in fields(self) if f.name != "by"]
        data: dict[str, Any] = {name: getattr(self, name).tolist() for name in plain}
        return data | {"by": {name: part.tolist() for name, part in self.by.items()}}


def causes(system: System, stops: Sequence[str] = ()) -> list[str]:
    """Causes whose work is listed: loads ("loads" for none and very many), drivers, stops."""
    loads = [load.name for load in system.mechanism.loads]
    drivers = [driver.name for driver in system.mechanism.drivers]
    return [*(loads if 0 < len(loads) <= ACCOUNTED else ["loads"]), *drivers, *stops]


def _named(system: System, pages: Array) -> dict[str, dict[str, AccountedEnergy]]:
    """The parts of the account that loads name beside their work."""
    states = system.mechanism.states
    own = pages[:, system.own_rows]
    found = {}
    for load in system.mechanism.loads:
        first = f"{load.name}."
        mine = {
            one.name.removeprefix(first): own[:, n]
            for n, one in enumerate(states)
            if one.name.startswith(first)
        }
        if mine and (parts := load.energies(mine, system.values)):
            found[load.name] = parts
    return found


def account(system: System, pages: Array, gained: Array, stops: Sequence[str] = ()) -> Energy:
    """The account of a motion.

    Parameters
    ----------
    pages : array (instants, rows)
        What is kept of every instant: q, then v, …, own states (`mbody.kernels.output`).
    gained : array (instants, causes)
        Work of every load, or of all together, then of every driver, then of every stop.
    stops : list of str
        Their names.
    """
    machine, n = system.mechanism, system.coordinates
    kinetic = 0.5 * (pages[:, n : 2 * n] ** 2) @ system.mass[:n, 0]
    loads = {load.name: load for load in machine.loads}
    names = causes(system, stops)
    together = not 0 < len(loads) <= ACCOUNTED
    by = {name: gained[:, k] for k, name in enumerate(names)}
    potential, work, lost = (np.zeros(len(pages)) for _ in range(3))
    named = {} if together else _named(system, pages)
    for name, part in by.items():
        if name in named:
            continue  # it passes from one named part to the others
        load = None if together else loads.get(name)
        if name in stops or (load is not None and load.dissipative):
            lost -= part
        elif load is not None and load.potential:
            potential -= part
        else:
            work += part
    if together and not loads:
        by.pop("loads")
    for name, parts in named.items():
        for key, one in parts.items():
            by[f"{name}.{key}"] = one.values if one.kind == "work" else -one.values
            total = {"work": work, "lost": lost, "stored": potential}[one.kind]
            total += one.values
    whole = kinetic + potential + lost - work
    balance = whole - whole[:1]
    return Energy(kinetic, potential, work, lost, balance, by)

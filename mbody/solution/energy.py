"""The account of energy of a motion: what it has, what loads and drivers gave, what is left."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.core.presentation import Presented
from mbody.core.tolerances import ENERGY_ROUNDING, ENERGY_ROUNDING_STEP
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.system.system import Locked

if TYPE_CHECKING:
    from mbody.model.element import AccountedEnergy
    from mbody.system.system import System


Array = np.ndarray

#: Parts of an account that are one array each.
PLAIN = ("kinetic", "potential", "work", "dissipated", "balance")
#: Loads whose work is accounted one by one.
ACCOUNTED = 64


@dataclass(frozen=True, eq=False, repr=False)
class Energy(Locked, Presented):
    """Energies at every instant [force·length], arrays (instants,), of a batch (designs, instants).

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
        Taken by dampers, by resistances of motors, by friction and by impacts, since the
        beginning.
    balance : array
        kinetic + potential + dissipated − work, less what it was at the beginning: the error of the
        motion, by a route that its steps did not take.
    by : dict
        Work of every load and driver since the beginning, by name; of very many loads "loads"; of
        every stop what its impacts gave, below zero where they took; of a motor also what it was
        "supplied", what it "lost" and what its "field" took, as "motor.lost"; of a frictional joint
        and a contact what sliding gave, below zero, as "foot.friction"; of a stop that moves what
        its motion gave, as "floor.moving".
    lost : dict
        What friction and impacts have taken, of every frictional joint, contact and stop by name.
    rounding : float
        An energy that is rounding: of what rests nothing else takes part.

    Examples
    --------
    >>> import mbody
    >>> swing = mbody.Mechanism("pendulum")
    >>> swing.add(mbody.Body("bob", mass=1.0, cg=(1.0, 0.0), guess=0.0))
    >>> swing.add(mbody.Revolute("O", "ground", "bob"), mbody.Gravity("gravity", y=-9.81))
    >>> energy = mbody.simulate(swing, 1.0).energy
    >>> bool(abs(energy.kinetic + energy.potential).max() < 1e-6)
    True
    """

    kinetic: Array
    potential: Array
    work: Array
    dissipated: Array
    balance: Array
    by: dict[str, Array]
    lost: dict[str, Array] = field(default_factory=dict)
    rounding: float = 0.0

    declared = (*PLAIN, "by", "lost")

    def __repr__(self) -> str:
        return (
            f"Energy({self.balance.shape[-1]} instants, up to {self.size:.6g}, balance "
            f"{self.error:.1e} of it)"
        )

    @property
    def size(self) -> float:
        """The greatest energy that took part, by which the balance is to be judged."""
        parts = [self.kinetic, *self.by.values()]
        return float(
            max(
                (np.fmax.reduce(np.abs(part), axis=None, initial=0.0) for part in parts),
                default=0.0,
            )
        )

    @property
    def error(self) -> float:
        """The greatest balance as a part of `size`; zero where both are rounding, NaN where one is
        no number.
        """
        worst, size = float(np.abs(self.balance).max(initial=0.0)), self.size
        return 0.0 if max(worst, size) <= self.rounding else worst / (size or 1.0)

    def take(self, index: Any) -> Energy:
        """Only some of the instants."""
        own = {name: getattr(self, name)[index] for name in PLAIN}
        by, lost = ({n: one[index] for n, one in part.items()} for part in (self.by, self.lost))
        return Energy(**own, by=by, lost=lost, rounding=self.rounding)


def causes(system: System, stops: Sequence[str] = ()) -> list[str]:
    """Causes whose work is listed: loads ("loads" for none and very many), drivers, friction pairs,
    stops that move, and what is struck: stops and contacts.
    """
    loads = [load.name for load in system.mechanism.loads]
    drivers = [driver.name for driver in system.mechanism.drivers]
    whole = loads if 0 < len(loads) <= ACCOUNTED else ["loads"]
    return [*whole, *drivers, *works_of_pairs(system), *works_of_moving(system), *stops]


def works_of_pairs(system: System) -> dict[str, str]:
    """The element of every friction pair, by the name that its work has: "A.friction", of an
    element with several of them "A.friction_2" and so on.
    """
    L, found, counts = system.layout, dict[str, str](), Counter[str]()
    for tangent in L.friction_tangent:
        name = system.owners[int(L.active_set[tangent])][0].name
        counts[name] += 1
        found[f"{name}.friction" + (f"_{counts[name]}" if counts[name] > 1 else "")] = name
    return found


def works_of_moving(system: System) -> list[str]:
    """Names of the work of every moving stop, as "floor.moving"."""
    L = system.layout
    return [f"{system.owners[int(L.active_set[s])][0].name}.moving" for s in L.moving]


def gain_of_jump(mass: Array, before: Array, jump: Array) -> tuple[float, float]:
    """Kinetic energy that a jump of the velocities gives, and what of it may be rounding.

    >>> gain_of_jump(np.array([2.0]), np.array([-3.0]), np.array([4.0]))[0]
    -8.0
    """
    momentum = mass * jump
    terms = np.abs(momentum) @ (np.abs(before) + 0.5 * np.abs(jump))
    return float(momentum @ (before + 0.5 * jump)), ENERGY_ROUNDING_STEP * float(terms)


def _named(system: System, records: Array) -> dict[str, dict[str, AccountedEnergy]]:
    """The parts of the account that loads name beside their work."""
    states = system.mechanism.states
    own = records[:, system.auxiliary_rows]
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


def account(system: System, records: Array, gained: Array, stops: Sequence[str] = ()) -> Energy:
    """The account of a motion. `records` (instants, rows), `gained` (instants, causes). `pages`
    (instants, rows), `gained` (instants, causes).
    """
    machine, n = system.mechanism, system.coordinates
    kinetic = 0.5 * (records[:, n : 2 * n] ** 2) @ system.mass[:n, 0]
    loads = {load.name: load for load in machine.loads}
    names = causes(system, stops)
    together = not 0 < len(loads) <= ACCOUNTED
    by = {name: gained[:, k] for k, name in enumerate(names)}
    potential, work, lost = (np.zeros(len(records)) for _ in range(3))
    frictional = works_of_pairs(system)
    works = {name: np.zeros(len(records)) for name in (*frictional.values(), *stops)}
    named = {} if together else _named(system, records)
    for name, part in by.items():
        if name in named:
            continue  # it passes from one named part to the others
        load = None if together else loads.get(name)
        if name in stops or name in frictional:
            lost -= part
            works[frictional.get(name, name)] -= part
        elif load is not None and load.dissipative:
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
    forces = records[:, 3 * n : 3 * n + PER_PRIMITIVE * len(system.owners)]
    forces = forces.reshape(len(records), len(system.owners), PER_PRIMITIVE)[:, :, 2:]
    along = np.array([system.length, system.length, 1.0])
    rounding = ENERGY_ROUNDING * float(np.abs(forces * along).max(initial=0.0))
    return Energy(kinetic, potential, work, lost, balance, by, works, rounding)

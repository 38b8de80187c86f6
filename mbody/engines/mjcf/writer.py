"""The writer of MJCF: a mechanism as a model file of MuJoCo, which Pinocchio reads too."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.analysis.position.assembly_analysis import as_system
from mbody.engines.formula_loads import follows_formula, signals_of, smooth_alone
from mbody.engines.mjcf.document import POINT, STAND_IN, Document
from mbody.engines.mjcf.exported import Exported, branch_coordinates, numbers
from mbody.engines.mjcf.loads import ElementWriter
from mbody.errors import ModelError
from mbody.model.loads import Gravity
from mbody.model.mechanism import Mechanism
from mbody.model.numbers import number_in
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["to_mjcf"]

#: Greatest impedance that MuJoCo allows for a constraint.
HARD = 0.9999
#: Steps in the shortest characteristic time of the start: of an oscillation, a turn, a passage.
STEPS = 500


def to_mjcf(
    model: Mechanism | System, start: Solution | None = None, *, fix_drivers: bool = False
) -> Exported:
    """A mechanism as MJCF, the model files of MuJoCo: a tree of bodies, and constraints that close
    its loops.

    Parameters
    ----------
    model : Mechanism or System
        Of one design.
    start : Solution, optional
        Its last instant is the pose of the file, where all coordinates are zero. By default the
        start of the mechanism's own simulation, or the pose found by `close_loops` (always for a
        System).
    fix_drivers : bool
        Whether constraints fix the driven coordinates, in addition to the motors.

    Returns
    -------
    Exported
        `text` is the file, in SI units; `not_expressible` and `notes` list what is not in it.

    Raises
    ------
    ModelError
        For a batch.
    SolveError
        Where the loops do not close.

    Notes
    -----
    Revolute, prismatic and fixed joints form the tree, as hinges and slides; those that close loops
    are ``<connect>`` and ``<weld>``. A prismatic or pin-in-slot joint that closes a loop is a tree
    joint of a second half of its body, welded to the first: the masses remain exact. Rods, springs
    and dampers are tendons, gears and couplings of angles constraints on tendons. Drivers are
    motors without their laws.

    MuJoCo's constraints are springs: those here have ω = 0.7/h of the file's time step h.

    Examples
    --------
    >>> import mbody
    >>> made = to_mjcf(mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1)))
    >>> made.text.count("<joint "), made.text.count("<connect "), made.not_expressible
    (3, 1, ())
    """
    system = as_system(model)
    if system.batch is not None:
        raise ModelError(
            f"a file has one design, this is a batch of {system.batch} designs: export one of "
            "them, system.design(n)"
        )
    machine = system.mechanism
    if start is None and machine.simulation is not None and not isinstance(model, System):
        start = initial_state_of(system, machine.simulation)
    elif start is None:
        start = close_loops(system)
    described = model if isinstance(model, Mechanism) else machine
    return MjcfWriter(system, start, fix_drivers, described).export()


class MjcfWriter:
    """The writer of one file."""

    def __init__(
        self, system: System, start: Solution, fix_drivers: bool, described: Mechanism
    ) -> None:
        self.document = Document(system, start, fix_drivers)
        self.system, self.machine, self.start = system, system.mechanism, start
        #: With its groups of contacts, which the system has one by one.
        self.described = described
        self.scale = self.document.scale

    def export(self) -> Exported:
        """The whole file."""
        elements = ElementWriter(self.document)
        halves = elements.halves(self.document.tree)
        for branch in self.document.tree.branches:
            share = 1.0 / (1 + halves.get(branch.body, 0))
            self.document.body(branch, branch.body, branch_coordinates(branch), share)
        elements.write()
        self._options()
        self._rods()
        self.document.root.append(ET.Element("compiler", angle="radian", autolimits="true"))
        for part in self.document.parts.values():
            if len(part):
                self.document.root.append(part)
        made = self._exported(elements)
        self._keyframe(made)
        head = self._head(made)
        return Exported(
            **{**vars(made), "text": "\n".join([*head, *_lines(self.document.root)]) + "\n"}
        )

    def _exported(self, elements: ElementWriter) -> Exported:
        # MuJoCo counts coordinates in the order of the file
        order = [joint.get("name") for joint in self.document.parts["worldbody"].iter("joint")]
        self.document.columns.sort(key=lambda column: order.index(column.name))
        notes = list(elements.notes)
        if self.document.stand_ins:
            notes.append(
                f"{', '.join(repr(one) for one in self.document.stand_ins)}: without mass or "
                f"inertia; the file has very small ones ({STAND_IN:g} of the greatest, {POINT:g} "
                "for point masses), since MuJoCo cannot move a massless body; where loads act on "
                "these alone its steps are unstable: give them masses before the file is run freely"
            )
        without = (*elements.refused, *signals_of(self.machine))
        named = {one.element for one in without}
        besides = (one for one in smooth_alone(self.described) if one.element not in named)
        return Exported(
            text="",
            not_expressible=(*without, *besides),
            without=without,
            notes=tuple(notes),
            columns=tuple(self.document.columns),
            stand_ins=tuple(self.document.stand_ins),
            laws=elements.laws,
            built=frozenset(elements.built | {b.name for b in self.machine.bodies}),
            reversed=frozenset(elements.reversed),
            hung=tuple(self.document.hung),
            system=self.system,
            start=self.start,
            scale=self.scale,
        )

    def step(self) -> float:
        """A time step [s] that resolves the motion at the start: a round number."""
        scale, moving = self.scale, self.start
        bodies = [body.name for body in self.machine.bodies]
        rates = [abs(float(moving[name].omega[-1])) for name in bodies]
        speeds = [
            math.hypot(moving[n].vx[-1], moving[n].vy[-1]) / self.system.length for n in bodies
        ]
        pull = math.hypot(*self.gravity()) / (self.system.length * scale.length)
        rate = max([*(r / scale.time for r in rates + speeds), math.sqrt(pull), 1e-3])
        simulation = self.machine.simulation
        if simulation is not None:
            until = number_in(self.machine, simulation.until, "time", "simulation", "until")
            rate = max(rate, 1.0 / (until * scale.time))
        return float(f"{min(1.0 / (STEPS * rate), 0.01):.0e}")

    def gravity(self) -> tuple[float, float]:
        """Constant gravity [m/s²], all loads of it together."""
        unit = self.scale.length / self.scale.time**2
        loads = [one for one in self.machine.loads if isinstance(one, Gravity)]
        fields = [
            tuple(self.system.law_of(load, key) for key in ("x", "y"))
            for load in loads
            if load.name not in self._varying and not follows_formula(load)
        ]
        x, y = (unit * sum(float(pair[n](0.0)) for pair in fields) for n in (0, 1))
        return x, y

    @property
    def _varying(self) -> set[str]:
        """Names of gravity loads that vary with time."""
        fields = [one for one in self.machine.loads if isinstance(one, Gravity)]
        return {one.name for one in fields if ElementWriter.varies(one, ("x", "y"))}

    def _options(self) -> None:
        h = self.step()
        k = 0.5 / h**2
        x, y = self.gravity()
        option = self.document.parts["option"]
        option.set("timestep", numbers(1.0, h))
        option.set("integrator", "RK4")
        option.set("gravity", numbers(1.0, x, y, 0.0))
        ET.SubElement(option, "flag", contact="disable")
        ET.SubElement(
            self.document.parts["default"],
            "equality",
            solref=numbers(1.0, -k, -0.1 * math.sqrt(k)),
            solimp=f"{HARD} {HARD} 0.001 0.5 2",
        )

    def _rods(self) -> None:
        """Capsules between the joints of every body, for display only."""
        places: dict[str, list[tuple[float, float]]] = {}
        for joint in self.machine.joints:
            for side in ("i", "j"):
                body = getattr(joint, side).body
                if body != "ground":
                    x, y = self.system.numbers.arm(joint, side)
                    places.setdefault(body, []).append((float(x), float(y)))
        scale = self.scale.length
        for body, own in places.items():
            for (ax, ay), (bx, by) in pairwise(own):
                if math.hypot(bx - ax, by - ay) < 1e-6 * self.system.length:
                    continue
                ends = (
                    *self.document.frame_of(body, ax, ay),
                    0.0,
                    *self.document.frame_of(body, bx, by),
                    0.0,
                )
                ET.SubElement(
                    self.document.inside[body],
                    "geom",
                    type="capsule",
                    fromto=numbers(scale, *ends),
                    size=numbers(scale, 0.02 * self.system.length),
                    mass="0",
                    contype="0",
                    conaffinity="0",
                )

    def _keyframe(self, made: Exported) -> None:
        """The start: all coordinates zero, and their rates."""
        if not self.document.columns:
            return
        _, v, _ = made.motion(self.start.take([len(self.start) - 1]))
        frames = ET.SubElement(self.document.root, "keyframe")
        zero = " ".join(["0"] * len(self.document.columns))
        ET.SubElement(frames, "key", name="start", qpos=zero, qvel=numbers(1.0, *v[0]))

    def _head(self, made: Exported) -> Iterator[str]:
        units = self.machine.units
        missing = [f"not in this file: {one.element}: {one.why}" for one in made.not_expressible]
        lines = [
            f"{self.machine.name}: written by mbody, in SI units (m, kg, s, rad); the mechanism's "
            f"own are {units.name}.",
            "All coordinates are zero at the start; key 'start' has the rates.",
            *made.notes,
            *missing,
        ]
        for line in lines:
            yield f"<!-- {line.replace('--', '—')} -->"


def _lines(root: ET.Element) -> Iterator[str]:
    """The file line by line; without recursion, since chains of bodies may be long."""
    stack: list[Any] = [(root, 0)]
    while stack:
        node, depth = stack.pop()
        if isinstance(node, str):
            yield node
            continue
        space = "  " * min(depth, 40)
        given = "".join(f" {key}={quoteattr(value)}" for key, value in node.attrib.items())
        if not len(node):
            yield f"{space}<{node.tag}{given}/>"
            continue
        yield f"{space}<{node.tag}{given}>"
        stack.append((f"{space}</{node.tag}>", depth))
        stack += [(child, depth + 1) for child in reversed(node)]

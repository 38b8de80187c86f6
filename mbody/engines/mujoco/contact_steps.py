"""A motion with contacts by MuJoCo, compared with ours."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from mbody.core.tolerances import MUJOCO_IMPEDANCE, MUJOCO_SOLVER, MUJOCO_STICKS
from mbody.engines.crosscheck_result import CrosscheckResult, Inexpressible
from mbody.engines.independent_reading import reading
from mbody.engines.load_forces import Outline, not_as_rigid_contacts, outlines
from mbody.engines.mjcf import Exported, numbers, safe, to_mjcf
from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, strikes
from mbody.engines.mujoco.motion import LawStepper
from mbody.model.contact import Contact, Rope
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- Contacts in MuJoCo: geoms on the bodies of an exported file, and the pairs that touch -----

#: Radius of what has none, and thickness of segments, in model lengths.
POINT, BAR = 1e-8, 0.05
#: Half the width of a segment across the plane, in model lengths.
WIDE = 10.0


def inexpressible_contacts(system: System) -> Iterator[Inexpressible]:
    """Contacts that MuJoCo cannot model."""
    yield from not_as_rigid_contacts(system.mechanism, "MuJoCo")
    at = reading(system)
    for one in system.mechanism.contacts:
        if not isinstance(one, Contact):
            continue
        if one.static is not None and at[f"{one.name}.static"] != at[f"{one.name}.friction"]:
            why = "MuJoCo has one coefficient of friction, none of its own for what sticks"
            yield Inexpressible(one.name, why)
        kinds = {part.kind for part in outlines(at, one)}
        if "line" not in kinds and ("polygon" in kinds or kinds == {"segment"}):
            why = "MuJoCo has spheres for the corners of a polygon, which touch lines only"
            yield Inexpressible(one.name, why)


def with_geoms(made: Exported) -> tuple[str, dict[str, tuple[str, ...]]]:
    """The text of the file with its contacts, and the names of the pairs of each contact.

    Discs are spheres, corners and points very small ones, lines planes, segments boxes; ropes are
    tendons with a greatest length.
    """
    root = ET.fromstring(made.text)
    writer = _Geoms(made, root)
    for one in made.system.mechanism.contacts:
        if isinstance(one, Rope):
            writer.rope(one)
        elif isinstance(one, Contact):
            writer.contact(one)
    for flag in root.iter("flag"):
        flag.attrib.pop("contact", None)
    option = root.find("option")
    assert option is not None
    option.set("cone", "elliptic")
    option.set("integrator", "Euler")
    return ET.tostring(root, encoding="unicode"), writer.pairs


class _Geoms:
    def __init__(self, made: Exported, root: ET.Element) -> None:
        self.made, self.root, self.at = made, root, reading(made.system)
        self.bodies = {one.get("name"): one for one in root.iter("body")}
        self.origin = {"ground": (0.0, 0.0)}
        for name, branch in made.hung:
            self.origin[name] = branch.on_body.x, branch.on_body.y
        self.pairs: dict[str, tuple[str, ...]] = {}
        self.there: dict[tuple[str, str], list[str]] = {}

    def contact(self, one: Contact) -> None:
        """All pairs of a contact."""
        i, j = outlines(self.at, one)
        mu = float(self.at[f"{one.name}.friction"])
        first, second = self._geoms(one.i, i), self._geoms(one.j, j)
        section = self.root.find("contact")
        if section is None:
            section = ET.SubElement(self.root, "contact")
        found: list[str] = []
        for a in first:
            for b in second:
                found.append(f"{one.name}:{len(found)}")
                ET.SubElement(
                    section,
                    "pair",
                    name=found[-1],
                    geom1=a,
                    geom2=b,
                    condim="3" if mu else "1",
                    friction=f"{mu!r} {mu!r} 0 0 0",
                    solimp=f"{MUJOCO_IMPEDANCE} {MUJOCO_IMPEDANCE} 0.001 0.5 2",
                )
        self.pairs[one.name] = tuple(found)

    def rope(self, one: Rope) -> None:
        """A tendon between the two ends."""
        sites = []
        for side in ("i", "j"):
            body = one.places()[side].body
            place = self._position_text(body, tuple(float(part) for part in self.at.arm(one, side)))
            sites.append(f"{one.name}.{side}")
            ET.SubElement(self.bodies[safe(body)], "site", name=sites[-1], pos=place)
        section = self.root.find("tendon")
        if section is None:
            section = ET.SubElement(self.root, "tendon")
        longest = numbers(self.made.scale.length, float(self.at[f"{one.name}.length"]))
        made = ET.SubElement(
            section,
            "spatial",
            name=one.name,
            limited="true",
            range=f"0 {longest}",
            solimplimit=f"{MUJOCO_IMPEDANCE} {MUJOCO_IMPEDANCE} 0.001 0.5 2",
        )
        for site in sites:
            ET.SubElement(made, "site", site=site)

    def _position_text(self, body: str, at: tuple[float, ...]) -> str:
        ox, oy = self.origin[body]
        return numbers(self.made.scale.length, at[0] - ox, at[1] - oy, 0.0)

    def _geoms(self, place: str, outline: Outline) -> list[str]:
        key = outline.body, place
        if key not in self.there:
            self.there[key] = list(self._added(place, outline))
        return self.there[key]

    def _added(self, place: str, outline: Outline) -> Iterator[str]:
        size, unit = self.made.system.length, self.made.scale.length
        if outline.kind == "line":
            # the plane's third axis is its normal, to the left of the line
            normal = -math.sin(outline.direction), math.cos(outline.direction), 0.0
            plane = {"size": "0 0 1", "zaxis": numbers(1.0, *normal)}
            yield self._geom(place, outline, "plane", outline.points[0], plane)
            return
        if outline.kind == "segment":
            (ax, ay), (bx, by) = outline.points
            length = math.hypot(bx - ax, by - ay)
            # its upper side is the segment
            mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
            mx += BAR * size * (by - ay) / length
            my -= BAR * size * (bx - ax) / length
            half = 0.5 * math.atan2(by - ay, bx - ax)
            given = {
                "size": numbers(unit, 0.5 * length, BAR * size, WIDE * size),
                "quat": numbers(1.0, math.cos(half), 0.0, 0.0, math.sin(half)),
            }
            yield self._geom(place, outline, "box", (mx, my), given)
            return
        radius = {"size": numbers(unit, outline.radius or POINT * size)}
        for n, corner in enumerate(outline.points):
            yield self._geom(f"{place}:{n}", outline, "sphere", corner, radius)

    def _geom(
        self, name: str, outline: Outline, kind: str, at: tuple[float, float], more: dict[str, str]
    ) -> str:
        given = {"name": name, "type": kind, "mass": "0", "contype": "0", "conaffinity": "0"}
        given["pos"] = self._position_text(outline.body, at)
        ET.SubElement(self.bodies[safe(outline.body)], "geom", {**given, **more})
        return name


#: Stiffness of constraints of loops, in parts of 1/h², and damping of all, in parts of 1/h: what
#: strikes loses its velocity within a step.
STIFF, DAMPED = 0.25, 1.0
#: Rate at which overlaps of contacts are left, in parts of 1/T: faster ones would be rebounds.
LEAVING = 20.0
#: Its convex law of friction lifts what slides at μ v times the damping along by that across, and
#: what sticks creeps until its velocity is damped: at 1/√(h T) with this part of the motion as T
#: both are of the order of the step.
ALONG = 0.1
#: Time over which forces say what a contact does, in parts of the motion.
WINDOW = 0.01


def contact_crosscheck(system: System, run: Solution, engine: str) -> CrosscheckResult:
    """Places at instants, and what every contact does, by steps of several lengths."""
    made = to_mjcf(system, run.take([0]), fix_drivers=True)
    adopted = {load.name for load in run.mechanism.loads if load.name not in made.built}
    missing = [one for one in made.without if one.element not in adopted]
    missing += inexpressible_contacts(system)
    missing += [
        Inexpressible(name, "MuJoCo cannot move bodies without mass or inertia")
        for name in made.artificial_masses
    ]
    if missing:
        return CrosscheckResult(
            engine, (), tuple(missing), ("without these nothing can be compared",)
        )
    notes, last = [], float(run.t[-1])
    if struck := strikes(run, with_friction=True):
        # before the impact itself, where it is an instant of the result
        last = float(np.nextafter(struck[0], -np.inf))
        notes.append(
            "MuJoCo's contacts have no coefficient of restitution, and with friction its convex "
            "law makes what strikes obliquely rebound: compared up to the first impact with "
            f"either, at t = {struck[0]:.6g}"
        )
    if adopted:
        names = ", ".join(map(repr, sorted(adopted)))
        notes.append(f"{names}: not in MuJoCo, applied as the wrench from mbody")
    # what begins to slide has too little friction for a time of √(h T): so much velocity is wrong
    check = StepwiseCheck(run, last, "MuJoCo", order=0.5, time_tolerance=0.05)
    rows, unseen, more = check.rows(functools.partial(_motion, made, run, check.times))
    return CrosscheckResult(engine, tuple(rows), tuple(unseen), (*more, *notes))


def _motion(made: Exported, run: Solution, times: np.ndarray, counts: list[int]) -> Stepped:
    """The motion with a number of steps between the instants."""
    import mujoco

    text, pairs = with_geoms(made)
    model: Any = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    model.opt.tolerance, model.opt.iterations = MUJOCO_SOLVER, 200
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data.qvel[:] = made.motion(run.take([0]))[1][0]
    scale, bodies = made.scale, run.mechanism.bodies
    data.time = float(times[0]) * scale.time
    guided = bool(made.laws) or any(one.name not in made.built for one in run.mechanism.loads)
    stepper = LawStepper(made, model, data) if guided else None
    ids = [model.body(safe(body.name)).id for body in bodies]
    angles = np.array([float(run[body.name].angle[0]) for body in bodies])
    forces = _Forces(model, data, pairs, [c for c in run.mechanism.contacts if isinstance(c, Rope)])
    whole = float(times[-1] - times[0]) * scale.time
    places, modes = [], []
    for (begin, end), count in zip(pairwise(times.tolist()), counts, strict=True):
        h = (end - begin) * scale.time / count
        model.opt.timestep = h
        model.eq_solref[:] = -STIFF / h**2, -DAMPED / h
        for part in (model.pair_solref, model.tendon_solref_lim):
            part[:] = -LEAVING * DAMPED / (h * whole), -DAMPED / h
        model.pair_solreffriction[:] = -STIFF / h**2, -1.0 / np.sqrt(h * ALONG * whole)
        forces.begin()
        for n in range(count):
            if stepper:
                stepper.advance(h, 1)
            else:
                mujoco.mj_step(model, data)
            if (count - n) * h <= WINDOW * whole or n == count - 1:
                forces.add()
            # a body may turn by more than half a revolution between two instants
            angles = _nearest_angles(data.xmat[ids], angles)
        mujoco.mj_forward(model, data)
        angles = _nearest_angles(data.xmat[ids], angles)
        places.append(np.column_stack([data.xipos[ids][:, :2] / scale.length, angles]))
        modes.append(forces.modes())
    return Stepped(np.array(places), {name: [one[name] for one in modes] for name in modes[0]})


def _nearest_angles(axes: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Angles of bodies by their axes, nearest to those before."""
    heading = np.arctan2(axes[:, 3], axes[:, 0])
    return np.asarray(before + np.remainder(heading - before + np.pi, 2.0 * np.pi) - np.pi)


class _Forces:
    """Sums of the forces of contacts over some steps: what slides hops, so that one step says
    little.
    """

    def __init__(
        self, model: Any, data: Any, pairs: dict[str, tuple[str, ...]], ropes: list[Rope]
    ) -> None:
        import mujoco

        self.mj, self.model, self.data = mujoco, model, data
        self.contact = {
            tuple(sorted((int(model.pair_geom1[n]), int(model.pair_geom2[n])))): name
            for name, own in pairs.items()
            for n in (model.pair(one).id for one in own)
        }
        self.ropes = {model.tendon(one.name).id: one.name for one in ropes}
        self.names = (*pairs, *self.ropes.values())
        self.begin()

    def begin(self) -> None:
        self.sums = {name: np.zeros(3) for name in self.names}

    def add(self) -> None:
        """Those of the last step."""
        data, wrench = self.data, np.zeros(6)
        for n in range(data.ncon):
            contact = data.contact[n]
            if contact.efc_address < 0:
                continue
            self.mj.mj_contactForce(self.model, data, n, wrench)
            name = self.contact[tuple(sorted(int(one) for one in contact.geom))]
            press, along = float(wrench[0]), float(np.hypot(*wrench[1:3]))
            self.sums[name] += press, along, float(contact.friction[0]) * press
        limits = data.efc_type == int(self.mj.mjtConstraint.mjCNSTR_LIMIT_TENDON)
        for tendon, force in zip(data.efc_id[limits], data.efc_force[limits], strict=True):
            if int(tendon) in self.ropes:
                self.sums[self.ropes[int(tendon)]] += force, 0.0, force

    def modes(self) -> dict[str, str]:
        """Mode of every contact: open, stick or slip."""
        return {
            name: "open" if not press > 0.0 else "stick" if along < MUJOCO_STICKS * most else "slip"
            for name, (press, along, most) in self.sums.items()
        }

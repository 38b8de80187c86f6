"""A motion with contacts by MuJoCo, compared with ours."""

from __future__ import annotations

import functools
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from mbody.core.tolerances import MUJOCO_SOLVER, MUJOCO_STICKS
from mbody.engines.crosscheck_result import CrosscheckResult, Inexpressible
from mbody.engines.mjcf import Exported, to_mjcf
from mbody.engines.mjcf_contacts import ContactGeoms, inexpressible_contacts
from mbody.engines.mjcf_text import safe
from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, strikes
from mbody.engines.mujoco.motion import LawStepper
from mbody.model.contact import Contact, Rope
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- A file with its contacts ------------------------------------------------------------------


def with_geoms(made: Exported) -> tuple[str, dict[str, tuple[str, ...]]]:
    """The text of the file with its contacts, and the names of the pairs of each contact.

    Discs are spheres, corners and points very small ones, lines planes, segments boxes; ropes are
    tendons with a greatest length.
    """
    root = ET.fromstring(made.text)
    writer = ContactGeoms(made.system, made.hung, made.scale.length, root)
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
    made = to_mjcf(system, run.take([0]), fix_drivers=True, smooth=True)
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
    taken = tuple(sorted(adopted))
    return CrosscheckResult(engine, tuple(rows), tuple(unseen), (*more, *notes), taken)


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

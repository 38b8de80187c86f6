"""Joint forces and efforts that MuJoCo finds for a given motion: inverse dynamics with loops."""

from __future__ import annotations

import functools
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from mbody.core import tolerances as tol
from mbody.core.tolerances import MUJOCO_SOLVER, MUJOCO_STICKS
from mbody.engines.balance import CrosscheckResult, Inexpressible, Row, torque_pair
from mbody.engines.mjcf import Exported, to_mjcf
from mbody.engines.mjcf_contacts import ContactGeoms, inexpressible_contacts, safe
from mbody.engines.motions_in_steps import Stepped, StepwiseCheck, strikes
from mbody.engines.mujoco.motion import LawStepper, Replay
from mbody.engines.spanning_tree import Branch
from mbody.model.contact import Contact, Rope
from mbody.model.coupling import AngleCoupling
from mbody.model.driver import AngleDriver
from mbody.model.joints import Distance, Fixed, Gear, Prismatic, Revolute
from mbody.solution.solution import Solution
from mbody.system.system import System

# -- A motion with contacts by MuJoCo, compared with ours --------------------------------------

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


Array = np.ndarray


class _ForceTable:
    """Forces by name and kind at all instants, by both engines."""

    def __init__(self) -> None:
        self.values: dict[tuple[str, str], list[tuple[Array, Array]]] = {}
        #: Residual of the generalised forces at every instant, and their size.
        self.balance: list[tuple[float, float]] = []

    def add(self, name: str, kind: str, ours: Any, theirs: Any) -> None:
        pair = np.atleast_1d(np.asarray(ours, float)), np.atleast_1d(np.asarray(theirs, float))
        self.values.setdefault((name, kind), []).append(pair)

    def rows(self, expected: float, reason: str, length: float) -> list[Row]:
        """A row for each quantity, relative to the greatest of its kind."""
        greatest: dict[str, float] = {}
        for (_, kind), pairs in self.values.items():
            top = max(float(np.linalg.norm(pair[0])) for pair in pairs)
            greatest[kind] = max(greatest.get(kind, 0.0), top)
        force, torque = greatest.get("force", 0.0) * length, greatest.get("torque", 0.0)
        if torque < tol.COMPARISON_TORQUE_NONE * force:
            greatest["torque"] = force
        elif force < tol.COMPARISON_TORQUE_NONE * torque:
            greatest["force"] = torque / length
        found = []
        for (name, kind), pairs in self.values.items():
            differences = [float(np.linalg.norm(ours - theirs)) for ours, theirs in pairs]
            worst = int(np.argmax(differences))
            ours, theirs = (
                float(part[0]) if len(part) == 1 else float(np.linalg.norm(part))
                for part in pairs[worst]
            )
            difference = differences[worst] / (greatest[kind] or 1.0)
            found.append(Row(name, ours, theirs, difference, expected, reason))
        left, size = (max(part) for part in zip(*self.balance, strict=True))
        # forces and torques are added here, by the model length
        return [*found, Row("balance", 0.0, left, left / (size or 1.0), expected, reason)]


def force_rows(replay: Replay) -> tuple[list[Row], list[Inexpressible]]:
    """Efforts and joint forces of every instant, by MuJoCo's inverse dynamics.

    τ = M q̈ + bias − passive forces − loads must equal the forces of the constraints that
    close loops and of the drivers, Jᵀ x = τ. With x, `mj_rnePostConstraint` returns the forces of
    the tree's joints.
    """
    found, condition = _ForceTable(), 1.0
    not_unique: set[str] = set()
    lost = _unloaded(replay.made)
    for step in range(len(replay.run)):
        condition = max(condition, _instant(replay, step, found, not_unique))
    expected = tol.COMPARISON_CLOSURE * condition
    reason = (
        f"positions closed to {tol.COMPARISON_CLOSURE:.0e}, times the condition {condition:.0e} of "
        "its equations"
    )
    for name in (*not_unique, *lost):
        for key in [key for key in found.values if key[0].partition(".")[0] == name]:
            del found.values[key]
    refused = [
        Inexpressible(name, "its force is not unique: the constraints are redundant")
        for name in sorted(not_unique - lost)
    ]
    refused += [
        Inexpressible(name, "its force: a gear pair that couples angles does not load the bearings")
        for name in sorted(lost)
    ]
    return found.rows(expected, reason, replay.made.system.length), refused


def _unloaded(made: Exported) -> set[str]:
    """Joints whose forces differ in MuJoCo because of gears."""
    joints = made.system.mechanism.joints
    return {one.name for one in joints} if any(type(one) is Gear for one in joints) else set()


def _instant(replay: Replay, step: int, found: _ForceTable, not_unique: set[str]) -> float:
    """Add all forces of one instant; return the condition of its equations."""
    replay.at(step)
    data, made, run = replay.data, replay.made, replay.run
    machine, scale = made.system.mechanism, made.scale
    replay.apply(replay.reported_loads())
    applied = data.qfrc_passive, data.qfrc_actuator, replay.on_coordinates()
    inertia = replay.mass() @ replay.a[step]
    terms = np.array([inertia, data.qfrc_bias, *(-part for part in applied)])
    tau = terms.sum(axis=0)
    J, known = replay.rows(), len(replay.rows())
    across = np.vstack([J, *(replay.driving(one) for one in machine.drivers)]).T
    solved, condition, free = _minimum_norm(across, tau)
    free[:known] &= replay.planar()
    left = float(np.linalg.norm(tau - across @ solved)) / scale.torque
    found.balance.append((left, float(np.linalg.norm(terms)) / scale.torque))
    replay.apply(replay.loads())
    for driver, x, loose in zip(machine.drivers, solved[known:], free[known:], strict=True):
        unit = scale.torque if isinstance(driver, AngleDriver) else scale.force
        kind = "torque" if isinstance(driver, AngleDriver) else "force"
        if loose:
            not_unique.add(driver.name)
        ours = run.effort(driver.name)[step]
        found.add(f"{driver.name}.effort", kind, ours, x / unit)
        replay.apply(replay.forces(driver, float(x)))
    _closures(replay, solved[:known], free[:known], found, not_unique)
    data.qacc[:] = replay.a[step]
    replay.find_joint_forces()
    redundant = bool(free.any())
    for name, branch in _hung(made):
        _tree_joint(replay, name, branch, found)
        if redundant and branch.joint and not _is_unique(run, branch.joint.name):
            not_unique.add(branch.joint.name)
    return condition


def _is_unique(run: Solution, joint: str) -> bool:
    """Whether a joint's force is unique by the run."""
    unique = run.reaction(joint).unique
    return unique is not None and all(unique)


def _minimum_norm(across: Array, tau: Array) -> tuple[Array, float, Array]:
    """x of least norm with `across` x = τ, its condition, and which components of x are not
    unique.
    """
    scale = np.linalg.norm(across, axis=0)
    kept = scale > tol.COMPARISON_ROW_NONE * scale.max(initial=tol.TINY)
    x, free = np.zeros(len(scale)), ~kept
    if not kept.any():
        return x, 1.0, free
    part = across[:, kept] / scale[kept]
    u, s, vt = np.linalg.svd(part, full_matrices=part.shape[1] > part.shape[0])
    rank = int((s > tol.SINGULAR_VALUE_ZERO * s[0]).sum())
    x[kept] = (vt[:rank].T @ ((u[:, :rank].T @ tau) / s[:rank])) / scale[kept]
    free[kept] = np.abs(vt[rank:]).max(axis=0, initial=0.0) > tol.COMPARISON_FORCE_UNIQUE
    return x, float(s[0] / s[rank - 1]), free


def _closures(
    replay: Replay, x: Array, free: Array, found: _ForceTable, not_unique: set[str]
) -> None:
    """Apply the forces of the constraints that close loops, and add them as joint forces."""
    model, scale, step = replay.model, replay.made.scale, replay.step
    for n in range(model.neq):
        mine = replay.data.efc_id == n
        part, name = x[mine], model.eq(n).name
        element: Any = replay.elements[name]
        kind = type(element)
        if free[mine].any():
            not_unique.add(name)
        if kind is AngleCoupling:
            ours = replay.run.effort(name)[step]
            found.add(f"{name}.effort", "torque", ours, part[0] / scale.torque)
            for term in element.parts:
                base, body = term.bodies
                replay.apply(torque_pair(base, body, float(term.factor * part[0])))
        if kind in (AngleCoupling, Gear):
            continue
        if kind is Revolute:
            push, torque = -part[:2] if element.i.body != "ground" else part[:2], 0.0
        elif kind is Distance:
            i, j = replay.end(element, "i"), replay.end(element, "j")
            push, torque = part[0] * (j - i) / np.hypot(*(j - i)), 0.0
        else:
            first, other, at, push, torque = replay.weld(n, part)
            if kind is not Fixed:
                replay.add_force(first, at, push, torque)
                replay.add_force(other, at, -push, -torque)
                continue
            push, torque = -push, -torque
        j = replay.end(element, "j")
        for body, sign in ((element.i.body, -1.0), (element.j.body, 1.0)):
            replay.add_force(replay.bodies[body], j, sign * push, sign * torque)
        reaction = replay.run.reaction(name)
        both = (reaction.fx[step], reaction.fy[step])
        found.add(f"{name}.force", "force", both, push / scale.force)
        if kind is Fixed:
            found.add(f"{name}.torque", "torque", reaction.torque[step], torque / scale.torque)


def _hung(made: Exported) -> list[tuple[str, Branch]]:
    """Bodies of the file by name, with their branches: those with a joint of the mechanism."""
    return [(name, branch) for name, branch in made.hung if branch.joint is not None]


def _tree_joint(replay: Replay, name: str, branch: Branch, found: _ForceTable) -> None:
    """Add the force of the joint that connects a body to its parent."""
    joint, data, model = branch.joint, replay.data, replay.model
    assert joint is not None
    b = model.body(safe(name)).id
    torque, force = data.cfrc_int[b][2], data.cfrc_int[b][3:5]
    centre = data.subtree_com[model.body_rootid[b]][:2]
    j = replay.end(joint, "j")
    about = torque + (centre[0] - j[0]) * force[1] - (centre[1] - j[1]) * force[0]
    sign = -1.0 if branch.reversed else 1.0
    ours, step, scale = replay.run.reaction(joint.name), replay.step, replay.made.scale
    reaction = (ours.fx[step], ours.fy[step])
    found.add(f"{joint.name}.force", "force", reaction, sign * force / scale.force)
    if type(joint) in (Prismatic, Fixed):
        theirs = sign * about / scale.torque
        found.add(f"{joint.name}.torque", "torque", ours.torque[step], theirs)

"""What acts along the coordinates of a spatial model's joints and tendons, in its plane.

Springs, dampers, friction, armatures, limits and actuators act along one coordinate each: the angle
of a hinge, the way of a slide, the length of a tendon. Where no element measures it, a shaft does:
a body without mass on a pin of the ground, coupled to it, by 1 rad a metre of a length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mbody.core.tolerances import FILE_AXES_PARALLEL, FILE_PLACES_SAME
from mbody.exchange.imported import refusal, seen
from mbody.model.body import Body
from mbody.model.contact import Rope
from mbody.model.coupling import AngleCoupling, CouplingTerm, LengthCoupling
from mbody.model.element import Element, Marker
from mbody.model.joints import Clutch, FrictionForce, Revolute
from mbody.model.loads import Damper, Force, Spring, Torque, TorsionDamper, TorsionSpring
from mbody.model.states import Input
from mbody.model.stop import Stop

# -- A spatial model and the plane in which it moves: all hinges across it, all slides in it ---

Array = np.ndarray


@dataclass(frozen=True)
class Plane:
    """Two axes of unit length, and the normal that they turn about.

    The normal is chosen so that the x axis of the plane is that of the file, or else its y axis.
    """

    x: Array
    y: Array

    @property
    def normal(self) -> Array:
        """The direction about which angles are counter-clockwise."""
        return np.cross(self.x, self.y)

    def flat(self, vector: Array) -> tuple[float, float]:
        """The two components of a vector in the plane."""
        return float(vector @ self.x), float(vector @ self.y)

    def sign(self, axis: Array) -> float:
        """1 where a hinge turns counter-clockwise about its axis, −1 where clockwise."""
        return 1.0 if axis @ self.normal > 0.0 else -1.0

    def rotation_angle(self, matrix: Array) -> float:
        """The angle of a rotation about the normal."""
        x, y = self.flat(matrix @ self.x)
        return float(np.arctan2(y, x))

    def lies_in(self, axis: Array) -> bool:
        """Whether a direction lies in the plane."""
        return abs(float(axis @ self.normal)) <= FILE_AXES_PARALLEL

    def is_across(self, axis: Array) -> bool:
        """Whether a direction is the normal or its opposite."""
        return float(np.hypot(*self.flat(axis))) <= FILE_AXES_PARALLEL


def plane_of(hinges: list[Any], slides: list[Any], gravity: Array) -> Plane:
    """The plane of a model. `hinges`, `slides`, `gravity` (3,)."""
    if hinges:
        normal = hinges[0]
    else:
        others = [*slides[1:], gravity, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])]
        normal = next(
            n for n in (np.cross(slides[0], v) for v in others) if n @ n > FILE_AXES_PARALLEL**2
        )
    normal = normal / np.linalg.norm(normal)
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = up - (up @ normal) * normal
    y /= np.linalg.norm(y)
    x = np.cross(y, normal)
    main = 0 if abs(x[0]) > FILE_AXES_PARALLEL else 1
    return Plane(x if x[main] > 0.0 else -x, y)


def check_axes(plane: Plane, name: str, axis: Array, *, hinge: bool) -> None:
    """Refuse a joint that leaves the plane."""
    fits = plane.is_across(axis) if hinge else plane.lies_in(axis)
    if not fits:
        given = ", ".join(f"{part:.4g}" for part in axis)
        across = ", ".join(f"{part:.4g}" for part in plane.normal)
        what = "is not parallel to" if hinge else "is not across"
        raise refusal(
            name,
            f"its axis ({given}) {what} the hinges' axis ({across}): only mechanisms that move in "
            "one plane are read",
        )


class Spatial(Protocol):
    """A compiled spatial model, its plane and names."""

    mujoco: Any
    model: Any
    data: Any
    plane: Plane
    gravity: Array
    names: dict[int, str]
    points: dict[int, dict[str, tuple[float, float]]]
    shapes: dict[int, dict[str, Any]]
    notes: list[str]

    def name(self, kind: str, index: int) -> str:
        """The name of an object in its file, a number where it has none."""

    def label(self, kind: str, index: int) -> str:
        """The same as a name of a point or a part of one."""

    def element(self, kind: str, index: int) -> str:
        """The name of the element that an object is, of no other; a note where it is changed."""

    def unique(self, wanted: str) -> str:
        """A name that no element has yet."""

    def is_off(self, feature: str) -> bool:
        """Whether a flag of the file switches a feature off."""

    def root(self, body: int) -> int:
        """The body that carries a body."""

    def parent(self, body: int) -> str:
        """The name of what the joints of a body are on."""

    def moving(self) -> list[int]:
        """The bodies that move against their carriers."""

    def offset(self, body: int, at: np.ndarray) -> tuple[float, float]:
        """A point of space in the plane axes of a body."""

    def place(self, body: int, label: str, at: np.ndarray) -> str:
        """A named point of a body."""

    def on_joint(self, joint: int) -> list[int]:
        """The actuators of a joint."""

    def on_tendon(self, tendon: int) -> list[int]:
        """The actuators of a tendon."""

    def target_of(self, actuator: int) -> tuple[str, int]:
        """The joint or tendon of an actuator."""

    def constrained_tendons(self) -> list[int]:
        """The tendons whose length is kept."""


# -- Fields of a model that MuJoCo has compiled: what is taken, what moves nothing, what is
#    refused -----------------------------------------------------------------------------------
#
# An attribute of MJCF or URDF that changes a motion ends in a field of MuJoCo's ``mjModel``,
# whatever defaults, classes, includes and compiler settings it came through. So the fields are gone
# through.


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Fields that the bodies, joints, loads and contacts of the imported model are made of.
TAKEN = _words("""
    qpos0 qpos_spring
    body_parentid body_weldid body_mocapid body_jntnum body_jntadr body_pos body_quat body_ipos
    body_iquat body_mass body_inertia body_gravcomp
    jnt_type jnt_qposadr jnt_dofadr jnt_bodyid jnt_limited jnt_actfrclimited jnt_actfrcrange
    jnt_actgravcomp jnt_pos jnt_axis jnt_stiffness jnt_range jnt_margin
    dof_jntid dof_frictionloss dof_armature dof_damping
    geom_type geom_contype geom_conaffinity geom_condim geom_bodyid geom_priority geom_size geom_pos
    geom_quat geom_friction geom_margin geom_surfacevel geom_adhesion
    site_bodyid site_pos site_quat
    pair_dim pair_geom1 pair_geom2 pair_margin pair_adhesion pair_friction exclude_signature
    eq_type eq_obj1id eq_obj2id eq_objtype eq_active0 eq_data
    tendon_adr tendon_num tendon_limited tendon_actfrclimited tendon_range tendon_actfrcrange
    tendon_margin tendon_stiffness tendon_damping tendon_armature tendon_frictionloss
    tendon_lengthspring tendon_length0 wrap_type wrap_objid wrap_prm
    actuator_trntype actuator_dyntype actuator_gaintype actuator_biastype actuator_ctrladr
    actuator_trnid actuator_gainprm actuator_biasprm actuator_damping actuator_armature
    actuator_group actuator_forcelimited actuator_forcerange actuator_ctrllimited
    actuator_ctrlrange actuator_gear actuator_outadr
    """)
#: Fields that are refused where they are not zero: the kind of object, the field, what it is.
REFUSED = (
    ("JOINT", "jnt_stiffnesspoly", "its spring has higher terms of the displacement"),
    ("JOINT", "jnt_springyield", "its spring yields"),
    ("TENDON", "tendon_stiffnesspoly", "its spring has higher terms of the length"),
    ("TENDON", "tendon_dampingpoly", "its damping has higher terms of the rate"),
    ("TENDON", "tendon_springyield", "its spring yields"),
    ("ACTUATOR", "actuator_dampingpoly", "its damping has higher terms of the rate"),
    ("ACTUATOR", "actuator_delay", "it acts with a delay"),
)
#: Fields of plugins, sleep, higher terms of damping, and of a medium.
REFUSED_OTHERWISE = _words("""
    dof_dampingpoly body_plugin geom_plugin actuator_plugin tree_sleep_policy geom_fluid
    """)
#: How MuJoCo solves: impedances and time constants of constraints, which are rigid here, and
#: memory, orders and sums that it makes of the other fields.
SOLVER = _words(
    """
    jnt_solref jnt_solimp dof_solref dof_solimp geom_solmix geom_solref geom_solimp geom_gap
    pair_solref pair_solreffriction pair_solimp pair_gap eq_solref eq_solimp tendon_solref_lim
    tendon_solimp_lim tendon_solref_fri tendon_solimp_fri body_rootid body_dofnum body_dofadr
    body_treeid body_geomnum body_geomadr body_simple body_sameframe body_subtreemass
    body_invweight0 body_margin body_contype body_conaffinity body_bvhadr body_bvhnum
    jnt_actuatorid jnt_plasticadr dof_bodyid dof_parentid dof_treeid dof_Madr dof_simplenum
    dof_invweight0 dof_M0 dof_length tree_bodyadr tree_bodynum tree_dofadr tree_dofnum
    geom_dataid geom_sameframe geom_aabb geom_rbound site_dataid site_sameframe pair_signature
    tendon_type tendon_actuatorid tendon_plasticadr tendon_treenum tendon_treeid ten_J_rownnz
    ten_J_rowadr ten_J_colind tendon_invweight0 actuator_ctrlnum actuator_ctrlspec
    actuator_outnum actuator_actadr actuator_actnum actuator_dynprm actuator_actlimited
    actuator_actrange actuator_actearly actuator_cranklength actuator_history
    actuator_historyadr actuator_acc0 actuator_length0 actuator_lengthrange flg_gravcomp
    flg_surfacevel flg_adhesion signature
    """
)
#: Beginnings of fields that are seen, measured, named or kept: pictures, sensors, key frames.
MOVES_NOTHING = (
    "cam_", "light_", "mat_", "mesh_", "skin_", "tex_", "text_", "hfield_", "sensor_", "key_",
    "name_", "names", "numeric_", "tuple_", "bvh_", "oct_", "paths", "plugin", "B_", "M_", "D_",
    "mapM2", "mapD2", "efm0_", "efmC_",
)  # fmt: skip
#: Ends of fields that are for pictures or for the user's own use.
SEEN = ("_user", "_group", "_matid", "_rgba", "_width", "_castshadow", "site_type", "site_size")
#: Fields of ``mjOption``.
OPTIONS_TAKEN = _words("gravity density viscosity wind disableflags enableflags disableactuator")
OPTIONS_OF_CONTACTS = _words("o_margin o_friction")
OPTIONS_OF_THE_SOLVER = _words("""
    timestep impratio tolerance ls_tolerance noslip_tolerance ccd_tolerance sleep_tolerance
    magnetic o_solref o_solimp integrator cone jacobian solver iterations ls_iterations
    noslip_iterations ccd_iterations sdf_initpoints sdf_iterations
    """)


def is_known(field: str) -> bool:
    """Whether a field of ``mjModel`` is in the tables.

    >>> is_known("body_mass"), is_known("cam_fovy"), is_known("dof_magic")
    (True, True, False)
    """
    return (
        field in TAKEN | REFUSED_OTHERWISE | SOLVER
        or any(field == name for _, name, _ in REFUSED)
        or field.startswith((*MOVES_NOTHING, "flex"))
        or field.endswith(SEEN)
    )


def fields(model: Any) -> Iterator[str]:
    """The names of the arrays of a compiled model."""
    for name in dir(model):
        if not name.startswith("_") and isinstance(getattr(model, name, None), np.ndarray):
            yield name


def check_fields(mujoco: Any, model: Any, name: Any) -> list[str]:
    """Refuse what would move the model and has no counterpart; notes on fields that are not known,
    of a newer MuJoCo. `name`: Of an object of a kind.
    """
    for kind, field, why in REFUSED:
        values = np.asarray(getattr(model, field, ())).reshape(-1)
        if values.any():
            rows = np.asarray(getattr(model, field))
            n = int(np.flatnonzero(rows.reshape(len(rows), -1).any(axis=1))[0])
            raise refusal(f"the {kind.lower()} {seen(name(kind, n))}", f"{why}, which is not read")
    _check_whole(mujoco, model, name)
    unknown = [
        field for field in fields(model) if not is_known(field) and getattr(model, field).any()
    ]
    if unknown:
        return [
            f"MuJoCo {mujoco.__version__} has fields that are not known here and not taken: "
            f"{', '.join(unknown)}"
        ]
    return []


def _check_whole(mujoco: Any, model: Any, name: Any) -> None:
    for n in np.flatnonzero(model.dof_dampingpoly.any(axis=-1))[:1]:
        joint = name("JOINT", int(model.dof_jntid[n]))
        raise refusal(
            f"the joint {seen(joint)}",
            "its damping has higher terms of the rate, which is not read",
        )
    for kind, field in (("BODY", "body"), ("GEOM", "geom"), ("ACTUATOR", "actuator")):
        for n in np.flatnonzero(getattr(model, f"{field}_plugin") >= 0)[:1]:
            raise refusal(
                f"the {field} {seen(name(kind, int(n)))}",
                "a plugin of MuJoCo moves it or shapes it",
            )
    for body in np.flatnonzero(model.body_mocapid >= 0)[:1]:
        raise refusal(f"the body {seen(name('BODY', int(body)))}", "it is moved by mocap")
    if model.nflex:
        raise refusal(
            f"the flex {seen(name('FLEX', 0))}", "it is deformable, bodies are rigid here"
        )
    asleep = model.tree_sleep_policy == int(mujoco.mjtSleepPolicy.mjSLEEP_INIT)
    sleeps = model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    for tree in np.flatnonzero(asleep)[:1] if sleeps else ():
        body = name("BODY", int(model.tree_bodyadr[tree]))
        raise refusal(f"the body {seen(body)}", "it is asleep until something touches it")


FREE, SLIDE, HINGE = 0, 2, 3
WRAP_JOINT, WRAP_SITE = 1, 3
Range = tuple[float, float] | None


@dataclass
class Coordinate:
    """One coordinate, from the reference position, and what acts along it.

    `what`, `label`: Of the object, for a sentence and for names of elements.
    `terms`: Whose sum it is.
    `turns`: Of an angle of two bodies: body, the other body, sign.
    `ends`: Of an angle the places of the pin; of a slide the marker of the guide and the place in
      it.
    `reference`, `rest`: Its value in the file at the reference position; that of the spring from
      there.
    `limits`: From the reference position.
    """

    what: str
    label: str
    terms: list[CouplingTerm]
    turns: tuple[str, str, float] | None = None
    ends: tuple[Any, Any] | None = None
    reference: float = 0.0
    rest: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    limits: Range = None

    @property
    def is_length(self) -> bool:
        """Whether lengths are among its terms."""
        return any(term.ends for term in self.terms)

    @property
    def acts(self) -> bool:
        """Whether anything acts along it."""
        values = self.stiffness, self.damping, self.friction, self.armature
        return any(values) or self.limits is not None


# -- The coordinates of joints -----------------------------------------------------------------


def slide_marker(space: Spatial, body: int, label: str, at: np.ndarray, joint: int) -> Marker:
    """A place with the direction of a slide."""
    x, y = space.plane.flat(space.data.xaxis[joint])
    carrier, _, point = space.place(body, label, at).rpartition(".")
    return Marker(carrier, point, float(np.arctan2(y, x)))


def slide_ends(space: Spatial, joint: int) -> tuple[Marker, Any, float]:
    """The guide of a slide, the place in it, and the sign of its displacement along the guide."""
    model = space.model
    body = int(model.jnt_bodyid[joint])
    parent, start = int(model.body_parentid[body]), int(model.body_jntadr[body])
    joints = range(start, start + int(model.body_jntnum[body]))
    hinges = [n for n in joints if model.jnt_type[n] == HINGE]
    at = space.data.xanchor[hinges[0] if hinges else joint]
    label = space.label("JOINT", joint)
    others = [n for n in joints if model.jnt_type[n] == SLIDE and n != joint]
    square = all(
        abs(float(space.data.xaxis[joint] @ space.data.xaxis[n])) <= FILE_AXES_PARALLEL
        for n in others
    )
    turned = bool(hinges) and hinges[0] < joint
    if not square or (turned and others):
        raise refusal(
            f"the joint {seen(space.name('JOINT', joint))}",
            "it is one of two slides that are not square to each other, or come after a hinge: "
            "what acts along it is not read",
        )
    if turned:  # the body slides on a pin of its parent
        return slide_marker(space, body, label, at, joint), space.place(parent, label, at), -1.0
    guide = slide_marker(space, parent, label, at, joint)
    return guide, slide_marker(space, body, label, at, joint), 1.0


def joint_term(space: Spatial, joint: int, factor: float) -> CouplingTerm:
    """The displacement of a joint from its reference, times a factor, as a term of a coupling."""
    model = space.model
    body = int(model.jnt_bodyid[joint])
    if model.jnt_type[joint] == HINGE:
        sign = space.plane.sign(space.data.xaxis[joint])
        return CouplingTerm(sign * factor, angle=space.names[body], relative_to=space.parent(body))
    guide, place, sign = slide_ends(space, joint)
    return CouplingTerm(sign * factor, coordinate=(guide, place))


def limits_of(space: Spatial, joint: int) -> Range:
    """The least and the greatest displacement of a joint from its reference."""
    model = space.model
    if not model.jnt_limited[joint] or space.is_off("LIMIT"):
        return None
    margin = float(model.jnt_margin[joint])
    low, high = (float(v) - reference_of(space, joint) for v in model.jnt_range[joint])
    return low + margin, high - margin


def reference_of(space: Spatial, joint: int) -> float:
    """The value of a joint's coordinate at the reference position."""
    return float(space.model.qpos0[space.model.jnt_qposadr[joint]])


def damping_of(space: Spatial, joint: int) -> float:
    """The damping of a joint, with that of its actuators."""
    if space.is_off("DAMPER"):
        return 0.0
    own = float(space.model.dof_damping[space.model.jnt_dofadr[joint]])
    return own + _of_actuators(space, "actuator_damping", space.on_joint(joint))


def _of_actuators(space: Spatial, field: str, actuators: list[int]) -> float:
    """A number of actuators at their joint or tendon, times the square of the gear."""
    return sum(float(getattr(space.model, field)[a]) * _gear(space, a) ** 2 for a in actuators)


def _gear(space: Spatial, actuator: int) -> float:
    return float(space.model.actuator_gear[space.model.actuator_outadr[actuator]][0])


def of_joint(space: Spatial, joint: int) -> list[Coordinate]:
    """The coordinates of a joint: one, of a free one three."""
    model, label = space.model, space.label("JOINT", joint)
    what = f"the joint {seen(space.name('JOINT', joint))}"
    dof, body = int(model.jnt_dofadr[joint]), int(model.jnt_bodyid[joint])
    stiffness = 0.0 if space.is_off("SPRING") else float(np.ravel(model.jnt_stiffness[joint])[0])
    loss = 0.0 if space.is_off("FRICTIONLOSS") else float(model.dof_frictionloss[dof])
    common: dict[str, Any] = {
        "stiffness": stiffness,
        "damping": damping_of(space, joint),
        "friction": loss,
    }
    common["armature"] = float(model.dof_armature[dof]) + _of_actuators(
        space, "actuator_armature", space.on_joint(joint)
    )
    if model.jnt_type[joint] == FREE:
        return _of_free(space, body, label, what, common)
    reference = reference_of(space, joint)
    one = Coordinate(what, label, [], reference=reference, limits=limits_of(space, joint), **common)
    one.rest = float(model.qpos_spring[model.jnt_qposadr[joint]]) - reference
    if model.jnt_type[joint] == HINGE:
        at, parent = space.data.xanchor[joint], int(model.body_parentid[body])
        sign = space.plane.sign(space.data.xaxis[joint])
        one.turns = space.names[body], space.parent(body), sign
        one.ends = space.place(parent, label, at), space.place(body, label, at)
        one.terms = [joint_term(space, joint, 1.0)]
    elif one.acts or space.on_joint(joint):
        guide, place, sign = slide_ends(space, joint)
        one.ends = guide, place
        one.terms = [CouplingTerm(sign, coordinate=(guide, place))]
    return [one]


def _of_free(
    space: Spatial, body: int, label: str, what: str, common: dict[str, Any]
) -> list[Coordinate]:
    """Two slides of the ground and an angle."""
    if not any(common.values()):
        return []
    at, own = space.data.xpos[body], space.names[body]
    found: list[Coordinate] = []
    for axis, name in ((space.plane.x, "x"), (space.plane.y, "y")):
        if common["friction"] and not np.isclose(abs(axis).max(), 1.0, atol=FILE_AXES_PARALLEL):
            raise refusal(what, "its friction is along axes that do not lie in the plane")
        direction = 0.0 if name == "x" else 0.5 * math.pi
        carrier, _, point = space.place(0, f"{label}_{name}", at).rpartition(".")
        guide, place = Marker(carrier, point, direction), space.place(body, label, at)
        term = CouplingTerm(1.0, coordinate=(guide, place))
        found.append(Coordinate(what, f"{label}_{name}", [term], ends=(guide, place), **common))
    pins = space.place(0, label, at), space.place(body, label, at)
    turn = CouplingTerm(1.0, angle=own, relative_to="ground")
    angle = Coordinate(what, label, [turn], turns=(own, "ground", 1.0), ends=pins, **common)
    return [*found, angle]


# -- The elements that act along a coordinate --------------------------------------------------


def elements_along(
    space: Spatial, one: Coordinate, native: bool, motors: list[int]
) -> list[Element]:
    """All that acts along a coordinate; `native`: a joint has its limits and its damping.

    `motors`: The actuators that act along it.
    """
    found: list[Element] = []
    limits, damping = (None, 0.0) if native else (one.limits, one.damping)
    label, turns = one.label, one.turns
    turning = one.stiffness or damping or motors or (one.friction and not one.ends)
    if one.armature or limits is not None or (turns is None and turning):
        shaft, more = _shaft(space, one, limits)
        found += more
        turns = turns or (shaft, "ground", 1.0)
    if one.friction:
        name = space.unique(f"{label}_friction")
        if one.ends and one.turns is None:
            found.append(FrictionForce(name, one.ends[0], one.ends[1], force=one.friction))
        else:
            pins = one.ends or ("ground", turns[0] if turns else "")
            found.append(Clutch(name, pins[0], pins[1], torque=one.friction))
    if turns is None:
        return found
    body, base, sign = turns
    if one.stiffness:
        name, free = space.unique(f"{label}_spring"), sign * one.rest
        found.append(TorsionSpring(name, body, by=base, stiffness=one.stiffness, free_angle=free))
    if damping:
        name = space.unique(f"{label}_damper")
        found.append(TorsionDamper(name, body, by=base, coefficient=damping))
    return found + _motors(space, one, turns, motors)


def _shaft(space: Spatial, one: Coordinate, limits: Range) -> tuple[str, list[Element]]:
    """A shaft that turns by a coordinate."""
    name = space.unique(f"{one.label}_shaft")
    kind = LengthCoupling if one.is_length else AngleCoupling
    per = "metre" if one.is_length else "radian"
    space.notes.append(
        f"{one.what}: what acts along it is on the shaft {name}, which turns by 1 rad a {per} of it"
    )
    held: dict[str, Any] = {} if limits is None else {"limits": limits}
    return name, [
        Body(name, mass=0.0, inertia=one.armature),
        Revolute(space.unique(f"{name}_pin"), "ground", name, **held),
        kind(space.unique(f"{name}_drive"), [*one.terms, CouplingTerm(-1.0, angle=name)]),
    ]


# -- Actuators ---------------------------------------------------------------------------------


def motors_of(space: Spatial) -> dict[tuple[str, int], list[int]]:
    """The actuators that are taken, by the joint or the tendon that they act on; the others do
    nothing at a control of 0, and are noted, or are refused.
    """
    model, mj = space.model, space.mujoco
    found: dict[tuple[str, int], list[int]] = {}
    idle, off = [], []
    for a in range(model.nactuator):
        name = space.name("ACTUATOR", a)
        group = int(model.actuator_group[a])
        if space.is_off("ACTUATION") or model.opt.disableactuator >> max(group, 0) & 1:
            off.append(name)
            continue
        kind, target = space.target_of(a)
        read = (kind == "JOINT" and model.jnt_type[target] in (SLIDE, HINGE)) or (
            kind == "TENDON" and is_fixed(space, target)
        )
        plain = (
            _is(model.actuator_dyntype[a], mj.mjtDyn.mjDYN_NONE)
            and _is(model.actuator_gaintype[a], mj.mjtGain.mjGAIN_FIXED)
            and _is(model.actuator_biastype[a], mj.mjtBias.mjBIAS_NONE, mj.mjtBias.mjBIAS_AFFINE)
        )
        if read and plain:
            found.setdefault((kind, target), []).append(a)
        elif _does_nothing(space, a):
            idle.append(name)
        else:
            raise refusal(
                f"the actuator {seen(name)}",
                "it acts at a control of 0 too, by a law that is not read: motor, position, "
                "velocity and general without dynamics are, on hinges, slides and fixed tendons",
            )
    if idle:
        space.notes.append(
            f"not taken: actuator {', '.join(idle)}, which does nothing at a control of 0 (a "
            "driver or a load takes its place)"
        )
    if off:
        space.notes.append(f"not taken: actuator {', '.join(off)}, switched off in the file")
    return found


def _does_nothing(space: Spatial, a: int) -> bool:
    """Whether an actuator has no force at a control of 0, from an activation of 0."""
    model, mj = space.model, space.mujoco
    adr = int(model.actuator_ctrladr[a])
    ranges = [
        (model.actuator_forcelimited[a], model.actuator_forcerange[a]),
        (model.actuator_actlimited[a], model.actuator_actrange[a]),
    ]
    if adr >= 0 and adr < model.nu:
        ranges.append((model.actuator_ctrllimited[adr], model.actuator_ctrlrange[adr]))
    dyn, gain = mj.mjtDyn, mj.mjtGain
    affine = _is(model.actuator_biastype[a], mj.mjtBias.mjBIAS_AFFINE)
    straight = affine and not model.actuator_biasprm[a].any()
    waits = dyn.mjDYN_INTEGRATOR, dyn.mjDYN_FILTER, dyn.mjDYN_FILTEREXACT
    return (
        _is(model.actuator_gaintype[a], gain.mjGAIN_FIXED, gain.mjGAIN_AFFINE)
        and (_is(model.actuator_biastype[a], mj.mjtBias.mjBIAS_NONE) or straight)
        and _is(model.actuator_dyntype[a], dyn.mjDYN_NONE, *waits)
        and all(not on or low <= 0.0 <= high for on, (low, high) in ranges)
    )


def _is(value: Any, *kinds: Any) -> bool:
    """Whether a number of the model is one of MuJoCo's constants."""
    return int(value) in [int(kind) for kind in kinds]


def _motors(
    space: Spatial, one: Coordinate, turns: tuple[str, str, float], motors: list[int]
) -> list[Element]:
    """Torques by formulas of inputs, and of the coordinate where the actuator knows it."""
    model = space.model
    found: list[Element] = []
    body, base, sign = turns
    angle = body + (f".angle - {base}.angle" if base != "ground" else ".angle")
    rate = body + (f".omega - {base}.omega" if base != "ground" else ".omega")
    clamped = _total_limit(space, one, motors) if motors else None
    for a in motors:
        name = space.element("ACTUATOR", a)
        control = space.unique(f"{name}_control")
        gear, adr = _gear(space, a), int(model.actuator_ctrladr[a])
        gain, bias = (
            float(model.actuator_gainprm[a][0]),
            [float(v) for v in model.actuator_biasprm[a]],
        )
        servo = _is(model.actuator_biastype[a], space.mujoco.mjtBias.mjBIAS_AFFINE)
        unit = "N" if one.is_length else "N*m"
        u = f"{control}*1 N*m" if servo else f"{control}*1 m" if one.is_length else control
        if model.actuator_ctrllimited[adr] and not space.is_off("CLAMPCTRL"):
            low, high = (float(v) for v in model.actuator_ctrlrange[adr])
            u = f"clamp({u}, {low!r} N*m, {high!r} N*m)"
        law = f"{gain!r}*{u}"
        if servo:
            law += f" + {bias[0]!r} N*m"
            if bias[1]:
                law += f" + {bias[1] * gear!r} N*m/rad*({one.reference!r} rad + {sign!r}*({angle}))"
            if bias[2]:
                law += f" + {bias[2] * gear * sign!r} N*m*s/rad*({rate})"
        if model.actuator_forcelimited[a]:
            low, high = (float(v) for v in model.actuator_forcerange[a])
            law = f"clamp({law}, {low!r} N*m, {high!r} N*m)"
        law = f"{gear!r}*({law})"
        if clamped:
            law = f"clamp({law}, {clamped[0]!r} N*m, {clamped[1]!r} N*m)"
        law = law if sign > 0.0 else f"-({law})"
        found.append(Input(control, "0" if servo else f"0 {unit}"))
        found.append(Torque(name, body, by=base, value=law))
        space.notes.append(f"the actuator {name} has the input {control}, which is 0")
    return found


def _total_limit(space: Spatial, one: Coordinate, motors: list[int]) -> Range:
    """The limits of all actuators together at a joint or a tendon."""
    model = space.model
    kind, target = space.target_of(motors[0])
    field = "jnt" if kind == "JOINT" else "tendon"
    if not getattr(model, f"{field}_actfrclimited")[target]:
        return None
    if len(motors) > 1:
        raise refusal(one.what, "a limit of the force of several actuators together is not read")
    low, high = (float(v) for v in getattr(model, f"{field}_actfrcrange")[target])
    return low, high


def gravity_compensation(space: Spatial) -> list[Element]:
    """The forces that carry a part of the weight of bodies."""
    model = space.model
    found: list[Element] = []
    gx, gy = space.plane.flat(space.gravity)
    weight = math.hypot(gx, gy)
    for body in np.flatnonzero(model.body_gravcomp) if weight else ():
        n = int(body)
        value = float(model.body_gravcomp[n] * model.body_mass[n] * weight)
        if not value or not space.root(n):
            continue
        for joint in np.flatnonzero(model.jnt_actgravcomp)[:1]:
            raise refusal(
                f"the joint {seen(space.name('JOINT', int(joint)))}",
                "its actuators carry weight (actuatorgravcomp), which is not read",
            )
        name = space.unique(f"{space.label('BODY', n)}_gravcomp")
        at = space.place(n, name, space.data.xipos[n])
        found.append(Force(name, at, value, angle=math.atan2(-gy, -gx)))
    return found


def drag(space: Spatial) -> list[Element]:
    """The forces of a medium on the box that has the mass and the inertia of a body, as MuJoCo's:
    along its two axes in the plane, and a torque.
    """
    model = space.model
    found: list[Element] = []
    density, viscosity = float(model.opt.density), float(model.opt.viscosity)
    if not density and not viscosity:
        return []
    wind = space.plane.flat(np.array(model.opt.wind))
    for body in range(1, model.nbody):
        mass, moments = float(model.body_mass[body]), model.body_inertia[body]
        if not space.root(body) or not mass:
            continue
        axes = space.data.ximat[body].reshape(3, 3).T
        out = next((n for n in range(3) if space.plane.is_across(axes[n])), None)
        fluid = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
        if out is None or any(model.geom_fluid[g][0] for g in fluid):
            raise refusal(
                f"the body {seen(space.name('BODY', body))}",
                "it is in a medium, and its shapes have drag of their own (fluidshape) or the axes "
                "of its inertia do not lie in the plane: that is not read",
            )
        box = np.sqrt(6.0 / mass * np.maximum(moments.sum() - 2.0 * moments, 0.0))
        mean, label = float(box.mean()), f"{space.label('BODY', body)}_drag"
        at, own = space.place(body, label, space.data.xipos[body]), space.names[space.root(body)]
        along, across = 3.0 * math.pi * viscosity * mean, math.pi * viscosity * mean**3
        for n in (k for k in range(3) if k != out):
            x, y = space.plane.flat(axes[n])
            angle, area = math.atan2(y, x), float(np.prod(np.delete(box, n)))
            turned = f"({own}.angle + {angle!r} rad)"
            vx, vy = (f"({at}.v{key} - {u!r} m/s)" for key, u in zip("xy", wind, strict=True))
            v = f"({vx}*cos{turned} + {vy}*sin{turned})"
            law = f"-{along!r} N*s/m*{v} - {0.5 * density * area!r} kg/m*abs({v})*{v}"
            found.append(Force(space.unique(label), at, law, angle=angle, follows=True))
        b, c = np.delete(box, out)
        turning = density * float(box[out] * (b**4 + c**4)) / 64.0
        w = f"{own}.omega"
        law = f"-{across!r} N*m*s/rad*{w} - {turning!r} N*m*s^2/rad^2*abs({w})*{w}"
        found.append(Torque(space.unique(label), own, value=law))
    space.notes.append("the drag of the medium is on bodies as loads, by formulas of their rates")
    return found


# -- Tendons -----------------------------------------------------------------------------------


def _wraps(space: Spatial, tendon: int) -> list[tuple[int, int, float]]:
    """(kind, object, number) of what a tendon passes."""
    model, start = space.model, int(space.model.tendon_adr[tendon])
    rows = range(start, start + int(model.tendon_num[tendon]))
    return [
        (int(model.wrap_type[n]), int(model.wrap_objid[n]), float(model.wrap_prm[n])) for n in rows
    ]


def is_fixed(space: Spatial, tendon: int) -> bool:
    """Whether a tendon is a sum of joints."""
    return all(kind == WRAP_JOINT for kind, _, _ in _wraps(space, tendon))


def tendon_terms(space: Spatial, tendon: int, what: str) -> list[CouplingTerm]:
    """The terms of a fixed tendon; none of a spatial one between two sites."""
    wraps = _wraps(space, tendon)
    if is_fixed(space, tendon):
        return [joint_term(space, joint, factor) for _, joint, factor in wraps]
    if len(wraps) != 2 or any(kind != WRAP_SITE for kind, _, _ in wraps):
        raise refusal(what, "a tendon over pulleys, bodies or more than two sites is not read")
    return []


def tendon_places(space: Spatial, tendon: int, what: str) -> tuple[str, str]:
    """The two ends of a spatial tendon between sites."""
    model, data = space.model, space.data
    sites = [site for _, site, _ in _wraps(space, tendon)]
    a, b = (data.site_xpos[site] for site in sites)
    if abs(float((b - a) @ space.plane.normal)) > FILE_PLACES_SAME * float(np.linalg.norm(b - a)):
        raise refusal(what, "its two ends do not lie in one plane of the motion")
    label = space.label("TENDON", tendon)
    i, j = (
        space.place(int(model.site_bodyid[site]), label, at)
        for site, at in zip(sites, (a, b), strict=True)
    )
    return i, j


def tendons(space: Spatial, motors: dict[tuple[str, int], list[int]]) -> list[Element]:
    """The springs, dampers, limits, friction and armatures of tendons."""
    model, found, idle = space.model, [], []
    for tendon in range(model.ntendon):
        name = space.name("TENDON", tendon)
        what = f"the tendon {seen(name)}"
        on_it = space.on_tendon(tendon)
        own = Coordinate(what, space.label("TENDON", tendon), [])
        own.reference = float(model.tendon_length0[tendon])
        if not space.is_off("SPRING"):
            own.stiffness = float(model.tendon_stiffness[tendon])
        if not space.is_off("DAMPER"):
            own.damping = float(model.tendon_damping[tendon])
            own.damping += _of_actuators(space, "actuator_damping", on_it)
        if not space.is_off("FRICTIONLOSS"):
            own.friction = float(model.tendon_frictionloss[tendon])
        own.armature = float(model.tendon_armature[tendon])
        own.armature += _of_actuators(space, "actuator_armature", on_it)
        low, high = (float(v) for v in model.tendon_lengthspring[tendon])
        if own.stiffness and low != high:
            raise refusal(what, "its spring is slack between two lengths")
        own.rest = low - own.reference
        margin = float(model.tendon_margin[tendon])
        if model.tendon_limited[tendon] and not space.is_off("LIMIT"):
            least, most = (float(v) - own.reference for v in model.tendon_range[tendon])
            own.limits = least + margin, most - margin
        acting = motors.get(("TENDON", tendon), [])
        if not own.acts and not acting:
            if not any(int(n) == tendon for n in space.constrained_tendons()):
                idle.append(name)
            continue
        own.terms = tendon_terms(space, tendon, what)
        found += (
            elements_along(space, own, False, acting) if own.terms else _line(space, tendon, own)
        )
    if idle:
        space.notes.append(f"not taken: tendon {', '.join(idle)}, which has no force")
    return found


def _line(space: Spatial, tendon: int, own: Coordinate) -> list[Element]:
    """A spring, a damper, a rope and a stop between two places."""
    if own.friction or own.armature:
        raise refusal(own.what, "friction and armature of a tendon between sites are not read")
    ends = tendon_places(space, tendon, own.what)
    found: list[Element] = []
    if own.stiffness:
        free = own.rest + own.reference
        name = space.unique(f"{own.label}_spring")
        found.append(Spring(name, *ends, stiffness=own.stiffness, free_length=free))
    if own.damping:
        found.append(Damper(space.unique(f"{own.label}_damper"), *ends, coefficient=own.damping))
    if own.limits:
        low, high = (own.reference + v for v in own.limits)
        if low > 0.0:
            across = (" - ".join(_coordinate(space, end, key) for end in ends) for key in "xy")
            name = space.unique(f"{own.label}_strut")
            found.append(Stop(name, f"hypot({', '.join(across)}) - {low!r} m"))
        found.append(Rope(space.unique(own.label), *ends, length=high))
    return found


def _coordinate(space: Spatial, place: str, key: str) -> str:
    """x or y of a named point, as formulas have it."""
    body, _, point = place.partition(".")
    if body != "ground":
        return f"{place}.{key}"
    return f"({space.points[0][point]['xy'.index(key)]!r} m)"

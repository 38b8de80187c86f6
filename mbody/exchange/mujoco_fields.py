"""Fields of a model that MuJoCo has compiled: what is taken, what moves nothing, what is refused.

An attribute of MJCF or URDF that changes a motion ends in a field of MuJoCo's ``mjModel``, whatever
defaults, classes, includes and compiler settings it came through. So the fields are gone through.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from mbody.exchange.imported import refusal, seen


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

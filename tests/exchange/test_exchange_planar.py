"""MJCF and URDF: the imported bodies against MuJoCo's own dynamics of the same file."""

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, ModelError, gallery
from mbody.engines.mjcf import to_mjcf
from mbody.exchange import import_model

mujoco = pytest.importorskip("mujoco")

ROBOT = """
<mujoco model="arm">
  <compiler angle="degree"/>
  <option gravity="0.3 0 -9.81" timestep="0.001"/>
  <default><joint damping="0.05"/><default class="stiff"><joint stiffness="3"/></default></default>
  <worldbody>
    <site name="S" pos="1 0.2 0.5"/>
    <body name="post" pos="0.1 0 0.4">
      <geom type="box" size=".1 .1 .1"/>
      <body name="upper" pos="0 0.1 0.2" euler="0 -25 0">
        <joint name="shoulder" axis="0 {s} 0" springref="30" ref="10" class="stiff"/>
        <geom type="capsule" size=".03" fromto="0 0 0 .5 0 0"/>
        <body name="lower" pos=".5 0 0" euler="0 40 0">
          <joint name="elbow" axis="0 1 0"/>
          <inertial mass="1.3" pos=".2 .01 .05" diaginertia=".02 .05 .04"/>
          <site name="T" pos=".4 0 .1"/>
          <body name="tool" pos=".4 0 0"><geom type="sphere" size=".05" mass=".4"/></body>
          <body name="slide" pos=".3 0 0">
            <joint name="rail" type="slide" axis="1 0 1"/>
            <geom type="box" size=".05 .04 .03" density="2000"/>
          </body>
        </body>
      </body>
    </body>
    <body name="loose" pos="2 0 2">
      <joint type="slide" axis="1 0 0" damping="0"/><joint type="slide" axis="0 0 1" damping="0"/>
      <joint name="spin" axis="0 1 0"/>
      <geom type="ellipsoid" size=".1 .2 .3"/>
    </body>
  </worldbody>
</mujoco>
"""


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def accelerations(path, text, rates):
    """MuJoCo's (xacc, angular acceleration about y) of all bodies at the reference."""
    model = mujoco.MjModel.from_xml_path(str(write(path, text)))
    data = mujoco.MjData(model)
    data.qvel[:] = rates
    mujoco.mj_forward(model, data)
    step = 1e-6
    found = {}
    # centred differences of body velocities along the motion: no formula of ours
    ends = []
    for sign in (-1.0, 1.0):
        other = mujoco.MjData(model)
        other.qvel[:] = data.qvel + sign * step * data.qacc
        qpos = data.qpos.copy()
        mujoco.mj_integratePos(model, qpos, data.qvel + sign * step / 2 * data.qacc, sign * step)
        other.qpos[:] = qpos
        mujoco.mj_forward(model, other)
        rows = {}
        for body in range(1, model.nbody):
            velocity = np.zeros(6)
            mujoco.mj_objectVelocity(model, other, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
            rows[model.body(body).name] = velocity
        ends.append(rows)
    for name, late in ends[1].items():
        found[name] = (late - ends[0][name]) / (2 * step)
    return model, data, found


@pytest.mark.parametrize("sign", [1, -1])
def test_a_tree_accelerates_as_in_mujoco(tmp_path, sign):
    text = ROBOT.format(s=sign)
    rates = np.array([0.7, -1.2, 0.3, 0.2, -0.4, 0.9])
    _, data, there = accelerations(tmp_path / "arm.xml", text, rates)
    made = import_model(tmp_path / "arm.xml")
    machine = made.mechanism
    assert {body.name for body in machine.bodies} == {"upper", "lower", "slide", "loose"}
    # rates of the bodies, counter-clockwise in the x-z plane: against MuJoCo's about y
    first = -sign * rates[0]
    omega = {"upper": first, "lower": first - rates[1], "slide": first - rates[1]}
    start = {name: {"omega": rate} for name, rate in omega.items()}
    velocity = np.zeros(6)
    ids = {name: mujoco.mj_name2id(data.model, mujoco.mjtObj.mjOBJ_BODY, name) for name in there}
    for name in ("slide", "loose"):
        mujoco.mj_objectVelocity(
            data.model, data, mujoco.mjtObj.mjOBJ_XBODY, ids[name], velocity, 0
        )
        start.setdefault(name, {})
        start[name] |= {"vx": velocity[3], "vy": velocity[5], "omega": -velocity[1]}
    settings = mbody.SimulationSettings(until=1e-3, start=start)
    simulation = machine.copied()
    simulation.simulation = settings
    run = mbody.simulate(simulation)
    for name in ("upper", "lower", "slide", "loose"):
        history = run[name]
        along = [history.ax[0], history.ay[0], -history.alpha[0]]
        # the lower arm's mass centre is that with its tool, MuJoCo's that without
        parts = slice(2, 3) if name == "lower" else slice(0, 3)
        assert along[parts] == pytest.approx(there[name][[3, 5, 1]][parts], rel=1e-6, abs=1e-5)


def test_fixed_bodies_count_to_what_carries_them(tmp_path):
    made = import_model(write(tmp_path / "arm.xml", ROBOT.format(s=1)))
    lower = made.mechanism["lower"]
    # 1.3 kg at (.2, .05) and a ball of .4 kg at (.4, 0), turned by 15 degrees clockwise
    assert lower.mass == pytest.approx(1.7)
    c, s = np.cos(np.radians(-15)), np.sin(np.radians(-15))
    x, z = (1.3 * 0.2 + 0.4 * 0.4) / 1.7, 1.3 * 0.05 / 1.7
    assert lower.cg == pytest.approx((c * x - s * z, s * x + c * z), abs=1e-12)
    ball = 0.4 * 0.4 * 0.05**2
    apart = 1.3 * 0.4 / 1.7 * ((0.2) ** 2 + 0.05**2)
    assert lower.inertia == pytest.approx(0.05 + ball + apart, rel=1e-9)
    assert any("tool" in note for note in made.notes)


CLOSED = """
<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="crank"><joint name="O" axis="0 0 1"/><geom type="box" size=".1 .1 .1"/>
    <body name="coupler" pos="1 0 0" euler="0 0 60"><joint name="A" axis="0 0 1"/>
      <geom type="box" size=".1 .1 .1"/></body></body>
  <body name="rocker" pos="3.2 0 0" euler="0 0 100"><joint name="C" axis="0 0 -1"/>
    <geom type="box" size=".1 .1 .1"/></body>
  <body name="wheel" pos="5 0 0"><joint name="W" axis="0 0 1" ref="0.3"/>
    <geom type="box" size=".1 .1 .1"/></body>
  <body name="rack" pos="5 1 0"><joint name="R" type="slide" axis="0 1 0"/>
    <geom type="box" size=".1 .1 .1"/></body>
</worldbody><equality>
  <connect body1="coupler" body2="rocker" anchor="2.5 0 0"/>
  <joint joint1="W" joint2="O" polycoef="0.3 -2 0 0 0"/>
  <joint joint1="R" joint2="W" polycoef="0.1 0.25 0 0 0"/>
</equality></mujoco>
"""


def test_constraints_close_loops_and_couple_joints(tmp_path):
    made = import_model(write(tmp_path / "loop.xml", CLOSED))
    machine = made.mechanism.copied()
    machine.add(AngleDriver("motor", "crank", "0.5*t"))
    t = np.linspace(0, 1, 11)
    run = mbody.kinematics(machine, t)
    crank = 0.5 * t
    assert run["wheel"].angle == pytest.approx(0.3 - 2 * crank, abs=1e-10)
    assert run.point("rack.R").y == pytest.approx(1 + 0.1 + 0.25 * run["wheel"].angle, abs=1e-10)
    # the loop: the point of the coupler stays with that of the rocker, at fixed lengths
    a = np.column_stack([np.cos(crank), np.sin(crank)])
    p = run.point("coupler.equality0")
    place = np.column_stack([p.x, p.y])
    assert np.hypot(*(place - a).T) == pytest.approx(2.5, abs=1e-10)
    drawn = np.array([1 + 2.5 * np.cos(np.pi / 3), 2.5 * np.sin(np.pi / 3)])
    to_rocker = np.hypot(*(drawn - [3.2, 0]))
    assert np.hypot(*(place - [3.2, 0]).T) == pytest.approx(to_rocker, abs=1e-10)


@pytest.mark.parametrize("name", ["free_fourbar", "double_pendulum", "n_windows_2"])
def test_own_models_come_back(tmp_path, name):
    machine = gallery.load(name)
    run = mbody.simulate(machine)
    made = import_model(write(tmp_path / "own.xml", to_mjcf(machine).text)).mechanism.copied()
    rates = {body.name: {"omega": float(run[body.name].omega[0])} for body in machine.bodies}
    made.simulation = mbody.SimulationSettings(until=1e-3, start=rates)
    again = mbody.simulate(made)
    for body in machine.bodies:
        here, there = run[body.name], again[body.name]
        assert there.omega[0] == pytest.approx(here.omega[0], rel=1e-9, abs=1e-9)
        # bodies without mass have 1e-9 of the greatest in a file of MuJoCo
        assert there.alpha[0] == pytest.approx(here.alpha[0], rel=1e-6, abs=1e-6)


URDF = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.25 0 0.1"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="1" velocity="3"/>
<dynamics damping="0.2" friction="0"/></joint><transmission name="t"/></robot>"""


def test_urdf_is_a_pendulum(tmp_path):
    made = import_model(write(tmp_path / "arm.urdf", URDF))
    assert made.form == "URDF" and any("<transmission> 't'" in note for note in made.notes)
    upper = made.mechanism["upper"]
    run = mbody.simulate(made.mechanism, 0.1)
    # about the pin: (I + m c²) α = −m g x − 0.2 ω, the rate is 0 at the start
    about = 0.05 + 2 * (0.25**2 + 0.1**2)
    assert run["upper"].alpha[0] == pytest.approx(-2 * 9.81 * 0.25 / about, rel=1e-9)
    assert made.mechanism["shoulder"].limits == pytest.approx((-2.0, 1.0))
    assert upper.inertia == pytest.approx(0.05)


def test_axes_that_leave_the_plane_are_refused(tmp_path):
    text = CLOSED.replace('axis="0 0 -1"', 'axis="0 1 1"')
    with pytest.raises(ModelError, match=r"joint 'C': its axis .* not parallel"):
        import_model(write(tmp_path / "a.xml", text))
    with pytest.raises(ModelError, match=r"'b\.xml': MuJoCo does not read it"):
        import_model(write(tmp_path / "b.xml", CLOSED.replace("<geom", "<gem")))


def link(name, mass=1.0):
    return (
        f'<link name="{name}"><inertial><origin xyz="0.1 0 0"/><mass value="{mass}"/>'
        '<inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def pin(name, parent, child, more="", kind="continuous"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>{more}</joint>'
    )


def robot(*parts):
    return f'<robot name="r"><link name="base"/>{"".join(parts)}</robot>'


def test_links_and_joints_of_one_name_are_told_apart(tmp_path):
    parts = link("upper"), link("lower"), pin("upper", "base", "upper")
    text = robot(*parts, pin("lower", "upper", "lower"))
    made = import_model(write(tmp_path / "a.urdf", text))
    assert [body.name for body in made.mechanism.bodies] == ["upper", "lower"]
    assert [joint.name for joint in made.mechanism.joints] == ["upper_joint", "lower_joint"]
    assert "the joint 'upper' is named upper_joint" in made.notes
    # every kind of object of MJCF has names of its own, and the ground has none of them
    text = """<mujoco><worldbody><site name="cg"/><body name="ground"><joint name="ground"
      axis="0 1 0" stiffness="1"/><geom name="ground" size=".1"/><site name="mass"/></body>
      <body name="2 b" pos="1 0 0"><joint name="2 b" axis="0 1 0"/><geom size=".1"/></body>
      </worldbody>
      <equality><joint name="ground" joint1="ground" joint2="2 b"/></equality>
      <actuator><motor name="gravity" joint="2 b"/></actuator></mujoco>"""
    made = import_model(write(tmp_path / "b.xml", text))
    names = [element.name for element in made.mechanism]
    assert len(set(names)) == len(names) and {"ground_body", "n2_b", "n2_b_joint"} < set(names)
    assert "the body 'ground' is named ground_body" in made.notes
    assert mbody.simulate(made.mechanism, 0.1).status == "completed"


def test_notes_say_what_is_so(tmp_path):
    tip = '<link name="tip"/>' + pin("fixed", "swing arm", "tip", kind="fixed")
    mimic = pin("k", "swing arm", "hand", '<mimic joint="j" multiplier="2" offset="0.1"/>')
    text = robot(link("swing arm"), link("hand"), tip, pin("j", "base", "swing arm"), mimic)
    made = import_model(write(tmp_path / "a.urdf", text))
    (gone,) = [note for note in made.notes if "links that are part" in note]
    assert gone == "links that are part of others or of the ground: base, tip"
    assert "the link 'swing arm' is named swing_arm" in made.notes
    assert not any("mimic" in note for note in made.notes)
    machine = made.mechanism.copied()
    machine.add(AngleDriver("motor", "swing_arm", "0.5*t"))
    run = mbody.kinematics(machine, np.linspace(0, 1, 5))
    # all angles are clockwise about y: k = 2 j + 0.1, against the arm
    inner = run["hand"].angle - run["swing_arm"].angle
    assert inner == pytest.approx(2 * run["swing_arm"].angle - 0.1, abs=1e-10)


@pytest.mark.parametrize(
    ("more", "moves"),
    [
        ('<dynamics friction="0.3"/>', True),
        ('<dynamics damping="0.3"/>', True),
        ('<safety_controller k_velocity="1"/>', False),
        ('<calibration rising="0"/>', False),
    ],
)
def test_what_a_urdf_says_of_a_joint_is_taken_or_named(tmp_path, more, moves):
    made = import_model(write(tmp_path / "a.urdf", robot(link("a"), pin("j", "base", "a", more))))
    _, _, there = accelerations(
        tmp_path / "b.urdf", robot(link("a"), pin("j", "base", "a", more)), 0.7
    )
    start = {"a": {"omega": -0.7}}
    made.mechanism.simulation = mbody.SimulationSettings(until=1e-3, start=start)
    alpha = mbody.simulate(made.mechanism)["a"].alpha[0]
    # MuJoCo's friction gives way by the impedance of its constraint, 0.9 to 0.95
    loose = 0.1 if "friction" in more else 1e-6
    assert -alpha == pytest.approx(there["a"][1], rel=loose)
    assert moves != any("is not taken of the joints j" in note for note in made.notes)


def test_a_joint_of_a_urdf_that_is_planar_is_free_in_its_plane(tmp_path):
    planar = pin("p", "base", "a", kind="planar")
    made = import_model(write(tmp_path / "a.urdf", robot(link("a"), planar)))
    run = mbody.simulate(made.mechanism, 0.1)
    assert run["a"].ay == pytest.approx(-9.81) and run["a"].alpha == pytest.approx(0.0, abs=1e-9)


def test_motors_are_inputs(tmp_path):
    text = ROBOT.format(s=1).replace(
        "</mujoco>",
        '<actuator><motor name="M" joint="elbow" gear="2"/><motor name="P" joint="rail"/>'
        "</actuator></mujoco>",
    )
    model = mujoco.MjModel.from_xml_path(str(write(tmp_path / "arm.xml", text)))
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.7, -0.4
    mujoco.mj_forward(model, data)
    made = import_model(tmp_path / "arm.xml").mechanism
    run = mbody.simulate(made, 1e-3, inputs={"M_control": 0.7, "P_control": -0.4})
    elbow = -(run["lower"].alpha[0] - run["upper"].alpha[0])
    assert elbow == pytest.approx(data.qacc[model.joint("elbow").dofadr[0]], rel=1e-9)


def test_shapes_that_overlap_at_the_reference_are_told(tmp_path):
    text = """<mujoco><worldbody><geom type="plane" size="1 1 1" name="floor"/>
      <body name="b" pos="0 0 .4"><freejoint/><geom name="ball" size=".5"/></body>
      <body name="c" pos="2 0 1"><joint axis="0 1 0"/><geom size=".1"/></body>
      </worldbody></mujoco>"""
    notes = import_model(write(tmp_path / "a.xml", text)).notes
    assert any("floor and ball overlap by 0.1 m" in note for note in notes)

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

"""What MJCF has beyond smooth joints: motors of inputs, floors, limits, friction, in MuJoCo."""

import math
import re

import pytest

import mbody
from mbody import gallery
from mbody.engines.mjcf import to_mjcf
from mbody.exchange import import_model

mujoco = pytest.importorskip("mujoco")

LEG = """
units = "UNITS"
[ground]
points = { O = ["0 m", "0 m"] }
shapes = { floor = { line = { point = "O" } } }
[bodies.hip]
mass = "2 kg"
inertia = "0.02 kg*m^2"
points = { H = [0, 0] }
guess = ["0 m", "0.40587705 m", 0]
[bodies.leg]
mass = "0.5 kg"
inertia = "0.01 kg*m^2"
cg = ["0.2 m", "0 m"]
points = { H = [0, 0], F = ["0.4 m", "0 m"] }
guess = ["0 m", "0.40587705 m", -70]
shapes = { foot = { disc = "F", radius = "0.03 m" } }
[joints]
g = { prismatic = [{ body = "ground", angle = 90 }, { body = "hip", angle = 90 }] }
H = { revolute = ["hip.H", "leg.H"] }
[inputs]
u = "VALUE"
[loads]
motor = { torque = "LAW", body = "leg", by = "hip" }
[contacts]
floor = { contact = ["ground.floor", "leg.foot"], friction = 0.8 }
[gravity]
y = "-9.81 m/s^2"
[simulate]
until = 0.3
"""


def leg(units="SI", value="3 N*m", law="u"):
    text = LEG.replace("UNITS", units).replace("VALUE", value).replace("LAW", law)
    return mbody.from_toml(text)


def stepped(made, until, step=1e-4, control=None):
    """MuJoCo's (x, y, angle) of all bodies [SI] at a time, from the file's key frame."""
    model = mujoco.MjModel.from_xml_string(made.text)
    model.opt.timestep, model.opt.jacobian = step, mujoco.mjtJacobian.mjJAC_DENSE
    # the softness of a file goes with its step
    model.eq_solref[:, 0] = -0.5 / step**2
    model.eq_solref[:, 1] = -0.1 * math.sqrt(0.5) / step
    for field in ("pair_solref", "jnt_solref", "dof_solref", "tendon_solref_lim"):
        getattr(model, field)[:] = 2.0 * step, 1.0
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    if control is not None:
        data.ctrl[:] = control
    for _ in range(round(until / step)):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    found = {}
    for body in made.system.mechanism.bodies:
        n = model.body(body.name).id
        matrix = data.xmat[n].reshape(3, 3)
        found[body.name] = *data.xipos[n][:2], math.atan2(matrix[1, 0], matrix[0, 0])
    return found


def same(machine, until, least, **options):
    """The exported model moves as the machine does, to a length and an angle."""
    made = to_mjcf(machine)
    there = stepped(made, until, **options)
    run = mbody.simulate(machine, until, instants=3)
    unit = made.scale.length
    for body in machine.bodies:
        history = run[body.name]
        x, y, angle = there[body.name]
        here = history.x[-1] * unit, history.y[-1] * unit
        assert here == pytest.approx((x, y), abs=least), body.name
        assert math.remainder(history.angle[-1] - angle, math.tau) == pytest.approx(0, abs=least)
    return made


@pytest.mark.parametrize("units", ["SI", "mm-N-s", "in-lbf-s"])
def test_a_leg_with_a_motor_stands_on_its_floor(units):
    made = same(leg(units), 0.15, 2e-3)
    assert made.not_expressible == ()
    assert len(re.findall("<motor", made.text)) == 1 and 'type="plane"' in made.text
    assert any("control is the input 'u'" in note for note in made.notes)
    # the key frame has the input's own value, in SI; its control moves the leg
    (control,) = re.findall(r'ctrl="([^"]+)"', made.text)
    assert float(control) == pytest.approx(3.0)
    free, held = (stepped(made, 0.15, control=value) for value in (0.0, 3.0))
    assert abs(free["leg"][2] - held["leg"][2]) > 0.05


@pytest.mark.parametrize(
    "law",
    [
        "2*u - 0.5 N*m",
        "clamp(u, -1 N*m, 1 N*m)",
        "u - 4 N*m/rad*(leg.angle - hip.angle + 1 rad) - 0.3 N*m*s/rad*(leg.omega - hip.omega)",
    ],
)
def test_formulas_that_are_linear_in_an_input_are_actuators(law):
    made = same(leg(law=law), 0.2, 2e-3)
    assert made.not_expressible == () and "<actuator>" in made.text


@pytest.mark.parametrize(
    ("law", "why"),
    [
        ("u*u/(1 N*m)", "not linear in one input"),
        ("u - 1 N*m*s/m*hip.vy/(1 m)*1 m", "measures more than"),
        ("u - 4 N*m/rad*leg.angle", "measures more than"),
    ],
)
def test_other_formulas_are_named_with_the_reason(law, why):
    made = to_mjcf(leg(law=law))
    told = {one.element: one.why for one in made.not_expressible}
    assert set(told) == {"motor", "u"} and why in told["motor"]


def wheel(friction, slope=0.2, **shape):
    """A disc on a slope."""
    machine = mbody.Mechanism(
        "wheel",
        ground={"O": (0, 0)},
        ground_shapes={"road": {"line": {"point": "O", "angle": -slope}}},
    )
    at = 0.3 * math.sin(slope), 0.3 * math.cos(slope), 0.0
    machine.add(
        mbody.Body(
            "disc",
            mass=2.0,
            inertia=0.09,
            points={"C": (0, 0)},
            shapes={"rim": {"disc": "C", "radius": 0.3}},
            guess=at,
        ),
        mbody.Contact("road", "ground.road", "disc.rim", friction=friction, **shape),
        mbody.Gravity("g", y=-9.81),
    )
    machine.simulation = mbody.SimulationSettings(
        until=1.0, start={"disc": {"x": at[0], "y": at[1], "angle": 0.0}}
    )
    return machine


@pytest.mark.parametrize("friction", [0.4, 0.03, 0.0])
def test_a_disc_rolls_down_a_slope_or_slides(friction):
    made = same(wheel(friction), 0.5, 2e-3)
    # rolling: a = g sin β/(1 + I/(m r²)) = ⅔ g sin β of the disc
    model = mujoco.MjModel.from_xml_string(made.text)
    assert model.ngeom == 2 and made.not_expressible == ()
    if friction == 0.4:
        there = stepped(made, 0.5)["disc"]
        way = 0.5 * (2 / 3) * 9.81 * math.sin(0.2) * 0.25
        assert there[0] - 0.3 * math.sin(0.2) == pytest.approx(way * math.cos(0.2), rel=3e-3)


def test_what_contacts_of_mujoco_have_not_is_named():
    told = {
        one.element: one.why
        for one in to_mjcf(wheel(0.3, static=0.4, restitution=0.5)).not_expressible
    }
    assert told == {"road": "its restitution: contacts of MuJoCo do not rebound"}
    told = {one.element: one.why for one in to_mjcf(wheel(0.3, static=0.4)).not_expressible}
    assert "static friction" in told["road"]
    made = to_mjcf(gallery.load("bouncing_ball"))
    assert [one.why for one in made.not_expressible] == [
        "MuJoCo has no stop along a formula of positions, only shapes that touch"
    ]


def pendulum(*joints, **more):
    machine = mbody.Mechanism("pendulum")
    machine.add(
        mbody.Body("arm", mass=1.0, inertia=0.05, cg=(0.3, 0), guess=0.4),
        mbody.Revolute("O", "ground", "arm", **more),
        *joints,
        mbody.Gravity("g", y=-9.81),
    )
    return machine


@pytest.mark.parametrize(
    "machine",
    [
        pendulum(viscous=0.4),
        pendulum(limits=(-0.6, 0.5)),
        pendulum(mbody.Clutch("brake", "ground", "arm", torque=1.5)),
        pendulum(mbody.Clutch("brake", "ground", "arm", torque=9.0)),
    ],
    ids=["viscous", "limits", "clutch", "clutch that holds"],
)
def test_limits_damping_and_constant_friction_of_joints(machine):
    assert same(machine, 0.5, 3e-3, step=5e-5).not_expressible == ()


@pytest.mark.parametrize("machine", [leg(), wheel(0.3)], ids=["leg", "wheel"])
def test_what_is_written_comes_back(tmp_path, machine):
    path = tmp_path / "own.xml"
    path.write_text(to_mjcf(machine).text, encoding="utf-8")
    again = import_model(path).mechanism.copied()
    inputs = {"motor_control": 3.0} if len(again.inputs) else {}
    here = mbody.simulate(machine, 0.3, instants=4)
    there = mbody.simulate(again, 0.3, instants=4, inputs=inputs)
    for body in machine.bodies:
        assert there[body.name].x == pytest.approx(here[body.name].x, abs=1e-6)
        assert there[body.name].y == pytest.approx(here[body.name].y, abs=1e-6)
    assert len(again.contacts) == 1


@pytest.mark.parametrize("follows", [False, True])
def test_a_force_of_an_input_is_an_actuator_at_its_place(follows):
    machine = pendulum()
    machine.add(
        mbody.Input("u", "2 N"),
        mbody.Force(
            "push", mbody.Marker("arm", (0.5, 0.0)), "3*u - 1 N", angle="70 deg", follows=follows
        ),
    )
    made = same(machine, 0.4, 2e-3)
    assert made.not_expressible == () and "<general" in made.text

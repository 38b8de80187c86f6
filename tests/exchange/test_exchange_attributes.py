"""Every attribute of MJCF: the imported motion is MuJoCo's own, or the file is refused, or a note
names what MuJoCo's motion does not change by."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

import mbody
from mbody import ModelError
from mbody.exchange import import_model
from mbody.exchange.planar_forces import (
    OPTIONS_OF_CONTACTS,
    OPTIONS_OF_THE_SOLVER,
    OPTIONS_TAKEN,
    REFUSED_OTHERWISE,
    SOLVER,
    TAKEN,
    fields,
    is_known,
)

mujoco = pytest.importorskip("mujoco")

STIFF = 'solimp{0}="0.9999 0.9999 0.001 0.5 2" solref{0}="0.0004 1"'
TEMPLATE = """
<mujoco model="all">{top}
<compiler {compiler}/>
<option gravity="0 0 -9.81" timestep="0.0002" jacobian="dense" integrator="RK4" {option}>{flag}
</option>
<default><joint {limit} {friction}/><geom {hard} {geoms}/><equality {hard}/>
  <tendon {limit} {friction}/>{default}</default>
<worldbody>{world}
  <body name="arm" pos="0 0 1" euler="0 0.3 0" {arm}>{inertial}
    <joint name="H" {axis} {hinge}/>
    <geom name="bar" type="capsule" fromto="0 0 0 .4 0 0" size=".02" {geom}/>
    <site name="T" pos=".4 0 0"/>{inside}
    <body name="hand" pos=".4 0 0" {hand}>
      <joint name="K" axis="0 1 0" {second}/><geom name="palm" type="box" size=".1 .02 .03"/>
    </body>
  </body>
  <body name="car" pos="1 0 1">
    <joint name="S" type="slide" axis="1 0 -1" {slide}/><geom name="shell" size=".05"/>
    <site name="C"/>
  </body>
  <body name="loose" pos="2 0 1">{free}<geom name="ball" {size} {ball}/></body>
</worldbody>{bottom}</mujoco>
"""
KEYS = set(re.findall(r"\{(\w+)\}", TEMPLATE))
PLANE_FREE = (
    '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>'
)
FLOOR = '<geom name="floor" type="plane" size="0 0 1" pos="0 0 .75" {}/>'
BOTH = 'contype="1" conaffinity="1"'
#: Slopes to the right as gravity has it: what is round rolls on the floor or slides.
ROLLING = PLANE_FREE.replace('axis="1 0 0"', 'axis="1 0 0" stiffness="30" springref="1"')
MOTOR = '<actuator><motor name="M" joint="H" {}/></actuator>'
TENDON = '<tendon><spatial name="L" {}><site site="T"/><site site="C"/></spatial></tendon>'
SUM = (
    '<tendon><fixed name="F" {}><joint joint="H" coef="1.5"/><joint joint="K" coef="-0.5"/></fixed>'
    "</tendon>"
)


def model(**given):
    """The file with parts in their places."""
    given = dict.fromkeys(KEYS, "") | {"free": PLANE_FREE} | given
    given["axis"] = given["axis"] or 'axis="0 1 0"'
    given["size"] = given["size"] or 'size=".06"'
    given["compiler"] = given["compiler"] or 'angle="radian"'
    given["limit"] = given["limit"] or STIFF.format("limit")
    given["friction"] = given["friction"] or STIFF.format("friction")
    given["hard"] = given["hard"] or STIFF.format("")
    return TEMPLATE.format(**given)


def on_floor(more=BOTH, **given):
    """A floor under what is loose, which nothing else touches."""
    alone = {"geoms": 'contype="0" conaffinity="0"', "ball": BOTH, "world": FLOOR.format(more)}
    return alone | given


def told(path, text):
    """The import of a file, or the sentence of its refusal."""
    path.write_text(text, encoding="utf-8")
    try:
        return import_model(path)
    except ModelError as error:
        assert str(error)
        return str(error)


def theirs(text, until=0.3):
    """MuJoCo's (x, z, angle) of all bodies at the end."""
    there = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(there)
    names = [there.body(n).name for n in range(1, there.nbody)]
    turned = np.zeros(len(names))
    for _ in range(round(until / there.opt.timestep)):
        mujoco.mj_step(there, data)
    mujoco.mj_forward(there, data)
    for n, _ in enumerate(names):
        matrix = data.xmat[n + 1].reshape(3, 3)
        at_start = mujoco.MjData(there)
        mujoco.mj_kinematics(there, at_start)
        relative = matrix @ at_start.xmat[n + 1].reshape(3, 3).T
        turned[n] = np.arctan2(-relative[0, 2], relative[0, 0])
    return {
        name: np.array([data.xpos[n + 1][0], data.xpos[n + 1][2], turned[n]])
        for n, name in enumerate(names)
    }


def ours(made, until=0.3):
    """The same of an import: the origins of bodies, which are their points (0, 0)."""
    machine = made.mechanism.copied()
    machine.simulation = mbody.SimulationSettings(until=until, instants=3)
    run = mbody.simulate(machine)
    assert run.status == "completed", run.doubts
    found = {}
    for body in machine.bodies:
        history, (cx, cy) = run[body.name], body.cg
        c, s = np.cos(history.angle[-1]), np.sin(history.angle[-1])
        place = history.x[-1] - (c * cx - s * cy), history.y[-1] - (s * cx + c * cy)
        found[body.name] = np.array([*place, history.angle[-1]])
    return found


def compared(path, text, least=2e-3):
    """Import a file and compare its motion with MuJoCo's; the sentence where it is refused."""
    made = told(path, text)
    if isinstance(made, str):
        return made
    here, there = ours(made), theirs(text)
    for name in there:
        if name in here:
            apart = here[name] - there[name]
            apart[2] = np.remainder(apart[2] + np.pi, 2 * np.pi) - np.pi
            assert np.abs(apart).max() < least, (name, here[name], there[name], made.notes)
    return made.notes


TIP = '<body pos=".2 0 .1" euler="0 0.7 0"><geom type="box" size=".1 .05 .02"/></body>'
PULLED = '<actuator><position tendon="F" kp="4"/></actuator>'
SPATIAL = '<actuator><position tendon="L" kp="4"/></actuator>'
#: What moves, each attribute with a value that matters: where it stands in the file, and whether
#: the import takes or refuses it, or names in a note what it leaves out.
TAKEN_ATTRIBUTES = {
    "joint type": {"free": '<joint name="J" type="free"/>'},
    "joint pos": {"hinge": 'pos="0.1 0 0.05"'},
    "joint axis": {"axis": 'axis="0 -1 0"', "hinge": 'range="-2 0.1"'},
    "joint range": {"hinge": 'range="-0.2 0.3"'},
    "joint limited": {"hinge": 'range="-0.2 0.3" limited="false"'},
    "joint margin": {"hinge": 'range="-0.2 0.3" margin="0.05"'},
    "joint ref": {"hinge": 'ref="0.2" stiffness="3"'},
    "joint springref": {"hinge": 'springref="0.5" stiffness="3"'},
    "joint stiffness": {"slide": 'stiffness="40" springref="-0.2"'},
    "joint stiffness of a hinge": {"second": 'stiffness="2" springref="0.7"'},
    "joint damping": {"second": 'damping="0.3"'},
    "joint damping of a slide": {"slide": 'damping="3"'},
    "joint damping of a free body": {"free": PLANE_FREE.replace("/>", ' damping="2"/>')},
    "joint stiffness of a free body": {
        "free": PLANE_FREE.replace("/>", ' stiffness="9" springref="0.3"/>')
    },
    "joint damping of a free joint": {"free": '<joint type="free" damping="1.5"/>'},
    "joint frictionloss": {"hinge": 'frictionloss="0.4"'},
    "joint frictionloss of a slide": {"slide": 'frictionloss="2"'},
    "joint frictionloss that holds": {"hinge": 'frictionloss="40"'},
    "joint armature": {"hinge": 'armature="0.2"'},
    "joint armature of a slide": {"slide": 'armature="0.7"'},
    "joint armature between bodies": {"second": 'armature="0.03"'},
    "joint springdamper": {"hinge": 'springdamper="0.2 0.5"'},
    "joint actuatorfrcrange": {
        "hinge": 'actuatorfrcrange="-0.3 0.3"',
        "bottom": MOTOR.replace("motor", "position").format('kp="20"'),
    },
    "joint actuatorfrclimited": {
        "hinge": 'actuatorfrcrange="-0.3 0.3" actuatorfrclimited="false"',
        "bottom": MOTOR.replace("motor", "position").format('kp="2"'),
    },
    "joint class": {
        "default": '<default class="d"><joint damping="0.4"/></default>',
        "hinge": 'class="d"',
    },
    "joint range of a pin in a slot": {
        "slide": "",
        "free": '<joint type="slide" axis="1 0 0" range="-1 0.1"/><joint name="Q" axis="0 1 '
        '0" pos="0 0 .1" range="-0.02 0.02"/>',
    },
    "freejoint": {"free": '<freejoint name="J"/>'},
    "body pos": {"hand": 'euler="0 0.5 0"'},
    "body gravcomp": {"hand": 'gravcomp="0.7"'},
    "body gravcomp of what is fixed": {
        "inside": '<body name="tip" pos=".2 0 0" gravcomp="2"><geom size=".05"/></body>'
    },
    "body childclass": {
        "default": '<default class="d"><joint damping="0.4"/></default>',
        "arm": 'childclass="d"',
    },
    "inertial mass": {
        "inertial": '<inertial pos=".1 0 .02" mass="2" diaginertia=".02 .03 .04" euler="0 .4 .3"/>'
    },
    "inertial fullinertia": {
        "inertial": '<inertial pos=".1 0 .02" mass="2" fullinertia=".02 .03 .04 .001 .002 .003"/>'
    },
    "geom density": {"geom": 'density="4000"'},
    "geom mass": {"geom": 'mass="3"'},
    "geom shellinertia": {"geom": 'shellinertia="true"'},
    "geom contact": on_floor(),
    "geom contype": on_floor('contype="0" conaffinity="0"'),
    "geom conaffinity": on_floor('contype="0" conaffinity="2"', ball='contype="2"'),
    "geom condim": on_floor(BOTH + ' condim="1"', ball=BOTH + ' condim="1"', free=ROLLING),
    "geom friction": on_floor(free=ROLLING, world=FLOOR.replace(".75", ".94").format(BOTH)),
    "geom margin": on_floor(BOTH + ' margin="0.01"'),
    "geom gap": on_floor(BOTH + ' gap="0.01"'),
    "geom priority": on_floor(BOTH + ' priority="1" friction="0 0 0"', free=ROLLING),
    "pair": on_floor(
        'contype="0"',
        ball="",
        bottom='<contact><pair geom1="floor" geom2="ball" condim="1"/></contact>',
    ),
    "exclude": on_floor(bottom='<contact><exclude body1="world" body2="loose"/></contact>'),
    "option gravity": {"flag": '<flag gravity="disable"/>', "hinge": 'stiffness="2" springref="1"'},
    "option density": {"option": 'density="1000"'},
    "option viscosity": {"option": 'viscosity="0.9"'},
    "option wind in a medium": {
        "option": 'density="100" viscosity="2" wind="5 3 1"',
        "inside": TIP,
    },
    "option wind": {"option": 'wind="5 0 0"'},
    "option magnetic": {"option": 'magnetic="5 0 0"'},
    "flag limit": {"hinge": 'range="-0.2 0.1"', "flag": '<flag limit="disable"/>'},
    "flag frictionloss": {"hinge": 'frictionloss="4"', "flag": '<flag frictionloss="disable"/>'},
    "flag spring": {"hinge": 'stiffness="4" springref="1"', "flag": '<flag spring="disable"/>'},
    "flag damper": {"hinge": 'damping="4"', "flag": '<flag damper="disable"/>'},
    "flag contact": {**on_floor(), "flag": '<flag contact="disable"/>'},
    "flag constraint": {
        **on_floor(),
        "hinge": 'range="-0.2 0.1"',
        "flag": '<flag constraint="disable"/>',
    },
    "flag equality": {
        "bottom": '<equality><joint joint1="H" joint2="K"/></equality>',
        "flag": '<flag equality="disable"/>',
    },
    "flag actuation": {
        "bottom": MOTOR.replace("motor", "position").format('kp="20"'),
        "flag": '<flag actuation="disable"/>',
    },
    "option actuatorgroupdisable": {
        "bottom": MOTOR.replace("motor", "position").format('kp="20" group="2"'),
        "option": 'actuatorgroupdisable="2"',
    },
    "compiler angle": {"compiler": 'angle="degree"', "hinge": 'range="-3 5"'},
    "compiler boundmass": {"compiler": 'angle="radian" boundmass="4"'},
    "compiler boundinertia": {"compiler": 'angle="radian" boundinertia="0.5"'},
    "compiler settotalmass": {
        "compiler": 'angle="radian" settotalmass="4"',
        "hinge": 'damping="0.3"',
    },
    "compiler autolimits": {
        "compiler": 'angle="radian" autolimits="false"',
        "hinge": 'limited="true" range="-0.2 0.1"',
    },
    "compiler inertiafromgeom": {
        "compiler": 'angle="radian" inertiafromgeom="true"',
        "inertial": '<inertial pos="0 0 0" mass="9" diaginertia="1 1 1"/>',
    },
    "compiler eulerseq": {"compiler": 'angle="radian" eulerseq="zyx"', "hand": 'euler="0 0.4 0"'},
    "compiler fusestatic": {
        "compiler": 'angle="radian" fusestatic="true"',
        "inside": '<body pos=".1 0 0"><geom size=".06"/></body>',
    },
    "compiler balanceinertia": {
        "compiler": 'angle="radian" balanceinertia="true"',
        "inertial": '<inertial pos=".2 0 0" mass="2" diaginertia=".01 .09 .01"/>',
    },
    "equality connect": {
        "bottom": '<equality><connect body1="hand" body2="loose" anchor="0.1 0 0"/></equality>'
    },
    "equality weld": {"bottom": '<equality><weld body1="hand" body2="loose"/></equality>'},
    "equality joint": {
        "bottom": '<equality><joint joint1="K" joint2="H" polycoef="0 -1.5 0 0 0"/></equality>'
    },
    "equality joint of a slide": {
        "bottom": '<equality><joint joint1="S" joint2="H" polycoef="0 0.5 0 0 0"/></equality>'
    },
    "equality joint alone": {"bottom": '<equality><joint joint1="K"/></equality>'},
    "equality tendon": {"bottom": TENDON.format("") + '<equality><tendon tendon1="L"/></equality>'},
    "equality tendon of joints": {
        "bottom": SUM.format("") + '<equality><tendon tendon1="F"/></equality>'
    },
    "equality active": {
        "bottom": '<equality><connect body1="hand" body2="loose" anchor="0.1 0 0" '
        'active="false"/></equality>'
    },
    "tendon stiffness": {"bottom": TENDON.format('stiffness="60" springlength="0.5"')},
    "tendon damping": {"bottom": TENDON.format('damping="5"')},
    "tendon range": {"bottom": TENDON.format('range="0 0.7"')},
    "tendon range of a strut": {"bottom": TENDON.format('range="0.62 9"')},
    "fixed tendon stiffness": {"bottom": SUM.format('stiffness="2" springlength="0.5"')},
    "fixed tendon damping": {"bottom": SUM.format('damping="0.5"')},
    "fixed tendon range": {"bottom": SUM.format('range="-0.2 0.1"')},
    "fixed tendon frictionloss": {"bottom": SUM.format('frictionloss="0.3"')},
    "fixed tendon armature": {"bottom": SUM.format('armature="0.05"')},
    "motor": {"bottom": MOTOR.format('gear="3"')},
    "motor armature": {"bottom": MOTOR.format('gear="3" armature="0.02" damping="0.1"')},
    "motor ctrlrange": {"bottom": MOTOR.format('ctrlrange="0.5 1" ctrllimited="true"')},
    "motor forcerange": {"bottom": MOTOR.format('forcerange="-1 -0.5" forcelimited="true"')},
    "motor of a slide": {
        "bottom": '<actuator><motor joint="S" ctrlrange="2 3" gear="2"/></actuator>'
    },
    "motor of a tendon": {
        "bottom": SUM.format("") + '<actuator><motor tendon="F" ctrlrange="0.4 3"/></actuator>'
    },
    "motor of a site": {"bottom": '<actuator><motor site="T" gear="1 0 0 0 0 0"/></actuator>'},
    "position": {
        "bottom": '<actuator><position joint="H" kp="6" kv="0.3" gear="2"/></actuator>',
        "hinge": 'ref="0.4"',
    },
    "position of a slide": {
        "bottom": '<actuator><position joint="S" kp="60" kv="1" forcerange="-4 4"/></actuator>'
    },
    "velocity": {"bottom": '<actuator><velocity joint="K" kv="0.2"/></actuator>'},
    "damper": {"bottom": '<actuator><damper joint="K" kv="2" ctrlrange="0 1"/></actuator>'},
    "cylinder": {"bottom": '<actuator><cylinder joint="S" area="1" timeconst="1"/></actuator>'},
    "adhesion": {"bottom": '<actuator><adhesion body="car" ctrlrange="0 1"/></actuator>'},
    "general": {
        "bottom": '<actuator><general joint="H" gainprm="2" biastype="affine" biasprm="0.5 -3 '
        '-0.1"/></actuator>'
    },
    "general dyntype": {
        "bottom": '<actuator><general joint="H" dyntype="filter" dynprm="0.1"/></actuator>'
    },
    "sensor": {"bottom": '<sensor><jointpos joint="H"/></sensor>'},
    "keyframe": {"bottom": '<keyframe><key qpos="1 0 0 0 0 0"/></keyframe>'},
    "custom": {"bottom": '<custom><numeric name="n" data="1"/><text name="t" data="a"/></custom>'},
    "frame": {"inside": '<frame pos=".1 0 0" euler="0 .3 0"><geom size=".05"/></frame>'},
    "replicate": {"inside": '<replicate count="3" offset=".1 0 0"><geom size=".03"/></replicate>'},
    "tendon margin": {"bottom": TENDON.format('range="0 0.7" margin="0.02"')},
    "tendon limited": {"bottom": TENDON.format('range="0 0.63" limited="false"')},
    "fixed tendon margin": {"bottom": SUM.format('range="-0.2 0.1" margin="0.05"')},
    "fixed tendon limited": {
        "bottom": SUM.format('range="-0.2 0.1" limited="false" springyield="0"')
    },
    "tendon actuatorfrcrange": {
        "bottom": SUM.format('actuatorfrcrange="-0.2 0.2" actuatorfrclimited="true"') + PULLED
    },
    "equality tendon polycoef": {
        "bottom": SUM.format("")
        + '<equality><tendon tendon1="F" active="true" polycoef="0 1 0 0 0"/></equality>'
    },
    "equality connect of sites": {
        "inside": '<site name="W" pos=".2 0 0"/>',
        "free": PLANE_FREE + '<site name="V" pos="-1.8089327 0 -0.0591040"/>',
        "bottom": '<equality><connect site1="W" site2="V"/></equality>',
    },
    "equality weld of sites": {
        "inside": '<site name="W" pos=".2 0 0" euler="0 -0.3 0"/>',
        "free": PLANE_FREE + '<site name="V" pos="-1.8089327 0 -0.0591040"/>',
        "bottom": '<equality><weld site1="W" site2="V" torquescale="0.5"/></equality>',
    },
    "equality weld active": {
        "bottom": '<equality><weld body1="hand" body2="loose" active="false" anchor="0 0 0" '
        'relpose="0 0 0 1 0 0 0"/></equality>'
    },
    "equality joint active": {
        "bottom": '<equality><joint joint1="K" joint2="H" active="false"/></equality>'
    },
    "pair margin": on_floor(
        'contype="0"',
        ball="",
        bottom='<contact><pair geom1="floor" geom2="ball" margin="0.02" gap="0.01" '
        'friction="0 0 0 0 0"/></contact>',
    ),
    "geom quat": on_floor(BOTH + ' quat="0.9961947 0 0.0871557 0"', ball=BOTH + ' friction="0 0 0"')
    | {"world": FLOOR.format(BOTH + ' friction="0 0 0" quat="0.9961947 0 0.0871557 0"')},
    "geom axisangle": {"geom": 'axisangle="0 1 0 0.2"'},
    "geom type capsule": on_floor(
        ball=BOTH + ' condim="1" type="capsule" euler="0 1.2 0"', size='size=".03 .1"'
    )
    | {"world": FLOOR.format(BOTH + ' condim="1"')},
    "geom type box": on_floor(
        ball=BOTH + ' condim="1" type="box" euler="0 0.4 0"', size='size=".05 .1 .2"'
    )
    | {"world": FLOOR.format(BOTH + ' condim="1"')},
    "geom type cylinder": on_floor(
        ball=BOTH + ' type="cylinder" euler="1.570796327 0 0"', size='size=".05 .1"'
    ),
    "geom type of two balls": on_floor(
        'contype="0"',
        world='<body name="post"><geom pos="2.02 0 .8" size=".06"/></body>',
        geoms='condim="1" conaffinity="0"',
        ball='conaffinity="1"',
    ),
    "geom type of two balls that pass": on_floor(
        'contype="0"',
        world='<body name="post"><geom pos="2.02 .2 .8" size=".06"/></body>',
        geoms='condim="1" conaffinity="0"',
        ball='conaffinity="1"',
    ),
    "flag clampctrl": {
        "bottom": MOTOR.format('ctrlrange="0.5 1"'),
        "flag": '<flag clampctrl="disable"/>',
    },
    "flag override": on_floor(
        free=ROLLING,
        world=FLOOR.replace(".75", ".94").format(BOTH),
        option='o_friction="0 0 0 0 0" o_margin="0" o_solref="0.0004 1" '
        'o_solimp="0.9999 0.9999 0.001 0.5 2"',
        flag='<flag override="enable"/>',
    ),
    "compiler inertiagrouprange": {
        "compiler": 'angle="radian" inertiagrouprange="0 1"',
        "inside": '<geom size=".2" group="3"/>',
    },
    "compiler alignfree": {
        "compiler": 'angle="radian" alignfree="true"',
        "free": '<freejoint align="true"/>',
    },
    "position dampratio": {
        "bottom": '<actuator><position joint="K" kp="2" dampratio="0.7" '
        'armature="0.01"/></actuator>'
    },
    "position inheritrange": {
        "second": 'range="-0.1 0.8"',
        "bottom": '<actuator><position joint="K" kp="2" inheritrange="1"/></actuator>',
    },
    "motor jointinparent": {
        "bottom": '<actuator><motor jointinparent="H" ctrlrange="1 2"/></actuator>'
    },
    "motor of a slider crank": {
        "bottom": '<actuator><motor cranksite="T" slidersite="C" cranklength="1"/></actuator>'
    },
}
REFUSED_ATTRIBUTES = {
    "joint stiffness of higher order": {"hinge": 'stiffness="2 3 0"'},
    "joint damping of higher order": {"slide": 'damping="3 2 0"'},
    "joint springyield": {"hinge": 'stiffness="3" springyield="0.01"'},
    "joint actuatorgravcomp": {"hinge": 'actuatorgravcomp="true"', "arm": 'gravcomp="0.5"'},
    "body mocap": {"world": '<body name="m" mocap="true"/>'},
    "body sleep": {"arm": 'sleep="init"', "flag": '<flag sleep="enable"/>'},
    "geom fluidshape": {"geom": 'fluidshape="ellipsoid"', "option": 'density="1.2"'},
    "geom rolling friction": on_floor(BOTH + ' condim="6" friction="1 0.1 0.01"'),
    "geom surfacevel": on_floor(BOTH + ' surfacevel="1 0 0 0 0 0"'),
    "geom adhesion": on_floor(BOTH + ' adhesion="1"'),
    "inertial axes in a medium": {
        "option": 'density="100"',
        "inertial": '<inertial pos=".1 0 .02" mass="2" diaginertia=".02 .03 .04" euler="0 .4 .3"/>',
    },
    "equality joint curved": {
        "bottom": '<equality><joint joint1="K" joint2="H" polycoef="0 1 1 0 0"/></equality>'
    },
    "tendon springlength": {"bottom": TENDON.format('stiffness="60" springlength="0.1 0.4"')},
    "tendon frictionloss": {"bottom": TENDON.format('frictionloss="2"')},
    "tendon armature": {"bottom": TENDON.format('armature="2"')},
    "tendon over pulleys": {
        "bottom": '<tendon><spatial stiffness="9"><site site="T"/><site site="C"/><pulley '
        'divisor="2"/><site site="C"/><site site="T"/></spatial></tendon>'
    },
    "motor of a site with a force": {
        "bottom": '<actuator><motor site="T" gear="1 0 0 0 0 0" ctrlrange="1 2"/></actuator>'
    },
    "motor delay": {"bottom": MOTOR.format('delay="0.01" nsample="4" ctrlrange="0.5 1"')},
    "position timeconst": {
        "bottom": '<actuator><position joint="H" kp="6" timeconst="0.1"/></actuator>'
    },
    "intvelocity": {"bottom": '<actuator><intvelocity joint="K" kp="2"/></actuator>'},
    "cylinder bias": {"bottom": '<actuator><cylinder joint="S" area="1" bias="3 0 0"/></actuator>'},
    "muscle": {"bottom": '<actuator><muscle joint="H" lengthrange="0.1 1"/></actuator>'},
    "dcmotor": {
        "bottom": '<actuator><dcmotor joint="H" motorconst="1" resistance="1"/></actuator>'
    },
    "pid": {"bottom": '<actuator><pid joint="H" kp="3"/></actuator>'},
    "flexcomp": {
        "world": '<flexcomp name="f" type="grid" count="2 2 1" spacing=".1 .1 .1" dim="2" '
        'radius=".01" pos="0 3 0"/>'
    },
    "plugin": {
        "top": '<extension><plugin plugin="mujoco.pid"><instance name="p"><config key="kp" '
        'value="2"/></instance></plugin></extension>',
        "bottom": '<actuator><plugin plugin="mujoco.pid" instance="p" joint="H"/></actuator>',
    },
    "tendon springyield": {
        "bottom": TENDON.format('stiffness="60" springlength="0.5" springyield="0.01"')
    },
    "tendon actuatorfrcrange between sites": {
        "bottom": TENDON.format('actuatorfrcrange="-1 1" actuatorfrclimited="true"') + SPATIAL
    },
    "tendon about a body": {
        "bottom": '<tendon><spatial stiffness="9"><site site="T"/><geom geom="ball" '
        'sidesite="C"/><site site="C"/></spatial></tendon>'
    },
    "equality tendon2": {
        "bottom": SUM.format("").replace(
            "</tendon>", '<fixed name="G"><joint joint="H" coef="1"/></fixed></tendon>'
        )
        + '<equality><tendon tendon1="F" tendon2="G"/></equality>'
    },
    "pair adhesion": on_floor(
        'contype="0"',
        ball="",
        bottom='<contact><pair geom1="floor" geom2="ball" adhesion="2"/></contact>',
    ),
    "geom type ellipsoid that touches": on_floor(
        ball=BOTH + ' type="ellipsoid"', size='size=".1 .05 .27"'
    ),
    "flag filterparent": {"flag": '<flag filterparent="disable"/>', "second": 'range="-1 1"'},
    "position of a site": {
        "bottom": '<actuator><position site="T" refsite="C" gear="1 0 0 0 0 0"/></actuator>'
    },
    "general of an activation": {
        "bottom": '<actuator><general joint="H" dyntype="integrator" actlimited="true" '
        'actrange="1 2"/></actuator>'
    },
    "orientation": {"bottom": '<actuator><orientation site="T" refsite="C" kp="3"/></actuator>'},
}
NAMED_ATTRIBUTES = {
    "geom type ellipsoid": on_floor(ball=BOTH + ' type="ellipsoid"', size='size=".1 .05 .06"')
}
CASES = {n: (g, "taken") for n, g in TAKEN_ATTRIBUTES.items()}
CASES |= {n: (g, "refused") for n, g in REFUSED_ATTRIBUTES.items()}
CASES |= {n: (g, "named") for n, g in NAMED_ATTRIBUTES.items()}


@pytest.mark.parametrize("name", CASES)
def test_an_attribute_is_taken_or_refused(tmp_path, name):
    given, wanted = CASES[name]
    text = model(**given)
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        if "plugin" in name:
            pytest.skip(f"MuJoCo has no such plugin: {error}")
        raise
    if wanted == "named":
        notes = told(tmp_path / "a.xml", text).notes
        assert any("not taken" in note and "floor–ball" in note for note in notes)
        return
    found = compared(tmp_path / "a.xml", text)
    assert ("refused" if isinstance(found, str) else "taken") == wanted, found


def schema():
    """Attributes of MJCF by the path of their element, as MuJoCo prints them."""
    found, path = {}, []
    for line in mujoco.mj_printSchema(False, False).splitlines():
        head = re.match(r"^(\s*)(?:\(world\))?(\w+) \(.\)\s+(.*)$", line)
        if head:
            path = [*path[: len(head[1]) // 3], head[2]]
            found.setdefault(tuple(path), []).extend(head[3].split())
        elif path:
            found[tuple(path)].extend(line.split())
    return found


#: Sections that are for pictures, measurement and memory, and those that are refused whole.
SECTIONS = {"visual", "statistic", "asset", "sensor", "custom", "size", "keyframe", "default"}
REFUSED_WHOLE = {"extension", "deformable", "flexcomp", "plugin", "flex", "flexstrain"}


def words_of(text):
    return set(text.split())


#: Attributes that name, show or order, that other files are found by, or that are other words for a
#: direction or a size that the compiler makes of all of them.
NAMES = words_of("""
    name class group user rgba material castshadow width mesh hfield fitscale
""")
WORDS = words_of("""
    axisangle quat xyaxes zaxis euler fromto size type simple fuse lengthrange
""")
FILES = words_of("""
    assetdir meshdir texturedir strippath discardvisual fitaabb passthrough savecanonical
    conflict savecompiled saveinertial usethread coordinate
""")
#: How MuJoCo solves.
SOLVES = words_of("""
    solmix solref solimp solimplimit solreflimit solimpfriction solreffriction autoreset
    diagexact energy eulerdamp fwdinv invdiscrete ipc island midphase multiccd nativeccd
    refsafe sensor speculative warmstart interp nsample
""")
#: Of actuators that have laws of their own, which are refused with any of these.
LAWS = words_of("""
    actdim actearly ffrange input velrange imax posrange slewmax diameter force fpmax fvmax
    lmax lmin range scale tausmooth vmax gain cogging controller inductance lugre nominal
    saturation thermal ki body gaintype fluidcoef delay actlimited actrange
""")


def test_every_attribute_of_the_schema_is_among_these():
    used = {}
    for given, _ in CASES.values():
        for node in ElementTree.fromstring(model(**given)).iter():
            used.setdefault(node.tag, set()).update(node.attrib)
    actuators = [path[-1] for path in schema() if len(path) == 3 and path[1] == "actuator"]
    acting = set().union(*(used.get(tag, ()) for tag in actuators))
    others = NAMES | WORDS | FILES | SOLVES | OPTIONS_OF_THE_SOLVER
    missing = []
    for path, attributes in schema().items():
        pictures = path[-1] in ("camera", "light", "config", "attach", "lengthrange")
        if pictures or REFUSED_WHOLE & set(path) or SECTIONS & set(path[1:2]):
            continue
        known = used.get(path[-1], set()) | others
        if path[-1] in actuators:
            assert path[-1] in used, path
            known |= acting | LAWS
        if path[-1] == "geom":
            known |= {"fluidcoef"}
        missing += [(*path, name) for name in attributes if name not in known]
    assert not missing


def test_every_field_of_a_compiled_model_is_known():
    there = mujoco.MjModel.from_xml_string(model())
    assert [field for field in fields(there) if not is_known(field)] == []
    options = {name for name in dir(there.opt) if not name.startswith("_")}
    assert options == OPTIONS_TAKEN | OPTIONS_OF_CONTACTS | OPTIONS_OF_THE_SOLVER
    assert not TAKEN & SOLVER and not REFUSED_OTHERWISE & (TAKEN | SOLVER)

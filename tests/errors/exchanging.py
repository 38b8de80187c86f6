"""Files of other programs: what is not read, and why."""

import json
import sys
import tempfile
from pathlib import Path
from unittest import mock

from mbody import Body, Mechanism, Revolute
from mbody.exchange import import_model, to_dxf
from tests.errors.command import said
from tests.errors.models import four_bar


def of(text, name="file.txt", units=None):
    def action():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.write_text(text, encoding="utf-8")
            with mock.patch("os.getcwd", return_value=folder):
                import_model(path, units)

    return action


def linkage(*parts, name="file.linkage2"):
    return of(f"<linkage2>{''.join(parts)}</linkage2>", name)


def connector(id_, x, y, more="", inner=""):
    return f'<connector id="{id_}" x="{x}" y="{y}" {more}>{inner}</connector>'


def link(id_, *members, more="", inner=""):
    text = "".join(f'<connector id="{one}"/>' for one in members)
    return f'<Link id="{id_}" {more}>{text}{inner}</Link>'


CRANK = connector(0, 0, 0, 'anchor="true"') + connector(1, 0, 30) + link(0, 0, 1)
LIMITS = '<slidelimit id="5"/><slidelimit id="6"/>'
ENDS = connector(5, 60, 10, 'anchor="true"') + connector(6, 140, 10, 'anchor="true"')
SLIDE = 'slider="true"'


def as_model(text, name):
    """The command with a file of another program in place of a model."""

    def action():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.write_text(text, encoding="utf-8")
            said(["kinematics", str(path)])()

    return action


def pin(id_, kind="revolute", position=(0.0, 0.0), **more):
    return {"id": id_, "type": kind, "position": position and list(position)} | more


def python(joints, links=(), **more):
    return of(json.dumps({"joints": joints, "links": list(links)} | more), "file.json")


def arm(*joints, kind="link", **more):
    return {"id": "arm", "type": kind, "joints": list(joints)} | more


def ratio(*parts, more=""):
    inner = "".join(f'<link id="{id_}" size="{size}"/>' for id_, size in parts)
    wheel = link(1, 2, more='gear="true"')
    extra = connector(2, 90, 0, more)
    return linkage(CRANK, extra, wheel, f"<ratios><ratio>{inner}</ratio></ratios>")


def planar(body, more="", option=""):
    return of(f"<mujoco>{option}<worldbody>{body}</worldbody>{more}</mujoco>", "file.xml")


def body(*joints, inner="", name="b", more=""):
    text = "".join(joints)
    return f'<body name="{name}" {more}>{text}<geom type="box" size="1 1 1"/>{inner}</body>'


CARRIED = 'gravcomp="1"'


def hinge(more, name="h"):
    return f'<joint name="{name}" axis="0 0 1" {more}/>'


def tendon(more, at='pos="2 0 0"'):
    """A tendon between the ground and a body."""
    return planar(
        f'<site name="s" {at}/>' + body(HINGE, '<site name="t"/>'),
        f'<tendon><spatial name="t" {more}><site site="s"/><site site="t"/></spatial></tendon>',
    )


HINGE = '<joint name="h" axis="0 0 1"/>'


def without_mujoco():
    with mock.patch.dict(sys.modules, {"mujoco": None}):
        planar(body(HINGE))()


def without_ezdxf():
    with mock.patch.dict(sys.modules, {"ezdxf": None}):
        to_dxf(four_bar())


def thick_pin():
    machine = Mechanism("crank")
    machine.add(Body("crank", mass=1.0, inertia=1.0, points={"O": (0, 0), "A": (1, 0)}))
    machine.add(Revolute("O", "ground", "crank.O", pin_radius=0.15))
    return machine


SCENARIOS = {
    "a file of another program as a model, in XML": as_model("<linkage2/>", "crank.linkage2"),
    "a drawing of parts without ezdxf": without_ezdxf,
    "a drawing of parts of no width": lambda: to_dxf(four_bar(), 0.0),
    "a drawing of parts whose holes are too wide": lambda: to_dxf(four_bar(), 1.0, 2.0),
    "a drawing of parts with a pin wider than its bar": lambda: to_dxf(thick_pin(), 0.2, 0.1),
    "a drawing of parts of a mass": lambda: to_dxf(four_bar(), "3 kg"),
    "a drawing of parts with instants": said(
        ["export", "hoekens", "--to", "dxf", "--instants", "3"]
    ),
    "a width of what is not drawn": said(["export", "hoekens", "--to", "mjcf", "--width", "3 mm"]),
    "a file of another program that is not there": said(["import", "no.linkage2"]),
    "an address without a mechanism": lambda: import_model("https://example.org/a.pmks"),
    "a file in units that there are not": of("ground,a,R,0,0", units="parsec"),
    "an empty file of another program": of(""),
    "a text of no format": of("to be or not to be"),
    "a JSON of no format": of('{"bars": 4}', "file.json"),
    "a JSON that is none": of('{"joints"', "file.json"),
    "an XML of no format": of("<svg/>", "file.xml"),
    "an XML that is none": of("<mujoco>", "file.xml"),
    "an XML with entities": of('<!DOCTYPE a [<!ENTITY b "c">]><a/>', "file.xml"),
    "a JSON nested too deep": of('{"a":' + "[" * 90000, "file.json"),
    "an assembly of FreeCAD": of("freeCAD: 3D CAD\nAssembly\n\tJoints\n\t\tRevoluteJoint\n"),
    "PMKS with two addresses": of(
        "http://a.org?mech=ground,a,R,0,0|\nhttp://a.org?mech=ground,b,R,0,0|"
    ),
    "PMKS with a line that is no joint": of("ground,a,R,0,0\na,b,R,1"),
    "PMKS with a place that is a word": of("ground,a,R,0,there"),
    "PMKS with a link twice": of("ground,a,a,R,0,0"),
    "PMKS with a slide of three": of("ground,a,b,P,0,0"),
    "PMKS with another type": of(
        '{"Joints": [{"X": 0, "Y": 0, "TypeOfJoint": "G2", "Links": ["a", "b"]}]}', "file.pmks"
    ),
    "PMKS with a joint of no link": of(
        '{"Joints": [{"X": 0, "Y": 0, "TypeOfJoint": "R"}]}', "file.pmks"
    ),
    "PMKS with a driven joint that is not there": of("ground,a,R,0,0\nd=4"),
    "PMKS with two driven joints": of("ground,a,R,0,0,0,ffft\na,b,R,1,0,0,ffft"),
    "PMKS with a driven slot": of("ground,a,R,0,0,0,ffff\na,b,RP,1,0,0,ffft"),
    "PMKS with wheels without centres": of("ground,a,R,0,0\na,b,G,1,0"),
    "PMKS with wheels that do not touch": of("ground,a,R,0,0\na,b,G,1,1\nb,ground,R,4,0"),
    "PMKS with wheels about one place": of("ground,a,R,0,0\na,b,G,1,0\nb,ground,R,0,0"),
    "PMKS where nothing moves": of("ground,R,0,0"),
    "Linkage with a thing of its own": linkage("<spring/>"),
    "Linkage with an id that is a word": linkage(connector("a", 0, 0)),
    "Linkage with a connector twice": linkage(connector(0, 0, 0), connector(0, 1, 0)),
    "Linkage with a link fastened to a loose connector": linkage(
        CRANK, connector(9, 1, 1), link(1, 1, more='fastenconnector="9"')
    ),
    "Linkage with a link of a thing": linkage(link(0, inner='<pin id="1"/>')),
    "Linkage with a link of nothing there": linkage(link(0, 7)),
    "Linkage fastened to no link": linkage(connector(0, 0, 0, 'fastenlink="4"')),
    "Linkage with a link fastened to nothing": linkage(
        CRANK, link(1, 1, more='fastenconnector="9"')
    ),
    "Linkage with a fastened actuator": linkage(
        CRANK, link(1, 0, 1, more='actuator="true" throw="1" fastenlink="0"')
    ),
    "Linkage with a slider of one limit": linkage(
        CRANK, ENDS, connector(2, 9, 9, SLIDE, '<slidelimit id="5"/>'), link(1, 1, 2)
    ),
    "Linkage with a slider of no link": linkage(CRANK, ENDS, connector(2, 90, 10, SLIDE, LIMITS)),
    "Linkage with a slider beside its line": linkage(
        CRANK, ENDS, connector(2, 90, 60, SLIDE, LIMITS), link(1, 1, 2)
    ),
    "Linkage with a slider beside its arc": linkage(
        CRANK, ENDS, connector(2, 90, 60, f'{SLIDE} slideradius="90"', LIMITS), link(1, 1, 2)
    ),
    "Linkage with an actuator of three": linkage(
        CRANK, connector(2, 9, 9), link(1, 0, 1, 2, more='actuator="true" throw="3"')
    ),
    "Linkage with an actuator on nothing": linkage(
        CRANK, connector(2, 9, 9), link(1, 1, 2, more='actuator="true" throw="3"')
    ),
    "Linkage with an actuator at rest": linkage(CRANK, link(1, 0, 1, more='actuator="true"')),
    "Linkage with a ratio of one": ratio((0, 1)),
    "Linkage with a ratio of nothing": ratio((0, 1), (1, 0)),
    "Linkage with wheels on no carrier": ratio((0, 1), (1, 2)),
    "Linkage with a wheel without a place": linkage(
        CRANK,
        link(1, more='gear="true"'),
        '<ratios><ratio><link id="0" size="1"/><link id="1" size="1"/></ratio></ratios>',
    ),
    "Linkage with an input that moves": linkage(
        CRANK, connector(2, 9, 9, 'input="true"'), link(1, 1, 2)
    ),
    "Linkage with an input that swings": linkage(
        connector(0, 0, 0, 'anchor="true" input="true" limitangle="40"')
    ),
    "Linkage with an input of two links": linkage(
        connector(0, 0, 0, 'anchor="true" input="true"'),
        connector(1, 1, 0) + connector(2, 2, 0) + link(0, 0, 1) + link(1, 0, 2),
    ),
    "pylinkage of the older form": python([pin("A", "Crank")]),
    "pylinkage without a position": python([pin("A", position=None)]),
    "pylinkage with a joint twice": python([pin("A"), pin("A")]),
    "pylinkage with another link": python([pin("A")], [arm("A", kind="spring")]),
    "pylinkage with a joint that is not there": python([pin("A")], [arm("B")]),
    "pylinkage with a line that is none": python([pin("A", "prismatic", axis=1)], [arm("A")]),
    "pylinkage with an axis of no length": python([pin("A", "prismatic", axis=[0, 0])], [arm("A")]),
    "pylinkage with a joint beside its line": python([pin("A", "prismatic", (1, 2))], [arm("A")]),
    "pylinkage with a tracker of no link": python(
        [pin("A"), pin("B"), pin("T", "tracker", ref_joint1_id="A", ref_joint2_id="B")],
        [arm("A"), arm("B") | {"id": "rod"}],
    ),
    "pylinkage with a driver of nothing": python([pin("A")], [arm("A", kind="driver")]),
    "pylinkage with an arc that is none": python(
        [pin("A", "ground"), pin("B", position=(1, 0))],
        [arm("A", "B", kind="arc_driver", motor_joint="A", arc_start=1, arc_end=1)],
    ),
    "MJCF without its package": without_mujoco,
    "MJCF that MuJoCo refuses": planar("<bod/>"),
    "MJCF without a joint": planar(body()),
    "MJCF with a slide that leaves the plane": planar(
        body(HINGE, inner=body('<joint type="slide" axis="0 1 1"/>', name="c"))
    ),
    "MJCF with a ball": planar(body(HINGE, inner=body('<joint type="ball"/>', name="c"))),
    "MJCF with two hinges": planar(body(HINGE, '<joint axis="0 0 1" pos="1 0 0"/>')),
    "MJCF with a body moved by mocap": planar(body(HINGE) + body(name="m", more='mocap="true"')),
    "MJCF with a tendon over pulleys": planar(
        body(HINGE, '<site name="s"/><site name="u" pos="1 0 0"/>'),
        '<tendon><spatial name="t" stiffness="1"><site site="s"/><site site="u"/>'
        '<pulley divisor="2"/><site site="u"/><site site="s"/></spatial></tendon>',
    ),
    "MJCF with a tendon out of its plane": tendon('damping="1"', 'pos="2 0 1"'),
    "MJCF with a tendon that is slack for a while": tendon('stiffness="1" springlength="1 2"'),
    "MJCF with a rough tendon": tendon('frictionloss="1"'),
    "MJCF with a spring of higher order": planar(body(hinge('stiffness="1 2 0"'))),
    "MJCF with a damper of higher order": planar(body(hinge('damping="1 2 0"'))),
    "MJCF with shapes in a medium": planar(
        f'<body name="b">{HINGE}<geom size="1" fluidshape="ellipsoid"/></body>',
        option='<option density="1.2"/>',
    ),
    "MJCF with a body that sleeps": planar(
        body(HINGE, more='sleep="init"'), option='<option><flag sleep="enable"/></option>'
    ),
    "MJCF with a plugin": planar(
        body(HINGE),
        '<actuator><plugin name="p" plugin="mujoco.pid" joint="h"><config key="kp" value="2"/>'
        "</plugin></actuator>",
        '<extension><plugin plugin="mujoco.pid"/></extension>',
    ),
    "MJCF with a flex": planar(
        body(HINGE)
        + '<flexcomp name="f" type="grid" count="2 2 1" spacing="1 1 1" dim="2" radius=".1" '
        'pos="0 9 0"/>'
    ),
    "MJCF with slides that are not square": planar(
        body(
            '<joint name="x" type="slide" axis="1 0 0" stiffness="1"/>'
            '<joint name="y" type="slide" axis="1 1 0"/>',
            HINGE,
        )
    ),
    "MJCF with friction across its plane": planar(
        body('<joint name="h" axis="1 1 0"/>')
        + '<body name="f"><joint name="j" type="free" frictionloss="1"/><geom size="1"/></body>'
    ),
    "MJCF with an actuator of its own law": planar(
        body(HINGE), '<actuator><position name="p" joint="h" timeconst="1"/></actuator>'
    ),
    "MJCF with actuators that are limited together": planar(
        body(hinge('actuatorfrcrange="-1 1"')),
        '<actuator><motor joint="h"/><motor joint="h"/></actuator>',
    ),
    "MJCF with actuators that carry weight": planar(
        body(HINGE, inner=body(hinge('actuatorgravcomp="true"', "k"), name="c"), more=CARRIED),
        option='<option gravity="0 -9 0"/>',
    ),
    "MJCF with a floor that moves": planar(
        '<geom name="floor" type="plane" size="1 1 1" zaxis="0 1 0" pos="0 -3 0" '
        'surfacevel="1 0 0 0 0 0"/>' + body(HINGE, name="b")
    ),
    "MJCF with shapes that touch and have no outline": planar(
        '<geom name="hill" type="ellipsoid" size="1 1 1"/>' + body(HINGE)
    ),
    "MJCF with a constraint of two tendons": planar(
        body(HINGE),
        '<tendon><fixed name="t"><joint joint="h" coef="1"/></fixed><fixed name="u">'
        '<joint joint="h" coef="2"/></fixed></tendon>'
        '<equality><tendon tendon1="t" tendon2="u"/></equality>',
    ),
    "MJCF with a curve of joints": planar(
        body(HINGE, inner=body('<joint name="k" axis="0 0 1"/>', name="c")),
        '<equality><joint joint1="h" joint2="k" polycoef="0 1 2 0 0"/></equality>',
    ),
}

SENTENCES = r"""
a file of another program as a model, in XML | ModelError | - | 'crank.linkage2' is a file of Linkage, not a model: make one of it, mbody import crank.linkage2 -o crank.toml
a drawing of parts without ezdxf | SolveError | - | a drawing in DXF needs the package ezdxf, which is not installed: pip install ezdxf
a drawing of parts of no width | ModelError | - | the width of bars is 0 m: it must be positive
a drawing of parts whose holes are too wide | ModelError | - | holes of 2 m do not fit into bars of 1 m: give wider bars
a drawing of parts with a pin wider than its bar | ModelError | - | the hole of the pin 'O' is 0.3 m wide, twice its pin_radius, and the bar 'crank' 0.2 m: give wider bars
a drawing of parts of a mass | ModelError | drawing | 'drawing': width: '3 kg' is a mass (kg), where a length (m) is wanted
a drawing of parts with instants | UsageError | - | --instants goes with --to image: a drawing of parts has no instants
a width of what is not drawn | UsageError | - | --width and --hole go with --to dxf, not with --to mjcf
a file of another program that is not there | ModelError | - | there is no file 'no.linkage2'
an address without a mechanism | ModelError | - | the address 'https://example.org/a.pmks' has no mechanism that is read: addresses of PMKS with mech=… are, those of PMKS+ (?0P…) and others are not; export a file there
a file in units that there are not | ModelError | - | there is no unit system 'parsec': choose one of 'SI', 'mm-N-s', 'in-lbf-s', 'ft-lbf-s', or name a length, a force and a time, as in 'cm-kN-s'
an empty file of another program | ModelError | - | 'file.txt': it is empty
a text of no format | ModelError | - | 'file.txt': it is of no format that is read: PMKS (text, address, .pmks), Linkage (.linkage2), pylinkage (JSON), MJCF and URDF (planar)
a JSON of no format | ModelError | - | 'file.json': its tables ('bars') are of no format that is read: PMKS (text, address, .pmks), Linkage (.linkage2), pylinkage (JSON), MJCF and URDF (planar)
a JSON that is none | ModelError | - | 'file.json': it is no JSON: Expecting ':' delimiter: line 1 column 10 (char 9)
an XML of no format | ModelError | - | 'file.xml': its root element is <svg>: PMKS (text, address, .pmks), Linkage (.linkage2), pylinkage (JSON), MJCF and URDF (planar) are read
an XML that is none | ModelError | - | 'file.xml': it is no XML: no element found: line 1, column 8
an XML with entities | ModelError | - | 'file.xml': it declares entities (<!DOCTYPE>), which are not read: leave them out
a JSON nested too deep | ModelError | - | 'file.json': its parts are nested too deep
an assembly of FreeCAD | ModelError | - | 'file.txt': it is an assembly of FreeCAD (ASMT) (RevoluteJoint), whose spatial joints are not read: export it as URDF or MJCF, or describe its plane in a model file
PMKS with two addresses | ModelError | - | 'file.txt': the file has 2 mechanisms of PMKS (mech=): keep one of them in a file
PMKS with a line that is no joint | ModelError | - | 'file.txt': line 2 of the joints, 'a,b,R,1': a joint is written as links, type (R, P, RP or G), x, y and, of a slide, its angle: ground,input,R,0,0
PMKS with a place that is a word | ModelError | - | 'file.txt': the joint A (ground, a): y is 'there', it must be a finite number
PMKS with a link twice | ModelError | - | 'file.txt': the joint A (ground, a, a): it names a link twice
PMKS with a slide of three | ModelError | - | 'file.txt': the joint A (ground, a, b): a joint of the type P has two links
PMKS with another type | ModelError | - | 'file.pmks': the joint A (a, b): its type is 'G2'; the types are R, P, RP and G
PMKS with a joint of no link | ModelError | - | 'file.pmks': the joint A: it has no Links
PMKS with a driven joint that is not there | ModelError | - | 'file.txt': the file: the driven joint is number 4, counted from 0, of 1
PMKS with two driven joints | ModelError | - | 'file.txt': the file: it marks 2 joints as driven (A, B): keep one
PMKS with a driven slot | ModelError | - | 'file.txt': the joint B (a, b): it is the driven joint, which must be of the type R or P
PMKS with wheels without centres | ModelError | - | 'file.txt': the joint B (a, b): its two wheels have no pins on one carrier, so they have no centres
PMKS with wheels that do not touch | ModelError | - | 'file.txt': the gear joint B: it is 1.41421 and 3.16228 from the centres of a and b, which are 4 apart: it must be where the pitch circles touch, on the line of the centres
PMKS with wheels about one place | ModelError | - | 'file.txt': the gear joint B: wheels about one place do not touch
PMKS where nothing moves | ModelError | - | 'file.txt': the file has no link that moves
Linkage with a thing of its own | ModelError | - | 'file.linkage2': the element <spring>: there is no such thing in a linkage
Linkage with an id that is a word | ModelError | - | 'file.linkage2': the connector 'a': its id is no whole number
Linkage with a connector twice | ModelError | - | 'file.linkage2': the connector 0: there are two of this id
Linkage with a link fastened to a loose connector | ModelError | - | 'file.linkage2': the link 1: it is fastened to the connector 9, which is on no link
Linkage with a link of a thing | ModelError | - | 'file.linkage2': the link 0: its part <pin> is not read
Linkage with a link of nothing there | ModelError | - | 'file.linkage2': the link 0: it refers to the connector 7, which is not there
Linkage fastened to no link | ModelError | - | 'file.linkage2': the connector 0: it refers to the link '4', which is not there
Linkage with a link fastened to nothing | ModelError | - | 'file.linkage2': the link 1: it is fastened to '9', which is not there
Linkage with a fastened actuator | ModelError | - | 'file.linkage2': the link 1: an actuator that is fastened to a link is not read
Linkage with a slider of one limit | ModelError | - | 'file.linkage2': the connector 2: a slider has two limits, not 1
Linkage with a slider of no link | ModelError | - | 'file.linkage2': the connector 2: it is a slider, but is on no link
Linkage with a slider beside its line | ModelError | - | 'file.linkage2': the connector 2: it is drawn 13.2292 mm beside the line of its limits
Linkage with a slider beside its arc | ModelError | - | 'file.linkage2': the connector 2: it is not drawn on its arc of 23.8125 mm
Linkage with an actuator of three | ModelError | - | 'file.linkage2': the actuator 1: an actuator has two connectors, not 3
Linkage with an actuator on nothing | ModelError | - | 'file.linkage2': the actuator 1: the connector 2 is on no other link
Linkage with an actuator at rest | ModelError | - | 'file.linkage2': the actuator 1: its throw is 0 and its cpm 15: it does not move
Linkage with a ratio of one | ModelError | - | 'file.linkage2': the ratio of link 0: a ratio has two links
Linkage with a ratio of nothing | ModelError | - | 'file.linkage2': the ratio of link 0 and link 1: sizes of wheels must be positive
Linkage with wheels on no carrier | ModelError | - | 'file.linkage2': the ratio of link 0 and link 1: no link carries both wheels
Linkage with a wheel without a place | ModelError | - | 'file.linkage2': the ratio of link 0 and link 1: the link 1 has no connector
Linkage with an input that moves | ModelError | - | 'file.linkage2': the connector 2: it is an input that is no anchor
Linkage with an input that swings | ModelError | - | 'file.linkage2': the connector 0: its limitangle is not 0: an input that swings or starts elsewhere is not read
Linkage with an input of two links | ModelError | - | 'file.linkage2': the connector 0: it is an input of 2 links: one can be driven
pylinkage of the older form | ModelError | - | 'file.json': the joint 'A': its type is 'Crank': files of pylinkage's mechanisms are read, with the types ground, revolute, prismatic, tracker; write it by mechanism_to_json of pylinkage.mechanism
pylinkage without a position | ModelError | - | 'file.json': the joint 'A': it has no position [x, y]
pylinkage with a joint twice | ModelError | - | 'file.json': the joint 'A': there are two of this id
pylinkage with another link | ModelError | - | 'file.json': the link 'arm': its type is 'spring'; the types are ground, link, driver, arc_driver
pylinkage with a joint that is not there | ModelError | - | 'file.json': the link 'arm': it refers to the joint 'B', which is not there
pylinkage with a line that is none | ModelError | - | 'file.json': the joint 'A': its axis and its line_point must be pairs [x, y]
pylinkage with an axis of no length | ModelError | - | 'file.json': the joint 'A': its axis has no length
pylinkage with a joint beside its line | ModelError | - | 'file.json': the joint 'A': it is 2 beside its line
pylinkage with a tracker of no link | ModelError | - | 'file.json': the joint 'T': no link has both the joint 'A' and the joint 'B'
pylinkage with a driver of nothing | ModelError | - | 'file.json': the driver 'arm': it needs a motor_joint on the ground and a joint that it drives
pylinkage with an arc that is none | ModelError | - | 'file.json': the driver 'arm': an arc of 0 rad at 0.0174533 rad per step is no motion
MJCF without its package | SolveError | - | files of MJCF and URDF are read by the package mujoco, which is not installed: pip install mujoco
MJCF that MuJoCo refuses | ModelError | - | 'file.xml': MuJoCo does not read it: XML Error: Schema violation: unrecognized element Element 'bod', line 1
MJCF without a joint | ModelError | - | 'file.xml': it has no hinge and no slide, so nothing says in which plane it moves
MJCF with a slide that leaves the plane | ModelError | - | 'file.xml': the joint 'joint1': its axis (0, 0.7071, 0.7071) is not across the hinges' axis (0, 0, 1): only mechanisms that move in one plane are read
MJCF with a ball | ModelError | - | 'file.xml': the joint 'joint1': a ball joint leaves the plane
MJCF with two hinges | ModelError | - | 'file.xml': the body 'b': its joints are no combination that is read: a hinge, a slide, both, or two slides and a hinge; put a body between them
MJCF with a body moved by mocap | ModelError | - | 'file.xml': the body 'm': it is moved by mocap
MJCF with a tendon over pulleys | ModelError | - | 'file.xml': the tendon 't': a tendon over pulleys, bodies or more than two sites is not read
MJCF with a tendon out of its plane | ModelError | - | 'file.xml': the tendon 't': its two ends do not lie in one plane of the motion
MJCF with a tendon that is slack for a while | ModelError | - | 'file.xml': the tendon 't': its spring is slack between two lengths
MJCF with a rough tendon | ModelError | - | 'file.xml': the tendon 't': friction and armature of a tendon between sites are not read
MJCF with a spring of higher order | ModelError | - | 'file.xml': the joint 'h': its spring has higher terms of the displacement, which is not read
MJCF with a damper of higher order | ModelError | - | 'file.xml': the joint 'h': its damping has higher terms of the rate, which is not read
MJCF with shapes in a medium | ModelError | - | 'file.xml': the body 'b': it is in a medium, and its shapes have drag of their own (fluidshape) or the axes of its inertia do not lie in the plane: that is not read
MJCF with a body that sleeps | ModelError | - | 'file.xml': the body 'b': it is asleep until something touches it
MJCF with a plugin | ModelError | - | 'file.xml': the actuator 'p': a plugin of MuJoCo moves it or shapes it
MJCF with a flex | ModelError | - | 'file.xml': the flex 'f': it is deformable, bodies are rigid here
MJCF with slides that are not square | ModelError | - | 'file.xml': the joint 'x': it is one of two slides that are not square to each other, or come after a hinge: what acts along it is not read
MJCF with friction across its plane | ModelError | - | 'file.xml': the joint 'j': its friction is along axes that do not lie in the plane
MJCF with an actuator of its own law | ModelError | - | 'file.xml': the actuator 'p': it acts at a control of 0 too, by a law that is not read: motor, position, velocity and general without dynamics are, on hinges, slides and fixed tendons
MJCF with actuators that are limited together | ModelError | - | 'file.xml': the joint 'h': a limit of the force of several actuators together is not read
MJCF with actuators that carry weight | ModelError | - | 'file.xml': the joint 'k': its actuators carry weight (actuatorgravcomp), which is not read
MJCF with a floor that moves | ModelError | - | 'file.xml': the contact of the shapes 'floor' and 'geom1': it has a surface that moves, which is not read
MJCF with shapes that touch and have no outline | ModelError | - | 'file.xml': the shapes 'hill' and 'geom1': they touch at the reference position, and the contact of such shapes is not read: planes across the plane of the motion with anything round or rectangular are, spheres, and cylinders and boxes along its normal
MJCF with a constraint of two tendons | ModelError | - | 'file.xml': the constraint 'equality0': the lengths of two tendons are not coupled here
MJCF with a curve of joints | ModelError | - | 'file.xml': the constraint 'equality0': its polycoef is no straight line
"""

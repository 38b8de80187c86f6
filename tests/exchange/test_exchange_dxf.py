"""Drawings in DXF: what a reader of the format finds in them, against the model's own geometry."""

import io
import itertools
import math

import numpy as np
import pytest

import mbody
from mbody import gallery
from mbody.engineering.cam_limits import cam_contour
from mbody.exchange import to_dxf

ezdxf = pytest.importorskip("ezdxf")
#: Coordinates are written with 16 digits.
EXACT = 1e-12


def read(drawing):
    return ezdxf.read(io.StringIO(drawing.text))


@pytest.mark.parametrize("name", gallery.names())
def test_every_model_of_the_gallery_is_a_sound_drawing(name):
    if name.startswith("n_windows_40"):
        pytest.skip("forty loops are the same as two")
    document = read(to_dxf(gallery.load(name)))
    audit = document.audit()
    assert not audit.errors and not audit.fixes
    machine = gallery.load(name)
    drawn = {insert.dxf.name for insert in document.modelspace().query("INSERT")}
    assert drawn >= {body.name for body in machine.bodies}
    # no part lies on another
    from ezdxf.bbox import extents

    boxes = [extents([insert]) for insert in document.modelspace().query("INSERT")]
    boxes = sorted((box.extmin.x, box.extmax.x) for box in boxes if box.has_data)
    assert all(a[1] <= b[0] for a, b in itertools.pairwise(boxes))


def area(line):
    """Of a closed polyline with arcs: the polygon, and a segment of a circle for each bulge."""
    points = [(x, y, bulge) for x, y, bulge in line.get_points("xyb")]
    total = 0.0
    for (x, y, bulge), (u, v, _) in zip(points, points[1:] + points[:1], strict=True):
        total += (x * v - u * y) / 2
        if bulge:
            angle = 4 * math.atan(bulge)
            radius = math.hypot(u - x, v - y) / 2 / math.sin(angle / 2)
            total += radius**2 * (angle - math.sin(angle)) / 2
    return total


def test_bars_and_holes_are_those_of_the_model():
    machine = gallery.load("norton_fourbar")
    document = read(to_dxf(machine, "2 in", 0.5))
    assert document.units == 1  # inches
    block = document.blocks["rocker"]
    holes = {(c.dxf.center.x, c.dxf.center.y): c.dxf.radius for c in block.query("CIRCLE")}
    assert holes == {(0.0, 0.0): 0.25, (10.0, 0.0): 0.25}
    (bar,) = block.query("LWPOLYLINE")
    assert bar.closed and bar.dxf.layer == "rocker"
    assert area(bar) == pytest.approx(2 * 10 + math.pi, rel=EXACT)
    # Steiner: a plate within 1 of a triangle has its area, perimeter × 1 and a circle of 1
    (plate,) = document.blocks["coupler"].query("LWPOLYLINE")
    p = np.array(
        [(c.dxf.location.x, c.dxf.location.y) for c in document.blocks["coupler"].query("POINT")]
    )
    sides = [math.dist(p[n], p[n - 1]) for n in range(3)]
    half = sum(sides) / 2
    triangle = math.sqrt(half * math.prod(half - side for side in sides))
    assert area(plate) == pytest.approx(triangle + 2 * half + math.pi, rel=1e-9)


def test_a_cam_touches_its_follower_everywhere():
    """The roller's centre, where the engine has it, is its radius from the drawn contour."""
    machine = gallery.load("cam_follower")
    system = mbody.assemble(machine)
    (line,) = read(to_dxf(machine, "20 mm", "8 mm")).blocks["shaft"].query("LWPOLYLINE")
    contour = np.array([point[:2] for point in line.get_points("xy")])
    run = mbody.kinematics(machine, turn=True, instants=73)
    joint = machine["contact"]
    roller = float(system.numbers["contact.roller"])
    shaft, centre = run["shaft"], run["follower"]
    c, s = np.cos(shaft.angle), np.sin(shaft.angle)
    x, y = centre.x - shaft.x, centre.y - shaft.y
    local = np.column_stack([c * x + s * y, -s * x + c * y])
    # points of the contour are some 0.25 mm apart: the nearest is up to d²/8r more away
    nearest = [np.min(np.hypot(*(contour - place).T)) for place in local]
    assert nearest == pytest.approx(np.full(len(local), roller), rel=1e-3)
    assert min(nearest) > roller * (1 - 1e-6)
    assert contour == pytest.approx(
        cam_contour(joint, system.numbers, np.linspace(0, math.tau, 1440, endpoint=False))
    )


def crank(*joints, **more):
    machine = mbody.Mechanism("crank", units="mm-N-s")
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=1.0, points={"O": (0, 0), "A": (60, 0)}, **more)
    )
    machine.add(mbody.Revolute("O", "ground", "crank.O", pin_radius=12), *joints)
    return machine


def radii(drawing, name="crank"):
    return sorted(c.dxf.radius for c in read(drawing).blocks[name].query("CIRCLE"))


def test_holes_are_those_of_their_pins_and_what_was_asked_for_is_answered():
    with pytest.raises(mbody.ModelError, match=r"pin 'O' is 24 mm wide, .* bar 'crank' 20 mm"):
        to_dxf(crank(), 20, 8)
    drawn = to_dxf(crank(), 30, 8)
    assert radii(drawn) == [12.0]
    assert any("O 24 mm; 8 mm is that of the others" in note for note in drawn.notes)
    # a width that nobody gave fits the widest hole
    free = to_dxf(crank())
    (bar,) = read(free).blocks["crank"].query("LWPOLYLINE")
    assert area(bar) == pytest.approx(60 * 60 + math.pi * 30**2, rel=EXACT)
    # two pins at one place have one hole, the wider; of a typed width that is none of a pin's
    rod = mbody.Distance("R", "crank.O", mbody.Marker("ground", (5.0, 0.0)), 5)
    both = crank(mbody.Revolute("P", "ground", "crank.O", pin_radius=14), rod)
    assert radii(to_dxf(both, 40, 8)) == [14.0]


def test_a_link_with_a_slot_has_its_bar_too():
    machine = crank(
        mbody.PinSlot("slot", mbody.Marker("crank", (30, 0)), "ground", limits=(-20, 20))
    )
    slot, bar = sorted(read(to_dxf(machine, 40, 8)).blocks["crank"].query("LWPOLYLINE"), key=area)
    assert area(slot) == pytest.approx(40 * 8 + math.pi * 4**2, rel=EXACT)
    assert area(bar) == pytest.approx(60 * 40 + math.pi * 20**2, rel=EXACT)

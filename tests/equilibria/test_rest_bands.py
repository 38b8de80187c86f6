"""Bands of positions in which friction holds, against closed forms, statics and motions."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    CentrifugalField,
    FrictionForce,
    Gravity,
    Marker,
    Mechanism,
    Prismatic,
    Revolute,
    SolveError,
    Spring,
    equilibrium,
)
from tests.support.frictional import slider_crank, with_changes

pytestmark = pytest.mark.processor
g = 9.81
#: Ends are located to rounding, of positions of order one; drives are balanced to 1e-13 or so.
END = 1e-11
UPRIGHT = {part: Marker(part, (0.0, 0.0), 0.5 * math.pi) for part in ("ground", "sleeve")}
BALLS, SLEEVE, PACKING, ARM = 6.0, 18.0, 30.0, 0.3


def governor(speed):
    """The Porter governor of the gallery, free to move, with a packing at its sleeve."""
    machine = mbody.gallery.load("porter_governor").without("theta")
    change = {"field": {"speed": speed}}
    machine = with_changes(machine, lambda element: change.get(element.name, {}))
    machine.add(FrictionForce("packing", *UPRIGHT.values(), force=PACKING))
    return machine


def height(speed, sign):
    """m ω² h = (m + M) g ± F, of equal arms that are pivoted on the axis."""
    return ((BALLS + SLEEVE) * g + sign * PACKING) / (BALLS * speed**2)


@pytest.mark.parametrize("speed", [12.5, 13.0, 15.0, 30.0])
def test_a_governor_has_a_band_of_heights(speed):
    """On either side; at rest h = (m + M) g/(m ω²) is in the middle of it."""
    found = equilibrium(governor(speed))
    assert len(found.bands) == 2 and found.status == "completed"
    for band in found.bands:
        ends = [-2.0 * height(speed, sign) for sign in (1.0, -1.0)]
        own = sorted(end["sleeve"][1] for end in (band.low, band.high))
        assert own == pytest.approx(ends, abs=END)
        (number,) = band.positions
        assert found[number].stability == "stable"
        middle = 0.5 * (own[0] + own[1])
        assert found[number]["sleeve"].y[0] == pytest.approx(middle, abs=END)


def test_a_slow_governor_stays_up_as_far_as_friction_holds():
    """Where the lower end is below what the arms reach the band goes through to the other side."""
    (band,) = equilibrium(governor(11.4)).bands
    assert height(11.4, 1.0) > ARM > height(11.4, -1.0)
    ends = (band.low, band.high)
    lean = sorted(math.remainder(end["arm_r"][2], 2.0 * math.pi) for end in ends)
    most = math.acos(height(11.4, -1.0) / ARM)
    assert lean == pytest.approx([-most, most], abs=END)
    assert not equilibrium(governor(3.0)).bands


def test_a_governor_sticks_until_its_speed_leaves_the_band():
    """Hysteresis: going up and going down the sleeve starts at the speeds of the closed form."""
    lift = 0.22
    lean = math.acos(lift / ARM)
    for rate, sign in ((0.5, 1.0), (-0.5, -1.0)):
        begin = math.sqrt((BALLS + SLEEVE) * g / (BALLS * lift))
        machine = governor(mbody.laws.Polynomial([begin, rate]))
        leaves = math.sqrt(((BALLS + SLEEVE) * g + sign * PACKING) / (BALLS * lift))
        at = (leaves - begin) / rate
        guess = {"arm_r": lean, "arm_l": -lean, "link_r": -lean, "link_l": lean}
        run = mbody.simulate(machine, 1.05 * at, guess=guess, rtol=1e-10)
        slips = [event for event in run.events if event.name == "slip"]
        assert slips[0].t == pytest.approx(at, abs=1e-10)
        assert run.mode("packing")[0] == "stick"
        still = run.t < at
        assert np.ptp(run["sleeve"].y[still]) < 1e-12
        assert sign * (run["sleeve"].y[-1] - run["sleeve"].y[0]) > 1e-6


def test_speeds_are_found_with_friction():
    """`solve_for`: the sleeve just moving up or down at some height, textbook's two speeds."""
    for sign in (1.0, -1.0):
        machine = mbody.gallery.load("porter_governor")
        lean, rate = math.acos(0.25 / ARM), 1e-7 * sign
        change = {"theta": {"law": mbody.laws.ConstantSpeed(lean, rate)}}
        machine = with_changes(machine, lambda element, own=change: own.get(element.name, {}))
        machine.add(FrictionForce("packing", *UPRIGHT.values(), force=PACKING))
        unknown = {"field.speed": {"start": 12.0, "low": 1.0}}
        answer = mbody.solve_for(machine, unknown, "theta.effort = 0", at={"t": 0.0})
        wanted = math.sqrt(((BALLS + SLEEVE) * g + sign * PACKING) / (BALLS * 0.25))
        # centripetal accelerations go by the square of the rate
        assert answer[0].unknowns["field.speed"] == pytest.approx(wanted, rel=1e-12)


def pendulum():
    machine = Mechanism("pendulum in a pin with friction", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bob", mass=2.0, inertia=0.18, cg=(0.0, -0.4), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bob.O", friction=0.5, static=0.75, pin_radius=0.05),
        Gravity("gravity", y=-g),
    )
    return machine


def test_a_pendulum_leans_by_its_friction_circle():
    """Its weight passes the pin at the radius of the friction circle: ρ = l sin θ."""
    machine = pendulum()
    found = equilibrium(machine)
    lean = math.asin(0.75 * 0.05 / math.hypot(1.0, 0.75) / 0.4)
    ends = [(band.low["bob"][2], band.high["bob"][2]) for band in found.bands]
    assert ends[0] == pytest.approx((-lean, lean), abs=END)
    assert ends[1] == pytest.approx((math.pi - lean, math.pi + lean), abs=END)
    assert [band.positions for band in found.bands] == [(0,), (1,)]
    for part, mode in ((0.999, "stick"), (1.001, "slip+")):
        run = mbody.simulate(machine, 0.01, guess={"bob": -part * lean})
        assert set(run.mode("O")) == {mode}


@pytest.mark.parametrize("static", [None, 0.4])
def test_a_block_on_a_spring(static):
    """|k x| ≤ μ m g, with the static coefficient where there is one."""
    machine = Mechanism("block on a spring", ground={"W": (-1.0, 0.0)})
    machine.add(
        Body("block", mass=3.0),
        Prismatic("rail", "ground", "block", friction=0.25, static=static),
        Spring("spring", "ground.W", "block", stiffness=200.0, free_length=1.0),
        Gravity("gravity", y=-g),
    )
    band, behind = equilibrium(machine).bands  # the spring may reach to the other side of the wall
    assert behind.high["block"][0] < -1.0
    x = (static or 0.25) * 3.0 * g / 200.0
    assert band.low["block"][0] == pytest.approx(-x, abs=END)
    assert band.high["block"][0] == pytest.approx(x, abs=END)
    assert band.leader == "block" and band.positions == (0,)


@pytest.mark.parametrize("slope", [0.2, 0.5, 1.1])
def test_what_is_self_locking_is_named(slope):
    def incline(mu):
        machine = Mechanism("block on an incline")
        machine.add(
            Body("block", mass=3.0),
            Prismatic(
                "rail", *(Marker(b, (0.0, 0.0), slope) for b in ("ground", "block")), friction=mu
            ),
            Gravity("gravity", y=-g),
        )
        return machine

    found = equilibrium(incline(1.000001 * math.tan(slope)))
    assert not len(found) and found.bands[0].everywhere
    assert found.notes == ("self-locking: friction of 'rail' holds 'block' in every position",)
    assert "0 rest positions" in str(found) and "self-locking" in str(found)
    with pytest.raises(SolveError, match="drive 'block' away"):
        equilibrium(incline(0.999999 * math.tan(slope)))


def sprung(machine):
    machine.add(
        Gravity("gravity", y=-g),
        Spring("spring", "ground.O", "slider.B", stiffness=5e3, free_length=0.2),
    )
    return machine


@pytest.mark.parametrize("more", [{}, {"static": 0.3}, {"length": 0.06}])
def test_at_its_ends_a_band_needs_no_effort(more):
    """Four frictional joints: by statics, whose band of holding torques begins or ends with none
    there. The torque acts on the crank alone, where here nothing acts.
    """
    how = {"mu": 0.2, "masses": (1.0, 2.0, 3.0), **more}
    held = sprung(slider_crank(**how))
    found = equilibrium(sprung(slider_crank(**how)).without("motor"))
    assert len(found.bands) == 2
    for band in found.bands:
        limits = []
        for end in (band.low, band.high):
            run = mbody.statics(held, drive={"motor": end["crank"][2]}, guess=end)
            effort = run.range("motor")
            limits.append((float(effort.low[0]), float(effort.high[0])))
        top = max(abs(value) for pair in limits for value in pair)
        assert top > 1.0
        # moving one way impends at one end, the other way at the other
        nearest = [min(abs(value) for value in pair) for pair in limits]
        assert max(nearest) < 1e-11 * top
        for part in np.linspace(0.02, 0.98, 7):
            angle = (1.0 - part) * band.low["crank"][2] + part * band.high["crank"][2]
            inside = mbody.statics(held, drive={"motor": angle}, guess=band.low).range("motor")
            assert inside.low[0] < 0.0 < inside.high[0]


def test_data_and_tables():
    machine = pendulum()
    found = equilibrium(machine)
    told = json.loads(json.dumps(found.data(), allow_nan=False))
    assert [band["positions"] for band in told["bands"]] == [[0], [1]]
    x, y, angle = found.bands[0].low["bob"]
    assert told["units"]["angle"] == "deg"
    assert told["bands"][0]["low"]["bob"] == pytest.approx([x, y, math.degrees(angle)])
    assert found.data("rad")["bands"][0]["low"]["bob"] == pytest.approx([x, y, angle])
    text = str(found)
    assert "HELD" in text and "355.699" in text and "4.301" in text
    assert max(map(len, text.splitlines())) <= 100
    smooth = with_changes(
        machine, lambda one: {"friction": 0.0, "static": None} if one.name == "O" else {}
    )
    assert not equilibrium(smooth).bands and "bands" not in equilibrium(smooth).data()


def test_the_first_place_may_be_anywhere():
    """A band that the start lies in is not cut there."""
    machine = pendulum()
    wanted = sorted(band.low["bob"][2] % (2.0 * math.pi) for band in equilibrium(machine).bands)
    for start in (0.05, -0.05, 3.1, 1.0):
        bands = equilibrium(machine, starts={"bob": start}).bands
        own = sorted(band.low["bob"][2] % (2.0 * math.pi) for band in bands)
        assert own == pytest.approx(wanted, abs=END)


def test_several_free_motions_have_no_bands():
    machine = Mechanism("two blocks")
    for name in "ab":
        machine.add(
            Body(name, mass=1.0),
            Prismatic(f"rail_{name}", "ground", name, friction=0.2),
            Spring(f"spring_{name}", Marker("ground", (-1.0, 0.0)), name, 200.0, free_length=1.0),
        )
    machine.add(Gravity("gravity", y=-g))
    found = equilibrium(machine)
    assert not found.bands and any("left out of equilibrium" in note for note in found.notes)


def test_a_field_may_be_the_only_load():
    """A bead on an arm that turns, without gravity: friction is of the force across the arm."""
    machine = Mechanism("bead on an upright hoop", ground={"O": (0.0, 0.0)})
    machine.add(
        Body("bead", mass=1.0, spread="point", cg=(0.0, -0.5), points={"O": (0.0, 0.0)}),
        Revolute("O", "ground.O", "bead.O", friction=0.3, pin_radius=0.05),
        CentrifugalField("field", Marker("ground", "O", 0.5 * math.pi), speed=7.0),
    )
    found = equilibrium(machine)
    rho = 0.3 * 0.05 / math.hypot(1.0, 0.3)
    # the force m ω² l sin θ along x has the arm l cos θ; it presses the pin with its size
    lean = math.acos(rho / 0.5)
    ends = sorted(
        abs(end["bead"][2]) % (2.0 * math.pi) for b in found.bands for end in (b.low, b.high)
    )
    assert any(end == pytest.approx(lean, abs=END) for end in ends)

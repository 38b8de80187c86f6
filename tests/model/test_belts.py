"""Belts and band brakes against Euler and Eytelwein, their levers, and dense equations."""

import math

import pytest

import mbody
from tests.support.frictional import difference

pytestmark = pytest.mark.processor
BAND = {"radius": 0.15, "wrap": math.radians(240.0), "friction": 0.3, "lever": 0.5, "arm": 0.1}
RATIO = math.exp(0.3 * math.radians(240.0))
FORCE = 200.0


def braked(speed=None, helping=0.0, **more):
    machine = mbody.Mechanism("a drum with a band brake", ground={"O": (0.0, 0.0)})
    machine.add(
        mbody.Body("drum", mass=10.0, inertia=0.8),
        mbody.Revolute("pin", "ground.O", "drum"),
        mbody.BandBrake(
            "brake", "ground.O", "drum", force=FORCE, helping_arm=helping, **BAND | more
        ),
    )
    if speed is not None:
        machine.add(mbody.AngleDriver("motor", "drum", mbody.laws.ConstantSpeed(0.0, speed)))
    return machine


@pytest.mark.parametrize("helping", [0.0, 0.02])
@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_a_band_brake_helps_itself_in_one_direction(speed, helping):
    run = mbody.kinetostatics(braked(speed, helping), 0.0)
    pull = FORCE * BAND["lever"] * BAND["radius"] * (RATIO - 1.0)
    arm = BAND["arm"]
    wanted = pull / (arm - helping * RATIO if speed > 0.0 else arm * RATIO - helping)
    assert abs(run.effort("motor")[0]) == pytest.approx(wanted, rel=1e-13)
    assert run.losses["brake"][0] == pytest.approx(5.0 * wanted, rel=1e-13)
    assert difference(run, 0) < 1e-13


@pytest.mark.parametrize("speed", [7.0, -7.0])
def test_it_stops_a_drum_and_holds_it(speed):
    """J ω = M t; then it stays, and the work lost is that of the rotation."""
    run = mbody.simulate(braked(helping=0.02), 5.0, rates={"drum": speed}, rtol=1e-10)
    pull = FORCE * BAND["lever"] * BAND["radius"] * (RATIO - 1.0)
    arm = BAND["arm"]
    torque = pull / (arm - 0.02 * RATIO if speed > 0.0 else arm * RATIO - 0.02)
    (event,) = run.events
    assert event.name == "stick" and event.t == pytest.approx(0.8 * 7.0 / torque, rel=1e-11)
    assert run.energy.lost["brake"][-1] == pytest.approx(0.5 * 0.8 * 49.0, rel=1e-11)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_holds_as_much_as_it_brakes_in_either_direction(sign):
    """A torque that grows turns the drum when it is what the band holds in that direction."""
    machine = braked(helping=0.02, static=1.2)
    machine.add(mbody.Torque("load", "drum", value=mbody.laws.Polynomial([0.0, sign * 50.0])))
    run = mbody.simulate(machine, 8.0, rtol=1e-10)
    pull = FORCE * BAND["lever"] * BAND["radius"] * (RATIO - 1.0)
    arm = BAND["arm"]
    holds = 1.2 * pull / (arm - 0.02 * RATIO if sign > 0.0 else arm * RATIO - 0.02)
    slips = [event.t for event in run.events if event.name == "slip"]
    assert slips == pytest.approx([holds / 50.0] if holds < 400.0 else [], rel=1e-11)
    band = mbody.statics(braked(0.0, helping=0.02, static=1.2), drive={"motor": 0.0}).range("motor")
    end = band.high[0] if sign > 0.0 else -band.low[0]
    assert end == pytest.approx(holds, rel=1e-12)


TENSION, MU = 400.0, 0.3


def drive(ri=0.1, rj=0.25, crossed=False, rates=None, angle=0.4, **more):
    distance = 0.8
    far = (distance * math.cos(angle), distance * math.sin(angle))
    machine = mbody.Mechanism("a belt drive", ground={"P": (0.0, 0.0), "Q": far})
    rough = {"friction": 0.05, "pin_radius": 0.02} if more.pop("rough", False) else {}
    machine.add(
        mbody.Body("motor", mass=2.0, inertia=0.02),
        mbody.Body("fan", mass=5.0, inertia=0.3),
        mbody.Revolute("P", "ground.P", "motor", **rough),
        mbody.Revolute("Q", "ground.Q", "fan", **rough),
        mbody.Belt(
            "belt",
            "motor",
            "fan",
            **{"tension": TENSION, "radius_i": ri, "radius_j": rj, "distance": distance},
            **{"friction": MU, "crossed": crossed, **more},
        ),
    )
    for body, rate in (rates or {}).items():
        machine.add(mbody.AngleDriver(f"turns_{body}", body, mbody.laws.ConstantSpeed(0.0, rate)))
    return machine


def greatest(ri, rj, crossed):
    wrap = math.pi + 2.0 * math.asin((ri + rj) / 0.8)
    if not crossed:
        wrap = math.pi - 2.0 * math.asin(abs(ri - rj) / 0.8)
    ratio = math.exp(MU * wrap)
    return 2.0 * TENSION * (ratio - 1.0) / (ratio + 1.0)


SIZES = [(0.1, 0.25), (0.25, 0.1), (0.2, 0.2)]


@pytest.mark.parametrize("crossed", [False, True])
@pytest.mark.parametrize("sizes", SIZES)
@pytest.mark.parametrize("rates", [{"motor": 30.0, "fan": 1.0}, {"motor": -3.0, "fan": 20.0}])
def test_a_belt_that_slips_has_its_greatest_force(sizes, rates, crossed):
    run = mbody.kinetostatics(drive(*sizes, crossed, rates), 0.0)
    force = greatest(*sizes, crossed)
    sign = -1.0 if crossed else 1.0
    ahead = math.copysign(1.0, sizes[0] * rates["motor"] - sign * sizes[1] * rates["fan"])
    assert run.effort("turns_motor")[0] == pytest.approx(ahead * force * sizes[0], rel=1e-12)
    assert run.effort("turns_fan")[0] == pytest.approx(-ahead * sign * force * sizes[1], rel=1e-12)
    sine = (sizes[0] - sign * sizes[1]) / 0.8
    along, across = 2.0 * TENSION * math.sqrt(1.0 - sine * sine), force * abs(sine)
    assert run.reaction("Q").magnitude[0] == pytest.approx(math.hypot(along, across), rel=1e-12)
    assert difference(run, 0) < 1e-13
    rough = mbody.kinetostatics(drive(*sizes, crossed, rates, rough=True), 0.0)
    assert difference(rough, 0) < 1e-12


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_turns_both_together(crossed):
    """Two rotors that begin at other speeds: they slip, then turn together, as by hand."""
    ri, rj = 0.1, 0.25
    run = mbody.simulate(
        drive(ri, rj, crossed), 1.0, rates={"motor": 100.0, "fan": 0.0}, rtol=1e-10
    )
    sign = -1.0 if crossed else 1.0
    force = greatest(ri, rj, crossed)
    end = ri * 100.0 / (force * (ri**2 / 0.02 + rj**2 / 0.3))
    (event,) = run.events
    assert event.name == "stick" and event.t == pytest.approx(end, rel=1e-11)
    motor = 100.0 - force * ri / 0.02 * end
    assert run["motor"].omega[-1] == pytest.approx(motor, rel=1e-11)
    assert run["fan"].omega[-1] == pytest.approx(sign * ri / rj * motor, rel=1e-11)
    before = 0.5 * 0.02 * 100.0**2
    after = 0.5 * 0.02 * motor**2 + 0.5 * 0.3 * (ri / rj * motor) ** 2
    assert run.energy.lost["belt"][-1] == pytest.approx(before - after, rel=1e-10)


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_the_power_of_a_belt_has_a_limit(part):
    """A brake on the fan: the belt sticks below its limit and slips above."""
    ri, rj = 0.1, 0.25
    machine = drive(ri, rj, rates={"motor": 50.0})
    torque = part * greatest(ri, rj, crossed=False) * rj
    machine.add(mbody.Clutch("load", "ground", "fan", torque=torque))
    rates = {"motor": 50.0, "fan": 20.0}
    run = mbody.simulate(machine, 0.5, rates=rates, rtol=1e-10)
    assert run.mode("belt")[-1] == ("stick" if part < 1.0 else "slip+")
    force = float(-run.reaction("load").torque[-1]) / rj
    if part < 1.0:
        assert float(run.reaction("belt").torque[-1]) == pytest.approx(force * rj, rel=1e-9)

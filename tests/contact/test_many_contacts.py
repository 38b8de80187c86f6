"""Time stepping with impulses, ``method="moreau"``: piles, chains on floors, stacks.

What is compared with is a closed form; one step alone is in
`tests/contact/test_one_impulse_step.py`.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import mbody
from tests.support.piles import RADIUS, G, box, chain, disc, far_apart, floored, pile, stack


def stepped(machine, until, step, **options):
    return mbody.simulate(machine, until, method="moreau", step=step, **options)


# -- at rest ---------------------------------------------------------------------------------------


def test_a_pile_of_ten_discs_rests():
    """At rest the floor carries the weight, whatever the forces between the discs are: 1e-10 of it,
    with impulses to 1e-12 of the greatest.
    """
    run = stepped(pile(4), 0.4, 2e-3, rtol=1e-12, instants=21)
    assert run.status == "completed"
    assert np.abs(run.contact("floor") / (10 * G) - 1.0).max() < 1e-10
    floor = run.reaction("floor")
    assert np.abs(floor.fy / (10 * G) - 1.0).max() < 1e-10
    assert np.abs(floor.fx).max() < 1e-9 * 10 * G
    moved = [abs(run[name].x - run[name].x[0]).max() for name in run]
    moved += [abs(run[name].y - run[name].y[0]).max() for name in run]
    assert max(moved) < 1e-11
    # 18 places touch in a triangle of ten discs, and four on the floor
    assert len(run.stepped.touching(-1 + len(run), "floor")) == 4
    assert run.stats["contacts"] == 22


#: Least friction between equal discs, two on the floor and one on them: tan 15°; on the floor a
#: third of that.
LEAST, LEAST_FLOOR = 0.2679491924311227, 0.0893163974770409


@pytest.mark.parametrize(
    "between, floor, stays",
    [
        (0.2, 0.2, False),
        (0.5, 0.5, True),
        (LEAST * 0.998, 1.0, False),
        (LEAST * 1.002, 1.0, True),
        (1.0, LEAST_FLOOR * 0.998, False),
        (1.0, LEAST_FLOOR * 1.002, True),
    ],
)
def test_three_discs_stay_or_fall_by_their_friction(between, floor, stays):
    places = [(0.0, RADIUS), (2 * RADIUS, RADIUS), (RADIUS, RADIUS * (1 + math.sqrt(3)))]
    run = stepped(pile(2, between, floor, places), 0.3, 1e-3, rtol=1e-12)
    sunk = run["d2"].y[0] - run["d2"].y[-1]
    assert run.status == "completed"
    # just below the least friction the accelerations are small: 2e-3 of it give 0.05 mm in 0.3 s
    assert (abs(sunk) < 1e-12) if stays else (sunk > 2e-5)


def test_boxes_stand_on_each_other():
    run = stepped(stack(5), 1.0, 2e-3, rtol=1e-12)
    assert run.status == "completed"
    assert max(abs(run[name].y - run[name].y[0]).max() for name in run) < 1e-12
    assert max(abs(run[name].angle).max() for name in run) < 1e-12
    assert run.contact("floor")[-1] == pytest.approx(5 * G, rel=1e-10)
    # each box has two places on the one below
    assert len(run.stepped.touching(len(run) - 1)) == 10


@pytest.mark.parametrize("ratio", [1e-6, 1e3, 1e6, 1e9])
def test_a_heavy_box_lies_on_a_light_one(ratio):
    """Changes that are nothing beside the impulse of the heavy one are much beside the light one's
    weight: rates are asked for to 32 rtol of those of a step, 0.02 m/s.
    """
    machine = floored("heavy on light")
    heavy = replace(box("b1", 0.02, 0.15), mass=ratio, inertia=ratio * 0.05 / 12.0)
    machine.add(box("b0", 0.0, 0.05), heavy)
    machine.add(mbody.Between("floor", "ground.floor", "b*.box", friction=0.5))
    machine.add(mbody.Between("boxes", "b*.box", "b*.box", friction=0.5))
    run = stepped(machine, 0.5, 2e-3)
    assert run.status == "completed"
    # half a second at the most that rates may be off
    assert max(np.ptp(run[name].y) for name in run) < 0.5 * 32e-8 * 0.02 * 10
    # the heavy one's velocity is the sum of two rates, its change that of two steps
    assert run.contact("floor")[-1] == pytest.approx((1.0 + ratio) * G, rel=4 * 32e-8)


def test_a_ball_that_loses_nothing_gains_nothing():
    """Works of impacts are rounding: that is no gain of energy by Kane's paradox."""
    assert stepped(bouncing(1.0), 3.0, 5e-4).status == "completed"


# -- motion ----------------------------------------------------------------------------------------


def oscillator():
    machine = floored("Coulomb oscillator")
    machine.add(
        mbody.Body("block", mass=1.5, inertia=1.0, points={"C": (0, 0)}, guess=(0.7, 0.0, 0.0)),
        mbody.Contact("under", "ground.floor", "block.C", friction=0.25),
        mbody.Spring("spring", "ground.O", "block.C", stiffness=60.0),
    )
    return machine


def test_the_coulomb_oscillator_stays_where_it_should_with_order_one():
    """It turns six times and stays at −0.03575 m."""
    errors = []
    steps = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
    for step in steps:
        run = stepped(oscillator(), 4.0, step, rtol=1e-12)
        errors.append(abs(run["block"].x[-1] + 0.03575))
        assert run.mode("under")[-1] == "stick"
        assert run.energy.error < 1e-9
        # friction holds the spring, the floor the weight
        assert run.reaction("under").fx[-1] == pytest.approx(60.0 * run["block"].x[-1], rel=1e-6)
        # what opened while it slid closes step by step
        assert run.contact("under")[-1] == pytest.approx(1.5 * G, rel=1e-7)
    # six turns, each between the ends of a step, at most a h²/8 beyond the nearer one, where the
    # block turns with a ≤ k x/m + μ g = 30.5 m/s²
    assert all(error < 23.0 * step**2 for error, step in zip(errors, steps, strict=True))


def tiled(kind, mover, friction, wall=False):
    """A box or disc that slides at 2 m/s over four tiles of 1 m, side by side, from 0.3 m on."""
    points, shapes = {}, {}
    for n in range(4):
        corners = ((n, 0.0), (n + 1.0, 0.0), (n + 1.0, -0.3), (float(n), -0.3))
        points |= {f"{key}{n}": corner for key, corner in zip("abcd", corners, strict=True)}
        names = [f"{key}{n}" for key in ("ab" if kind == "segment" else "abcd")]
        shapes[f"tile{n}"] = {kind: names}
    if wall:
        points |= {"e": (2.5, 0.0), "f": (2.5, 0.3), "g": (2.0, 0.3)}
        shapes["tile4"] = {"polygon": ["a2", "e", "f", "g"]}
    machine = mbody.Mechanism("tiles", ground=points, ground_shapes=shapes)
    machine.add(mbody.Gravity("gravity", y=-G))
    made = box("m", 0.3, 0.1, 0.2, 0.2) if mover == "box" else disc("m", 0.3, RADIUS)
    machine.add(made, mbody.Between("floor", "ground.tile*", "m.[br]*", friction=friction))
    machine.simulation = mbody.SimulationSettings(1.0, {"m": {"vx": 2.0}})
    return machine


@pytest.mark.parametrize("kind", ["segment", "polygon"])
@pytest.mark.parametrize("mover", ["box", "disc"])
def test_what_slides_from_tile_to_tile_strikes_none(kind, mover):
    """Where tiles meet no edge is struck, though each has one there that ends in the floor."""
    run = stepped(tiled(kind, mover, 0.0), 1.0, 2e-3)
    assert run["m"].x[-1] == pytest.approx(2.3, abs=1e-12)
    assert run["m"].vx[-1] == pytest.approx(2.0, abs=1e-12)
    assert np.ptp(run["m"].y) < 1e-12
    # with friction: a box stops after v²/(2 μ g), a disc rolls with two thirds of its speed
    run = stepped(tiled(kind, mover, 0.3), 1.0, 2e-3)
    if mover == "box":
        assert run["m"].x[-1] - 0.3 == pytest.approx(4.0 / (0.6 * G), abs=2e-3)
    else:
        assert run["m"].vx[-1] == pytest.approx(4.0 / 3.0, rel=1e-9)


@pytest.mark.parametrize("kind", ["segment", "polygon"])
def test_by_events_too_no_tile_is_struck(kind):
    run = mbody.simulate(tiled(kind, "box", 0.0), 1.0)
    assert run["m"].x[-1] == pytest.approx(2.3, abs=1e-10)
    assert np.ptp(run["m"].y) < 1e-12
    # with friction it stops after v²/(2 μ g)
    run = mbody.simulate(tiled(kind, "box", 0.3), 1.0)
    assert run["m"].x[-1] - 0.3 == pytest.approx(4.0 / (0.6 * G), rel=1e-9)
    run = mbody.simulate(tiled(kind, "box", 0.0, wall=True), 1.0)
    assert run["m"].x[-1] == pytest.approx(1.9, abs=1e-10)


def two_tiles(kind, mover, friction, fixed, above=0.0):
    """What slides at 2 m/s over two bodies side by side, welded to the ground or upon a floor."""
    places = {"O": (0.0, 0.0), "w0": (0.0, 0.3), "w1": (1.0, 0.3)}
    shapes = {"floor": {"line": {"point": "O"}}}
    machine = mbody.Mechanism("row", ground=places, ground_shapes=shapes)
    corners = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (1.0, -0.3), "d": (0.0, -0.3)}
    top = {"top": {kind: ["a", "b"] if kind == "segment" else list("abcd")}}
    start = {"m": {"vx": 2.0}}
    for n in range(2):
        tile = mbody.Body(
            f"t{n}", mass=50.0, inertia=5.0, cg=(0.5, -0.15), points=corners, shapes=top
        )
        machine.add(tile)
        if fixed:
            machine.add(mbody.Fixed(f"weld{n}", f"ground.w{n}", f"t{n}.a"))
        start[f"t{n}"] = {"x": float(n), "y": 0.3, "angle": 0.0}
    if not fixed:
        machine.add(mbody.Between("under", "ground.floor", "t*.top", friction=0.5))
    y = 0.3 + above
    made = box("m", 0.3, y + 0.1, 0.2, 0.2) if mover == "box" else disc("m", 0.3, y + RADIUS)
    machine.add(made, mbody.Between("upon", "t*.top", "m.[br]*", friction=friction))
    machine.add(mbody.Gravity("gravity", y=-G))
    machine.simulation = mbody.SimulationSettings(0.5, start)
    return machine


@pytest.mark.parametrize("kind", ["segment", "polygon"])
@pytest.mark.parametrize("mover", ["box", "disc"])
def test_what_slides_from_one_welded_body_to_the_next_strikes_none(kind, mover):
    run = stepped(two_tiles(kind, mover, 0.0, fixed=True), 0.5, 2e-3)
    assert run["m"].x[-1] == pytest.approx(1.3, abs=1e-10)
    assert np.ptp(run["m"].y) < 1e-10
    run = stepped(two_tiles(kind, "box", 0.3, fixed=True), 0.5, 2e-3)
    assert run["m"].x[-1] - 0.3 == pytest.approx(1.0 - 0.125 * 0.3 * G, abs=2e-3)


def test_nor_does_a_box_that_slides_from_one_free_body_to_the_next():
    """Tiles sink by what overlap steps leave; what lies on that is level with them."""
    run = stepped(two_tiles("polygon", "box", 0.0, fixed=False), 0.5, 2e-3)
    assert run["m"].x[-1] == pytest.approx(1.3, abs=1e-10)
    # and after a fall upon one of them
    run = stepped(two_tiles("polygon", "box", 0.0, fixed=False, above=0.01), 0.5, 2e-3)
    assert run["m"].x[-1] == pytest.approx(1.3, abs=1e-5)


@pytest.mark.parametrize("fixed", [True, False])
def test_by_events_no_seam_of_two_bodies_is_struck(fixed):
    run = mbody.simulate(two_tiles("polygon", "box", 0.0, fixed), 0.5)
    assert run["m"].x[-1] == pytest.approx(1.3, abs=1e-10)
    assert {one.name for one in run.events} == {"open"}


def test_a_disc_rolls_down_a_road_of_polygons():
    """Beyond a tile its upper edge goes on above the road, which is no overlap."""
    x, y, angle, points, shapes = 0.0, 0.0, 0.0, {}, {}
    for n in range(6):
        points |= {f"p{n}": (x, y), f"q{n}": (x, y - 1.0)}
        x, y, angle = x + 0.5 * math.cos(angle), y + 0.5 * math.sin(angle), angle - 0.2
    for n in range(5):
        shapes[f"tile{n}"] = {"polygon": [f"p{n}", f"p{n + 1}", f"q{n + 1}", f"q{n}"]}
    machine = mbody.Mechanism("road", ground=points, ground_shapes=shapes)
    machine.add(mbody.Gravity("gravity", y=-G), disc("m", 0.2, RADIUS))
    machine.add(mbody.Between("floor", "ground.tile*", "m.rim", friction=0.1))
    machine.simulation = mbody.SimulationSettings(0.8, {"m": {"vx": 2.0}})
    run, exact = stepped(machine, 0.8, 5e-4), mbody.simulate(machine, 0.8)
    assert run.status == "completed"
    # each of three impacts and flights is a step late at the most
    for part in ("x", "y"):
        assert getattr(run["m"], part)[-1] == pytest.approx(
            getattr(exact["m"], part)[-1], abs=3 * 3.0 * 5e-4
        )


@pytest.mark.parametrize("kind", ["segment", "polygon"])
def test_a_wall_upon_tiles_is_struck(kind):
    run = stepped(tiled(kind, "box", 0.0, wall=True), 1.0, 2e-3)
    assert run["m"].x[-1] == pytest.approx(1.9, abs=1e-6)
    assert abs(run["m"].vx[-1]) < 1e-9


def bouncing(restitution):
    machine = floored("ball")
    machine.add(
        disc("ball", 0.0, 1.0 + RADIUS),
        mbody.Contact("hit", "ground.floor", "ball.rim", restitution=restitution, law="newton"),
    )
    return machine


def test_a_ball_comes_to_rest_by_impacts():
    """t₀ (1 + e)/(1 − e) with t₀ = √(2 y/g), of order one in the step; impacts take m g y."""
    exact = math.sqrt(2.0 / G) * 1.8 / 0.2
    for step in (1e-3, 2.5e-4):
        run = stepped(bouncing(0.8), 5.0, step, instants=5001)
        moving = np.flatnonzero(np.abs(run["ball"].vy) > 5 * G * step)
        # at 5 g h there are 2·5 h/(1 − e) = 50 steps left; each of some 25 impacts is a step late
        assert -50 * step < run.t[moving[-1]] - exact < 25 * step
        assert run["ball"].y[-1] == pytest.approx(RADIUS, abs=1e-6)
        # an impact half a step late takes v h/2 more of the fall: Σ 4.43 · 0.8ⁿ/2 = 11 m/s
        assert run.energy.lost["hit"][-1] == pytest.approx(G, rel=11 * step)


def test_a_disc_that_slides_comes_to_roll():
    """μ g t = v₀/3: then it rolls with 2 v₀/3, and nothing is lost any more."""
    machine = floored("disc")
    machine.add(
        disc("disc", 0.0, RADIUS), mbody.Contact("rim", "ground.floor", "disc.rim", friction=0.15)
    )
    machine.simulation = mbody.SimulationSettings(1.0, {"disc": {"vx": 2.0}})
    run = stepped(machine, 1.0, 1e-3, rtol=1e-12, instants=1001)
    # momentum about the place of contact is kept, whatever the steps
    assert run["disc"].vx[-1] == pytest.approx(4.0 / 3.0, rel=1e-9)
    assert run["disc"].omega[-1] * -RADIUS == pytest.approx(run["disc"].vx[-1], rel=1e-9)
    rolls = run.t[np.flatnonzero(np.array(run.mode("rim")) == "stick")[0]]
    # within a step, at instants one step apart
    assert rolls == pytest.approx(2.0 / (3 * 0.15 * G), abs=2e-3)
    late = run.energy.lost["rim"][run.t > rolls]
    assert np.ptp(late) < 1e-12
    assert late[-1] == pytest.approx(2.0 - 0.75 * (4.0 / 3.0) ** 2, rel=1e-9)


def test_a_disc_swings_in_a_ring():
    """Without friction as a pendulum of the length R − r; the ring carries weight and swing."""
    machine = mbody.Mechanism(
        "ring", ground={"O": (0, 0)}, ground_shapes={"bowl": {"ring": "O", "radius": 1.0}}
    )
    machine.add(
        disc("disc", -0.9 * math.sin(0.3), -0.9 * math.cos(0.3)),
        mbody.Gravity("gravity", y=-G),
        mbody.Contact("touch", "ground.bowl", "disc.rim"),
    )
    pendulum = mbody.Mechanism("pendulum", ground={"O": (0, 0)})
    pendulum.add(
        mbody.Body("bob", mass=1.0, cg=(0.0, -0.9), points={"O": (0, 0)}, guess=-0.3),
        mbody.Revolute("O", "ground.O", "bob.O"),
        mbody.Gravity("gravity", y=-G),
    )
    exact = mbody.simulate(pendulum, 2.0)
    errors, forces = [], []
    for step in (2e-3, 1e-3, 5e-4):
        run = stepped(machine, 2.0, step)
        errors.append(np.abs(run["disc"].x - exact["bob"].x).max())
        force = exact.reaction("O").magnitude[1:-1]
        forces.append(np.abs(run.contact("touch")[1:-1] / force - 1.0).max())
    # order one: each is half of the one before, but for what is of order two
    for found in (errors, forces):
        assert np.array(found[:-1]) / np.array(found[1:]) == pytest.approx(2.0, rel=1e-2)
    assert errors[0] < 2e-4
    assert forces[0] < 1e-3


def test_a_chain_falls_on_the_floor_and_comes_to_rest():
    run = stepped(chain(8), 3.0, 1e-3, rtol=1e-10)
    assert run.status == "completed"
    speeds = [abs(getattr(run[name], part)[-1]) for name in run for part in ("vx", "vy", "omega")]
    assert max(speeds) < 1e-9
    assert run.contact("floor")[-1] == pytest.approx(0.8 * G, rel=1e-9)
    # joints hold at every instant: they are projected onto their rows
    assert run.checks.constraint < 1e-12
    # what projections onto the joints change
    assert run.energy.error < 1e-3
    # all of the fall is lost: of level mass centres 0.5 m and more above the floor
    assert run.energy.lost["floor"][-1] > 0.8 * G * 0.5
    # the floor and the joints carry each link: its own balance at rest
    for n in range(8):
        fy = -0.1 * G + sum(
            run.reaction(f"j{k}", on=f"l{n}").fy[-1] for k in (n, n + 1) if 0 < k < 8
        )
        places = run.stepped.touching(len(run) - 1, "floor")
        fy += sum(
            force
            for name, force in zip(places.j, places.normal, strict=True)
            if name.startswith(f"l{n}.")
        )
        assert abs(fy) < 1e-8


# -- cost ------------------------------------------------------------------------------------------


def test_what_is_far_apart_is_not_looked_at():
    """Counted: ten times as many discs have at most 12 times as many pairs to look at."""
    pairs = [stepped(far_apart(n), 0.02, 2e-3, instants=2).stats["pairs"] for n in (100, 1000)]
    assert pairs[1] <= 12 * max(pairs[0], 1)
    # no disc has another one in the cells around it
    assert pairs[1] <= 10 * 1000


# -- results ---------------------------------------------------------------------------------------


def test_kept_instants_change_nothing():
    """Steps are those of the motion: what is kept lies on them, or on straight lines between."""
    few = stepped(pile(2, 0.1), 0.1, 1e-3, instants=3)
    many = stepped(pile(2, 0.1), 0.1, 1e-3, instants=778)
    assert (few["d2"].y[-1], few["d2"].x[1]) == (many["d2"].y[-1], many.at(0.05)["d2"].x[0])
    again = few.at([0.0123, 0.05])
    assert again["d2"].y[1] == few["d2"].y[1]
    assert again["d2"].y[0] < few["d2"].y[0]


def test_named_forces_are_those_of_the_places():
    machine = floored("box on a floor")
    machine.add(
        mbody.Body(
            "box",
            mass=2.0,
            inertia=0.02,
            points={"A": (-0.1, -0.05), "B": (0.1, -0.05), "C": (0.1, 0.05), "D": (-0.1, 0.05)},
            shapes={"box": {"polygon": ["A", "B", "C", "D"]}},
            guess=(0.0, 0.05, 0.0),
        ),
        mbody.Contact("under", "ground.floor", "box.box", friction=0.5),
        mbody.Force("push", "box.D", 4.0),
    )
    run = stepped(machine, 0.1, 1e-3, rtol=1e-12)
    found = run.reaction("under")
    assert found.on == "box"
    assert found.fx[-1] == pytest.approx(-4.0, rel=1e-9)
    assert found.fy[-1] == pytest.approx(2 * G, rel=1e-9)
    # the push at half the height above the mass centre is held by the ends of the lower edge
    assert found.torque[-1] == pytest.approx(4.0 * 0.05, rel=1e-9)
    places = run.stepped.touching(len(run) - 1, "under")
    assert sum(places.normal * places.x) == pytest.approx(4.0 * 0.1, rel=1e-9)
    assert run.reaction("under", on="ground").fy[-1] == pytest.approx(-2 * G, rel=1e-9)


def test_neighbours_in_a_chain_are_no_contacts():
    machine = chain(3, angle=0.0, height=1.0)
    machine.add(mbody.Between("links", "l*.A", "l*.B"))
    machine = chain(2, angle=0.0, height=1.0)
    bodies = [
        mbody.Body(
            f"s{n}",
            mass=0.1,
            inertia=1e-4,
            points={"A": (0.0, 0.0), "B": (0.1, 0.0)},
            shapes={"bar": {"segment": ["A", "B"]}},
            guess=(0.1 * n, 2.0, 0.0),
        )
        for n in range(3)
    ]
    machine.add(*bodies, mbody.Revolute("k1", "s0.B", "s1.A"), mbody.Revolute("k2", "s1.B", "s2.A"))
    machine.add(mbody.Between("bars", "s*.bar", "s*.bar"))
    run = stepped(machine, 0.05, 1e-3)
    assert run.contact("bars").max() == 0.0
    assert run.status == "completed"


def test_notes_say_order_step_overlap_and_residuals():
    run = stepped(bouncing(0.5), 1.0, 1e-2)
    said = " ".join(run.notes)
    for part in ("steps of 0.01 s", "order one", "sweeps a step", "overlap by at most", "dop853"):
        assert part in said
    assert run.checks.equilibrium < 1e-12


def test_too_long_steps_are_doubted():
    """A ball at 20 m/s comes 0.1 m far in a step: it is caught as deep as it is wide."""
    machine = bouncing(0.5)
    machine.simulation = mbody.SimulationSettings(1.0, {"ball": {"vy": -20.0}})
    run = stepped(machine, 0.5, 1e-2)
    assert "contact" in {doubt.kind for doubt in run.doubts}
    assert "take shorter steps" in run.status


def test_static_friction_holds_what_kinetic_would_not():
    """Pushed by 0.35 of its weight: held with static 0.4, sliding with 0.3 alone."""
    moved = []
    for static in (0.4, None):
        machine = floored("block")
        machine.add(
            mbody.Body("block", mass=1.0, inertia=1.0, points={"C": (0, 0)}),
            mbody.Contact("under", "ground.floor", "block.C", friction=0.3, static=static),
            mbody.Force("push", "block.C", 0.35 * G),
        )
        moved.append(stepped(machine, 0.5, 1e-3)["block"].x[-1])
    assert abs(moved[0]) < 1e-12
    assert moved[1] == pytest.approx(0.5 * 0.05 * G * 0.25, rel=1e-2)


def test_inputs_states_and_controllers_take_part():
    machine = floored("pushed block")
    machine.add(
        mbody.Body("block", mass=1.0, inertia=1.0, points={"C": (0, 0)}),
        mbody.Contact("under", "ground.floor", "block.C", friction=0.2),
        mbody.Input("u", "0 N"),
        mbody.State("way", rate="block.vx", start=0.0),
        mbody.Force("push", "block.C", "u"),
        mbody.Controller("pusher", lambda t, x: 4.0, every=0.01, reads=["block.x"], sets=["u"]),
    )
    run = stepped(machine, 0.5, 1e-3)
    assert run["block"].x[-1] == pytest.approx(0.5 * (4.0 - 0.2 * G) * 0.25, rel=5e-3)
    assert run.measure("way")[-1] == pytest.approx(run["block"].x[-1], rel=5e-3)


@pytest.mark.parametrize("friction", [0.45, 0.6, 1.0, 2.0, 3.0])
def test_a_pile_that_rests_stays_where_contacts_hold_it_more_than_once(friction):
    """Twelve contacts of six discs: 24 rows for 18 coordinates, ratios of Lemke's path are equal
    but for rounding. From μ = 0.434 on forces hold it (the gallery's note).
    """
    pile = mbody.gallery.load("pile_of_discs", {"mu": friction})
    run = mbody.simulate(pile, 0.05, method="dop853")
    assert run.status == "completed" and not run.events
    for name in ("a1", "a3", "b2", "c1"):
        disc = run[name]
        assert np.ptp(disc.x) < 1e-12 and np.ptp(disc.y) < 1e-12 and np.ptp(disc.angle) < 1e-12

"""What has no value, no inertia or no way on: sentences, and what is left alone."""

import numpy as np

import mbody
from mbody import gallery, makers
from mbody.analysis.driven.diagnosis import adjusted, branching, stuck, undetermined
from mbody.analysis.initial.initial_state import initial_state_of
from mbody.engineering import close_loops

G = 9.81


def instant(machine, start=None):
    """System, time, positions and rates of a start."""
    if start is None:
        own = machine.simulation
        start = initial_state_of(mbody.assemble(machine), own) if own else close_loops(machine)
    names = [body.name for body in machine.bodies]
    q = [part[-1] for n in names for part in (start[n].x, start[n].y, start[n].angle)]
    v = [part[-1] for n in names for part in (start[n].vx, start[n].vy, start[n].omega)]
    return mbody.assemble(machine), float(start.t[-1]), np.array(q), np.array(v)


def flag(*more, **own):
    """A swinging rod with a flag of 1 kg pinned at its mass centre."""
    machine = mbody.Mechanism("flag")
    machine.add(
        mbody.Body(
            "rod", mass=1.0, inertia=0.1, cg=(0.5, 0.0), points={"P": (1.0, 0.0)}, guess=0.2
        ),
        mbody.Body("flag", points={"E": (0.1, 0.0)}, **({"mass": 1.0} | own)),
        mbody.Revolute("O", "ground", "rod"),
        mbody.Revolute("P", "rod.P", "flag"),
        mbody.Gravity("gravity", y=-G),
        *more,
    )
    return machine


def test_what_nothing_turns_is_left_alone():
    """Points in the air and on pins are ordinary."""
    assert undetermined(*instant(flag())) is None
    assert undetermined(*instant(flag(mbody.Force("load", "flag", 2.0)))) is None
    assert undetermined(*instant(gallery.load("bouncing_ball"))) is None
    for name in gallery.names():
        machine = gallery.load(name)
        if machine.simulation:
            assert undetermined(*instant(machine)) is None, name


def test_a_singular_position_of_joints_alone_is_passed():
    """Windows with their posts level, no driver: nothing to complain of."""
    machine = gallery.load("n_windows_2")
    machine.simulation = mbody.SimulationSettings(
        1.0, {f"c{n}": {"angle": 0.0, "omega": 1.0} for n in range(3)}
    )
    assert stuck(*instant(machine)[:3]) is None


def test_a_start_at_rest_where_branches_meet():
    """Three level posts: each may fall by itself to first order, and their rates make them fall."""
    machine = gallery.load("n_windows_2")
    machine.simulation = mbody.SimulationSettings(1.0, {f"c{n}": {"angle": 0.0} for n in range(3)})
    (note,) = branching(*instant(machine))
    assert "3 motions are free there to first order, 1 nearby" in note
    moving = {f"c{n}": {"angle": 0.0, "omega": 1.0} for n in range(3)}
    machine.simulation = mbody.SimulationSettings(1.0, moving)
    assert branching(*instant(machine)) == ()
    machine.simulation = mbody.SimulationSettings(1.0, {f"c{n}": {"angle": 0.5} for n in range(3)})
    assert branching(*instant(machine)) == ()
    still = mbody.Mechanism("no load", ground=machine.ground.points)
    still.add(*machine.bodies, *machine.joints)
    still.simulation = mbody.SimulationSettings(1.0, {f"c{n}": {"angle": 0.0} for n in range(3)})
    assert branching(*instant(still)) == ()


def test_rates_that_are_rounding_are_not_told():
    """A vehicle at rest, released: its wheels turn by 1e-88 rad/s, then by less."""
    run = mbody.simulate(gallery.load("vehicle"), 0.5, release={"motion": 0.1})
    assert run.notes == ()
    system, _, q, v = instant(makers.four_bar(1.0, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)))
    before, after = np.concatenate([q, 0.0 * v + 1e-14]), np.concatenate([q, 0.0 * v])
    assert adjusted(system, before, after, 1.0) == ()
    (note,) = adjusted(system, before, after, 1e4)  # long enough for it to be more than rounding
    assert note.endswith("not 1e-14")


def test_a_start_that_is_changed_is_told():
    """Of a four-bar with a shorter crank: how far, and which rate."""
    short, longer = (
        makers.four_bar(crank, 3.0, 2.0, 3.5, masses=(1.0, 3.0, 2.0)) for crank in (1.0, 1.1)
    )
    given = mbody.kinematics(short, drive={"motor": (1.0, 2.0, 0.0)})
    system, _, *before = instant(short, given)
    before = np.concatenate(before)
    assert adjusted(system, before, before * (1.0 + 1e-9)) == ()
    turned = float(given["crank"].angle[-1]) + 0.05
    other = mbody.kinematics(longer, drive={"motor": (turned, 1.5, 0.0)})
    after = np.concatenate(instant(longer, other)[2:])
    (note,) = adjusted(system, before, after)
    assert "'crank' was turned by 2.86 deg" in note  # 0.05 rad
    assert "omega of 'crank' is 1.5 rad/s, not 2" in note and "was moved by " in note

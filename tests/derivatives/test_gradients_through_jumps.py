"""Gradients of motions whose loads jump by formulas, against complex steps of small equations of
motion of their own.
"""

from dataclasses import dataclass

import numpy as np
import pytest

import mbody
from mbody import (
    Body,
    CustomLoad,
    Force,
    Gravity,
    Mechanism,
    Prismatic,
    Revolute,
    SimulationSettings,
    Spring,
    Torque,
    TorsionDamper,
)
from tests.support.complex_events import derivatives, followed

RTOLS = (1e-8, 1e-10, 1e-12)
LAST = ["last(bob.angle)", "last(bob.omega)"]


def pendulum(kick, rtol=1e-9, until=2.0, **start):
    own = {"bob": {"angle": 0.3, "omega": 1.0} | start}
    machine = Mechanism(
        "pendulum",
        parameters={"a": "0.2 rad", "b": "0.2 rad", "t0": "0.7 s", "k": "3 N*m"},
        simulation=SimulationSettings(until, own, rtol=rtol, instants=3),
        curves={"held": mbody.laws.Table([-9.0, 0.0, 9.0], [1.0, 2.0, 2.0], interpolation="hold")},
    )
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0), guess=0.3),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
        TorsionDamper("damper", "bob", coefficient=0.2),
        Torque("kick", "bob", value=kick),
    )
    return machine


def swung(torques, starts, numbers):
    """A pendulum pushed by one torque after the other: {mode: (torque of y, {next: event of y})};
    the numbers begin with the mass. The state is angle, rate, time.
    """
    whole = 0.2 + numbers[0] * 0.49

    def rates(torque):
        def found(y):
            drive = torque(y) - numbers[0] * 9.81 * 0.7 * np.cos(y[0]) - 0.2 * y[1]
            return np.array([y[1], drive / whole, 1.0 + 0.0 * y[1]])

        return found

    modes = {
        mode: (rates(torque), {other: (event, lambda y: y) for other, event in events.items()})
        for mode, (torque, events) in torques.items()
    }
    y, times = followed(modes, starts, [0.3, 1.0, 0.0], 2.0)
    return y[:2], times


def by_angle(numbers):
    """Pushed to either side of the angle −a."""
    _, a, k = numbers
    return swung(
        {
            "up": (lambda y: k, {"down": lambda y: y[0] + a}),
            "down": (lambda y: -k, {"up": lambda y: -y[0] - a}),
        },
        "up",
        numbers,
    )


def by_time(numbers):
    """Pushed from a time on."""
    _, t0, k = numbers
    off = (lambda y: 0.0 * y[0], {"on": lambda y: t0 - y[2]})
    return swung({"off": off, "on": (lambda y: k, {})}, "off", numbers)


def by_rate(numbers):
    """Dry friction, whose direction changes with the rate."""
    _, c = numbers
    return swung(
        {
            "ahead": (lambda y: -c, {"back": lambda y: y[1]}),
            "back": (lambda y: c, {"ahead": lambda y: -y[1]}),
        },
        "ahead",
        numbers,
    )


def by_product(numbers):
    """Two jumps in one formula, pushed to either side by other torques, from a time on."""
    _, a, t0 = numbers

    def pushed(sign):
        return lambda y: 2.0 * sign + 5.0 * sign * y[0]

    def passed(sign):
        return lambda y: sign * (y[0] + a)

    modes = {}
    for mode, other, sign in (("up", "low", 1.0), ("low", "up", -1.0)):
        change = passed(sign)
        begins = {f"{other} off": change, f"{mode} on": lambda y: t0 - y[2]}
        modes[f"{mode} off"] = (lambda y: 0.0 * y[0], begins)
        modes[f"{mode} on"] = (pushed(sign), {f"{other} on": change})
    return swung(modes, "up off", numbers)


JUMPS = {
    "k*sign(bob.angle + a)": (by_angle, ["bob.mass", "a", "k"], [1.3, 0.2, 3.0]),
    "k*step(t - t0)": (by_time, ["bob.mass", "t0", "k"], [1.3, 0.7, 3.0]),
    "-0.5 N*m*sign(bob.omega)": (by_rate, ["bob.mass"], [1.3, 0.5]),
    "(2 N*m*sign(bob.angle + a) + 5 N*m*sign(bob.angle + a)*bob.angle/(1 rad))*step(t - t0)": (
        by_product,
        ["bob.mass", "a", "t0"],
        [1.3, 0.2, 0.7],
    ),
}


@pytest.mark.parametrize("kick", JUMPS)
def test_jumps_of_formulas(kick):
    """1e-8 at rtol 1e-12, and in proportion to rtol."""
    run, names, numbers = JUMPS[kick]
    exact, times = derivatives(run, numbers)
    exact, found = exact[:, : len(names)], []
    assert len(times)  # it jumps on the way
    for rtol in RTOLS:
        g = mbody.gradient(pendulum(kick, rtol), LAST, names, analysis="simulate")
        assert not g.notes
        found.append(float((np.abs(g.jacobian - exact) / np.abs(exact).max(axis=0)).max()))
    # errors of some ten steps add up, and jumps are located as exactly as the motion is
    assert found[0] < 1e-5 and found[1] < 1e-7 and found[2] < 1e-8, found
    assert found[2] < 1e-2 * found[0], found


def slide(rtol, law="40 N/m*x + 5 N*step(x - x0)"):
    start = {"slide": {"x": 0.3, "vx": 0.0}}
    machine = Mechanism(
        "slide",
        ground={"W": (-1.0, 0.0)},
        parameters={"x0": "0.1 m"},
        simulation=SimulationSettings(2.0, start, rtol=rtol, instants=3),
    )
    machine.add(
        Body("slide", mass=2.0, inertia=1.0),
        Prismatic("guide", "ground", "slide"),
        Spring("spring", "ground.W", "slide", law=law, free_length=1.0),
    )
    return machine


def test_a_spring_whose_law_jumps():
    """A law of the stretch, by the place of its jump and by the free length."""

    def sprung(numbers):
        m, x0, free = numbers

        def rates(more):
            return lambda y: np.array([y[1], -(40.0 * (y[0] + 1.0 - free) + more) / m])

        def reached(y):
            return y[0] + 1.0 - free - x0

        near = (rates(0.0), {"far": (lambda y: -reached(y), lambda y: y)})
        far = (rates(5.0), {"near": (reached, lambda y: y)})
        return followed({"near": near, "far": far}, "far", [0.3, 0.0], 2.0)

    exact, times = derivatives(sprung, [2.0, 0.1, 1.0])
    assert len(times) > 2
    names = ["slide.mass", "x0", "spring.free_length"]
    g = mbody.gradient(slide(1e-12), ["last(slide.x)", "last(slide.vx)"], names, "simulate")
    np.testing.assert_allclose(g.jacobian, exact, rtol=1e-8, atol=1e-8 * np.abs(exact).max())
    assert not g.notes


def test_jumps_between_impacts():
    """A ball that is pushed above a height, which bounces: in closed form, two impacts."""
    machine = mbody.gallery.load("bouncing_ball")
    mass = float(mbody.assemble(machine).values["ball.mass"])
    start = {"ball": {"y": 1.03}}
    machine.simulation = SimulationSettings(1.5, start, rtol=1e-12, instants=3)
    machine.add(Force("push", "ball", f"{2.0 * mass} N*step(ball.y - 0.5 m)", angle="-90 deg"))

    def bounced(numbers):
        e, g = numbers

        def rates(more):
            return lambda y: np.array([y[1], -(g + more) + 0.0 * y[1]])

        strike = {"below": (lambda y: y[0] - 0.03, lambda y: np.array([y[0], -e * y[1]]))}
        above = (rates(2.0), {"under": (lambda y: y[0] - 0.5, lambda y: y)})
        rises = {"above": (lambda y: 0.5 - y[0], lambda y: y)}
        modes = {"above": above, "under": (rates(0.0), strike | rises)}
        modes["below"] = (rates(0.0), strike | rises)
        return followed(modes, "above", [1.03, 0.0], 1.5)

    exact, times = derivatives(bounced, [0.8, 9.81])
    assert len(times) >= 4
    measures = ["last(ball.y)", "last(ball.vy)"]
    g = mbody.gradient(machine, measures, ["e", "gravity.y"], "simulate")
    np.testing.assert_allclose(g.jacobian, exact * [1.0, -1.0], rtol=1e-8)
    assert not g.notes


def test_where_there_is_none():
    """At a jump from the beginning on, where two fall together that move apart, and where jumps are
    not followed; by other numbers there is one.
    """

    def found(kick, names, **start):
        return mbody.gradient(pendulum(kick, until=1.0, **start), LAST, names, "simulate")

    names = ["bob.mass", "start.bob.angle", "start.bob.omega"]
    g = found("k*sign(bob.angle)", names, angle=0.0)
    assert np.isnan(g.jacobian[0]).tolist() == [False, True, False]
    assert "begins there where a formula jumps" in g.notes[0]
    g = found("k*step(bob.angle - a) + k*step(bob.angle - b)", ["bob.mass", "a", "b"])
    assert np.isnan(g.jacobian[0]).tolist() == [False, True, True]
    assert "two changes fall together" in g.notes[0]
    g = found("k*held(bob.angle)", ["bob.mass"])
    assert np.isnan(g.jacobian).all() and "the curve 'held' jumps" in g.notes[0]


def test_an_input_that_jumps():
    """At a time of its own, which only its own numbers move."""
    settings = SimulationSettings(1.0, {"bob": {"angle": 0.3, "omega": 1.0}}, instants=3)
    machine = Mechanism("pendulum", parameters={"t0": "0.4 s"}, simulation=settings)
    machine.add(
        mbody.Input("u", "2*step(t - t0)"),
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0), guess=0.3),
        Revolute("O", "ground", "bob"),
        Torque("kick", "bob", value="3 N*m*u"),
    )
    g = mbody.gradient(machine, "last(bob.omega)", ["bob.inertia", "t0"], "simulate")
    whole = 0.2 + 1.3 * 0.49
    exact = -6.0 * (1.0 - 0.4) / whole**2
    # the jump is met with steps as short as rtol wants
    assert g["last(bob.omega)"]["bob.inertia"] == pytest.approx(exact, rel=1e-6)
    assert np.isnan(g["last(bob.omega)"]["t0"])
    assert any("by 't0': 'u' jumps" in note for note in g.notes)


@dataclass(frozen=True)
class Pushed(CustomLoad):
    """A torque of the user's own, which jumps at an angle or does not."""

    jumps: bool = True

    def physics(self, i, j, p, t):
        """To either side of −0.2 rad, or as a spring."""
        more = np.sign(j[2] + 0.2) if self.jumps else -(j[2] + 0.2)
        return 0.0, 0.0, 0.0, 0.0, 0.0, 3.0 * more


@pytest.mark.parametrize("jumps", [True, False])
def test_functions_of_users_are_compared_with_differences(jumps):
    machine = Mechanism(
        "pendulum",
        simulation=SimulationSettings(
            2.0, {"bob": {"angle": 0.3, "omega": 1.0}}, rtol=1e-9, instants=3
        ),
    )
    machine.add(
        Body("bob", mass=1.3, inertia=0.2, cg=(0.7, 0.0), guess=0.3),
        Revolute("O", "ground", "bob"),
        Gravity("gravity", y=-9.81),
        Pushed("own", "ground", "bob", jumps=jumps),
    )
    g = mbody.gradient(machine, "last(bob.angle)", ["bob.mass", "gravity.y"], "simulate")
    assert np.isnan(g.jacobian).all() == jumps
    assert any("'own' jump on the way" in note for note in g.notes) == jumps

"""Drivers that follow formulas of inputs, auxiliary states and positions."""

import mbody
from mbody.laws import Table, Table2


def arms(law, *before, more=(), **options):
    """Two arms on the ground; the first turns by a law, the second by another."""
    machine = mbody.Mechanism("arms", ground={"A": (0.0, 0.0), "B": (2.0, 0.0)}, **options)
    for name, pin in (("first", "A"), ("second", "B")):
        machine.add(
            mbody.Body(name, mass=1.0, inertia=0.1, cg=(0.2, 0.0), points={"P": (0.5, 0.0)})
        )
        machine.add(mbody.Revolute(pin, f"ground.{pin}", name))
    machine.add(*before)
    machine.add(mbody.AngleDriver("lead", "first", "0.3 rad + 1 rad/s*t"))
    machine.add(mbody.AngleDriver("follow", "second", law), *more)
    return machine


def held(rate):
    """A driver of an input that holds its values, through states."""
    signal = mbody.Input("u", Table([0.0, 1.0], ["0 rad", "1 rad"], interpolation="hold"))
    return lambda: mbody.assemble(arms(rate, signal))


def controlled():
    u = mbody.Input("u", "0 rad")
    set_u = mbody.Controller("pid", lambda t, a: a, every=0.1, reads=["first.angle"], sets=["u"])
    return mbody.assemble(arms("u", u, more=[set_u]))


def set_in_a_simulator():
    sim = mbody.Simulator(mbody.assemble(arms("u + 0.1 rad", mbody.Input("u", "0 rad"))))
    sim.inputs["u"] = 0.2


def set_in_many():
    sims = mbody.Simulators(mbody.assemble(arms("u + 0.1 rad", mbody.Input("u", "0 rad"))), 4)
    sims.inputs["u"] = 0.2


def surface():
    map_ = Table2([0.0, 1.0], [0.0, 1.0], [[0.0, 0.1], [0.2, 0.4]])
    return mbody.assemble(arms("1 rad*map(first.angle/(1 rad), 0.5)", curves={"map": map_}))


def followed_matrices():
    machine = mbody.Mechanism("free", ground={"A": (0.0, 0.0)})
    machine.add(
        mbody.Body("first", mass=1.0, inertia=0.1, points={"P": (0.5, 0.0)}),
        mbody.Body("second", mass=1.0, inertia=0.1, cg=(0.2, 0.0)),
        mbody.Revolute("A", "ground.A", "first"),
        mbody.Revolute("B", "first.P", "second"),
        mbody.Input("u", "0 rad"),
        mbody.Gravity("g"),
        mbody.AngleDriver("servo", "first", "u - 90 deg"),
    )
    return mbody.Simulator(machine).state_matrices("second.angle")


def matrices_of_a_peak():
    return mbody.Simulator(mbody.gallery.load("simple_pendulum")).state_matrices(
        "peak(pendulum.angle)"
    )


SCENARIOS = {
    "matrices of one number of all instants": matrices_of_a_peak,
    "a driver that follows a state of a rate": lambda: mbody.assemble(
        arms("z", mbody.State("z", rate="first.omega", start="0 rad"))
    ),
    "a driver that follows what jumps": lambda: mbody.assemble(arms("1 rad*step(first.P.y/(1 m))")),
    "a driver by a table of two variables": surface,
    "a driver of an input that holds": held("u"),
    "a driver of an input that a controller sets": controlled,
    "an input that a driver follows, set": set_in_a_simulator,
    "an input that drivers follow, set in many": set_in_many,
    "kinematics of a driver of a state": lambda: mbody.kinematics(
        arms("z", mbody.State("z", rate="1 rad/s*cos(1 rad/s*t)", start="0 rad")), t=[0.0, 1.0]
    ),
    "the value of a driver that follows": lambda: mbody.kinematics(
        arms("2*first.angle"), drive={"follow": 0.3}
    ),
    "values where a driver follows time too": lambda: mbody.kinematics(
        arms("2*first.angle + 1 rad/s*t"), drive={"lead": 0.3}
    ),
    "a law of time of a driver that follows": lambda: (
        lambda system: system.law_of(system.drivers[1])
    )(mbody.assemble(arms("2*first.angle"))),
    "B where a driver follows an input": followed_matrices,
    "releasing a driver that another follows": lambda: mbody.simulate(
        arms("2*lead.value"), 1.0, release={"lead": 0.5}
    ),
    "releasing a driver that an event reads": lambda: mbody.simulate(
        arms("0.5"), 1.0, release={"lead": 0.5}, events=[mbody.Event("lead.effort", name="jolt")]
    ),
}

SENTENCES = r"""
matrices of one number of all instants | ModelError | - | measure 'peak(pendulum.angle)' is one number of all instants: give what changes from instant to instant, 'pendulum.angle'
a driver that follows a state of a rate | ModelError | follow | 'follow': law is 'z', which follows a state whose rate measures rates of bodies: a driver prescribes a position, and this would prescribe how positions change, which no position fulfils (a nonholonomic constraint). Follow positions, or use a Torque or a Force whose formula measures the rate
a driver that follows what jumps | ModelError | follow | 'follow': law is '1 rad*step(first.P.y/(1 m))', which jumps at 'step': its driver needs the rate and the acceleration of what it follows; use smooth functions such as sin or atan
a driver by a table of two variables | ModelError | follow | 'follow': law is '1 rad*map(first.angle/(1 rad), 0.5)', which calls a table of two variables, which has no second derivative: its driver needs the rate and the acceleration of what it follows; call Tables of one variable, or write a formula
a driver of an input that holds | ModelError | follow | 'follow': law is 'u', but the input 'u' has a history that holds its values, so that the driven position or its rate would jump, which takes an infinite effort: lead it through states, as State("speed", rate=...) and State("angle", rate="speed"), or give a smooth history
a driver of an input that a controller sets | ModelError | follow | 'follow': law is 'u', but the input 'u' is set by the controller 'pid', so that the driven position or its rate would jump, which takes an infinite effort: lead it through states, as State("speed", rate=...) and State("angle", rate="speed"), or give a smooth history
an input that a driver follows, set | ModelError | u | the input 'u' cannot be set: the position or the rate of driver 'follow' follows it and would jump, which takes an infinite effort. Give it a smooth history, or lead it through states: State("speed", rate="acceleration") and State("angle", rate="speed"), of which the driver follows the angle
an input that drivers follow, set in many | ModelError | u | the input 'u' cannot be set: the position or the rate of driver 'follow' follows it and would jump, which takes an infinite effort. Give it a smooth history, or lead it through states: State("speed", rate="acceleration") and State("angle", rate="speed"), of which the driver follows the angle
kinematics of a driver of a state | ModelError | follow | 'follow' follows the state 'z', which is integrated with the motion: use simulate, or let it follow a formula of t
the value of a driver that follows | ModelError | follow | driver 'follow' follows positions, by its law: give values of the drivers that lead ('lead')
values where a driver follows time too | ModelError | follow | driver 'follow' follows positions and time: values of the other drivers do not say where it is; give times t
a law of time of a driver that follows | ModelError | follow | 'follow' follows positions, '2*first.angle', which time alone does not give: give times, or values of the drivers that follow time
B where a driver follows an input | ModelError | u | the input 'u' is followed by driver 'servo': the motion depends on its rate and its acceleration too, so that B and D do not describe it; make it a parameter, or let the driver follow states whose rates have the input
releasing a driver that another follows | ModelError | follow | driver 'lead' cannot be released, 'follow' measures it: measure the body that it drives, or a joint
releasing a driver that an event reads | ModelError | jolt | driver 'lead' cannot be released, event 'jolt' reads 'lead.effort': read the body that it drives, or a joint
"""

"""Images of mechanisms with formulas of measured quantities, inputs and auxiliary states."""

import numpy as np

import mbody
from mbody.image.model_image import to_image
from mbody.laws import ConstantSpeed, Table
from tests.support import embedded
from tests.support.embedded import ADVANCE, GOOD, REFUSED, Model

pytestmark = embedded.needs_core
if not embedded.needs_core.args[0]:
    from tests.support.image_loader import DONE, Loaded

#: Of quantities of a motion at 1e-12, beside their greatest values.
NEAR = 1e-9


def arm(*more, level="steady"):
    """Two bars in a row, with a formula in every kind of load."""
    made = mbody.Mechanism("arm", ground={"C": (0.5, 0.8)}, parameters={"k": 20.0})
    made.add(
        mbody.Body(
            "first", mass=2.0, inertia=0.1, cg=(0.5, 0.1), points={"A": (1.0, 0.0)}, guess=0.4
        ),
        mbody.Body(
            "second", mass=1.0, inertia=0.05, cg=(0.3, 0.0), points={"P": (0.7, 0.2)}, guess=1.1
        ),
        mbody.Revolute("O", "ground", "first"),
        mbody.Revolute("A", "first.A", "second"),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Input("u", 0.5),
        mbody.Input("wave", "2*sin(3*t)"),
        mbody.State("lag", rate="5*(first.angle - lag)", start="0.2 rad"),
        mbody.State("level", rate="3*(u - level) + A.rate", start=level),
        mbody.Quantity("drag", "0.2*first.A.vx"),
        *more,
        mbody.Spring(
            "spring", "ground.C", "second.P", law="k*x + 0.3*x^3 + first.omega", free_length=0.2
        ),
        mbody.Damper("damper", "second.P", "ground.C", law="2.5*x*(1 + 0.1*second.y^2)"),
        mbody.TorsionSpring("coil", "second", "first", law="4*x + 0.1*lag"),
        mbody.Force(
            "push", "second.P", "u*cos(first.angle) - spring.length + ground.C.y", angle=0.7
        ),
        mbody.Torque("load", "first", value="wave - drag"),
    )
    return made


def moving(level="steady"):
    made = arm(level=level)
    made.simulation = mbody.SimulationSettings(1.0, rtol=1e-12, instants=21)
    return made


def unlike(measured, run, names):
    found = 0.0
    for name in names:
        wanted = run.measure(name)
        found = max(found, np.abs(measured[name] - wanted).max() / max(1.0, np.abs(wanted).max()))
    return found


NAMES = ["spring.force", "damper.force", "coil.torque", "push.fx", "load.torque", "O.force"]
NAMES += ["u", "wave", "lag", "level"]


def test_a_free_motion_has_formulas_inputs_and_states():
    made = to_image(moving(), analyses=("free",))
    image = Loaded(made.content)
    assert made.manifest["inputs"] == ["u"] and made.manifest["states"] == ["lag", "level"]
    assert image.run() == DONE and not made.notes
    assert unlike(image.output("run")[1], mbody.simulate(moving()), NAMES) < NEAR


def test_numbers_of_formulas_can_be_changed():
    image, new = Loaded(to_image(moving()).content), {"k": 25.0, "u.value": 1.5, "second.P.y": 0.25}
    assert image.set(new, "free") == -1 and image.run() == DONE
    # the steady start is that of the export
    changed = mbody.assemble(moving(float(image["start.own"][1]))).with_values(new)
    assert unlike(image.output("run")[1], mbody.simulate(changed), NAMES) < NEAR


def test_a_driven_motion_has_formulas_and_inputs():
    machine = arm(
        mbody.AngleDriver("shoulder", "first", ConstantSpeed(0.4, 1.0)),
        mbody.AngleDriver("elbow", "second", "0.7 + 0.3*sin(2*t)", relative_to="first"),
    )
    image = Loaded(to_image(machine, 11).content)
    assert image.set({"u.value": 2.0}, "driven") == -1 and image.call("turn") == 0
    t = image["turn.t"].copy()
    run = mbody.kinetostatics(mbody.assemble(machine).with_values({"u.value": 2.0}), t)
    assert unlike(image.output("turn")[1], run, [*NAMES, "shoulder.effort"]) < NEAR


def following():
    """Two bars of which the second follows the first, an input and a state."""
    return arm(
        mbody.Input("shift", "0.1 rad"),
        mbody.State("speed", rate="1 - speed", start=0.0),
        mbody.State("way", rate="speed", start=0.0),
        mbody.AngleDriver("elbow", "second", "0.7 + shift + 0.3*sin(first.angle) + 0.1*way"),
        level=0.3,
    )


def test_drivers_that_follow_positions_states_and_inputs():
    """The input that a driver follows cannot be set while it moves; it is a number of the model."""
    machine = following()
    machine.simulation = mbody.SimulationSettings(1.0, rtol=1e-12, instants=21)
    made = to_image(machine, analyses=("free",))
    assert made.manifest["inputs"] == ["u"]
    assert "shift.value" in [one["name"] for one in made.manifest["numbers"]]
    image = Loaded(made.content)
    assert image.run() == DONE
    run = mbody.simulate(machine)
    names = [*NAMES, "elbow.value", "elbow.effort", "second.alpha"]
    assert unlike(image.output("run")[1], run, names) < NEAR
    driven = arm(
        mbody.AngleDriver("shoulder", "first", ConstantSpeed(0.4, 1.0)),
        mbody.AngleDriver("elbow", "second", "0.7 + 0.3*sin(first.angle) + 0.1*first.A.x*sin(2*t)"),
    )
    image = Loaded(to_image(driven, 11).content)
    assert image.call("turn") == 0
    run = mbody.kinetostatics(driven, image["turn.t"].copy())
    found = image.output("turn")[1]
    assert unlike(found, run, ["shoulder.effort", "elbow.effort", "O.force"]) < NEAR


def test_an_input_that_changes_goes_on_with_the_motion(tmp_path):
    """As with a table that holds its values; steps end at its instants, too."""
    t = np.linspace(0.0, 1.0, 21)
    u = np.cos(4.0 * t)
    history = Table(t, u, interpolation="hold", outside="hold")
    machine = moving(0.5)
    run = mbody.simulate(machine, 1.0, times=t, inputs={"u": history}, rtol=1e-12)
    model = Model(embedded.door(tmp_path), to_image(machine).content)
    place, entry = model.find_input(b"u"), model.find_measure(b"first.omega")
    lag = model.find_state(b"lag")
    assert model.numbers("motion.relative")[:] == [1e-12]
    assert model.set_input(place, u[0]) == GOOD and model.start(0.0, 1.0) == GOOD
    found = [(model.measure(ADVANCE, 0, entry), model.measure(ADVANCE, 0, lag))]
    for k in range(20):
        assert model.set_input(place, u[k]) == GOOD and model.number(place) == u[k]
        assert model.advance(t[k + 1]) == GOOD
        found.append((model.measure(ADVANCE, 0, entry), model.measure(ADVANCE, 0, lag)))
    own = np.stack([run["first"].omega, run.measure("lag")], axis=1)
    assert np.abs(np.array(found) - own).max() < 1e-11 * np.abs(own).max()
    # what the input is now is in the forces before the next step
    push = model.find_measure(b"push.force")
    before = model.measure(ADVANCE, 0, push)
    assert model.set_input(place, 3.0) == GOOD and model.advance(1.0) == GOOD
    assert model.measure(ADVANCE, 0, push) > before


def test_what_is_no_input_and_no_number_is_refused(tmp_path):
    model = Model(embedded.door(tmp_path), to_image(moving()).content)
    place, lag = model.find_input(b"u"), model.find_state(b"lag")
    assert model.find_input(b"wave") == -1 and model.find_state(b"u") == -1
    assert model.set_input(lag, 1.0) == REFUSED and "is no input" in model.sentence
    assert model.set_start(place, 1.0) == REFUSED and "is no state" in model.sentence
    assert model.set_input(place, np.nan) == REFUSED and "the input u" in model.sentence
    assert model.set_start(lag, np.inf) == REFUSED and "the state lag" in model.sentence
    assert model.number(place) == 0.5 and model.number(lag) == 0.2
    assert model.set_start(lag, 0.7) == GOOD and model.start(0.0, 1.0) == GOOD
    assert model.measure(ADVANCE, 0, lag) == 0.7

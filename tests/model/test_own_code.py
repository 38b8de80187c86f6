"""Elements of the user's own: their numbers are in force, and what they get wrong is said."""

import math
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

import mbody
from mbody.laws import Function, Polynomial
from mbody.model.element import law_field
from mbody.model.joints import CustomJoint
from mbody.model.loads import CustomLoad
from mbody.testing import check_joint, check_load
from tests.errors.own_code import Loose, LooseChange, LooseRates, LooseTimes, Remembers

VALUES = [1.0, 3.0, 5.0]
RAMP = "0.3 rad + 1 rad/s * t"


@dataclass(frozen=True)
class Own(CustomLoad):
    """A torsion spring by hand."""

    k: float = mbody.number_field("torsion stiffness", 3.0)

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 0.0, 0.0, -self.k * j[2]


@dataclass(frozen=True)
class Derived(CustomLoad):
    """One whose physics reads what was made of its numbers when it was made."""

    k: float = mbody.number_field("torsion stiffness", 3.0)

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "twice", 2.0 * self.k if isinstance(self.k, float) else None)

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 0.0, 0.0, -0.5 * self.twice * j[2]


@dataclass(frozen=True)
class ByLaw(CustomLoad):
    """One that has a law of its own."""

    torque: object = law_field("torque", 0.0, of="angle")

    def physics(self, i, j, p, t):
        return 0.0, 0.0, 0.0, 0.0, 0.0, -self.torque(j[2])


@dataclass(frozen=True)
class Arm(CustomJoint):
    """A pin on the ground at a distance from the mass centre of j along its x axis."""

    length: float = mbody.number_field("length", 1.0)
    rows = "ll"

    def physics(self, i, j, p, t):
        x, y = -self.length * j[3], -self.length * j[4]
        w = j[7] ** 2
        phi = j[0] + x, j[1] + y
        return phi, (0, 0, 0, 0, 0, 0, 1, 0, -y, 0, 1, x), (0, 0), (w * x, w * y)


def bob(*more, joint=None):
    machine = mbody.Mechanism("bob")
    machine.add(
        mbody.Body("bob", mass=1.0, inertia=0.2, cg=(1.0, 0.0), guess=0.4),
        joint or mbody.Revolute("O", "ground", "bob"),
        mbody.Gravity("gravity", y=-9.81),
        *more,
    )
    return machine


OWN = {
    "number": (Own("own", "ground", "bob"), "own.k"),
    "derived": (Derived("own", "ground", "bob"), "own.k"),
    "law": (ByLaw("own", "ground", "bob", torque=Polynomial((0.0, 3.0))), "own.torque.c1"),
}


@pytest.mark.parametrize("kind", OWN)
def test_physics_reads_the_number_in_force(kind):
    """Against the built-in torsion spring: alone, in a batch, in a sweep, after pickling."""
    load, name = OWN[kind]
    system = mbody.assemble(bob(load, mbody.AngleDriver("motor", "bob", RAMP)))
    t = [0.0, 0.5, 1.0]
    wanted = [
        mbody.kinetostatics(
            bob(
                mbody.TorsionSpring("s", "bob", stiffness=k),
                mbody.AngleDriver("motor", "bob", RAMP),
            ),
            t=t,
        ).effort("motor")
        for k in VALUES
    ]
    batch = system.with_values({name: VALUES})
    for design, k in enumerate(VALUES):
        for given in (system.with_values({name: k}), batch.design(design)):
            found = mbody.kinetostatics(pickle.loads(pickle.dumps(given)), t=t).effort("motor")
            np.testing.assert_allclose(found, wanted[design], rtol=1e-13)
    np.testing.assert_allclose(mbody.kinetostatics(batch, t=t).effort("motor"), wanted, rtol=1e-13)
    swept = mbody.sweep(system, {name: VALUES}, measure="first(motor.effort)", t=t)
    np.testing.assert_allclose(swept["first(motor.effort)"], [w[0] for w in wanted], rtol=1e-13)
    assert load.numbers()[name] == 3.0  # the description is as it was


def test_free_motion_with_the_number_in_force():
    system = mbody.assemble(bob(Own("own", "ground", "bob")))
    for k in VALUES:
        own = mbody.simulate(system.with_values({"own.k": k}), 0.5)
        built_in = mbody.simulate(bob(mbody.TorsionSpring("s", "bob", stiffness=k)), 0.5)
        # of the same slopes but for rounding
        assert own["bob"].angle[-1] == pytest.approx(built_in["bob"].angle[-1], rel=1e-12)


def test_a_parameter_of_the_mechanism_reaches_physics():
    machine = mbody.Mechanism("bob", parameters={"stiff": "3 N*m/rad"})
    machine.add(*bob(), Own("own", "ground", "bob", k="2*stiff"))
    system = mbody.assemble(machine)
    own = mbody.simulate(system.with_values(stiff=4.0), 0.5)
    built_in = mbody.simulate(bob(mbody.TorsionSpring("s", "bob", stiffness=8.0)), 0.5)
    assert own["bob"].angle[-1] == pytest.approx(built_in["bob"].angle[-1], rel=1e-12)


def test_the_oracle_reads_it_too():
    system = mbody.assemble(
        bob(Own("own", "ground", "bob", k=5.0), mbody.AngleDriver("motor", "bob", 0.3))
    )
    assert mbody.crosscheck(system, ["oracle"]).agrees
    # it reads the description: of other numbers nothing was compared
    changed = mbody.crosscheck(system.with_values({"own.k": 6.0}), ["oracle"])
    assert changed.agrees is None and "own" in changed.not_compared


def test_number_field_is_public_and_a_plain_field_is_refused_with_the_way_out():
    assert mbody.number_field is mbody.number_field

    @dataclass(frozen=True)
    class Plain(CustomLoad):
        k: float = 3.0

    system = mbody.assemble(bob(Plain("own", "ground", "bob")))
    with pytest.raises(mbody.ModelError, match=r"'own.k' cannot be changed.*mbody\.number_field"):
        system.with_values({"own.k": 2.0})


# -- what is wrong is said ------------------------------------------------------------------------


class Filtered(CustomLoad):
    """A low-pass filter of the rate: harmless twice at one time, wrong wherever time goes back."""

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "kept", [0.0, 0.0])

    def physics(self, i, j, p, t):
        last, value = self.kept
        value += (j[7] - value) * min(1.0, abs(t - last) / 0.1)
        self.kept[:] = t, value
        return 0.0, 0.0, 0.0, 0.0, 0.0, -value


def remembering_law():
    seen = []

    def law(t):
        seen.append(t)
        return float(len(seen))

    return Function(law)


@pytest.mark.parametrize(
    "load",
    [
        Remembers("own", "ground", "bob"),
        Filtered("own", "ground", "bob"),
        mbody.Torque("own", "bob", value=remembering_law()),
        mbody.TorsionSpring("own", "bob", law=remembering_law()),
    ],
    ids=["counter", "filter", "law of time", "law of an angle"],
)
def test_a_load_that_remembers_is_refused(load):
    with pytest.raises(mbody.ModelError, match="'own' keeps a memory"):
        mbody.simulate(bob(load), 0.2)


@pytest.mark.parametrize("kind", [LooseRates, LooseTimes, LooseChange])
def test_a_joint_with_a_wrong_derivative_is_refused(kind):
    wrong = kind.wrong
    with pytest.raises(mbody.ModelError, match=f"physics of 'O' gives {wrong} of row"):
        mbody.simulate(bob(joint=kind("O", "ground", "bob")), 0.2)
    with pytest.raises(mbody.ModelError, match=f"physics of 'O' gives {wrong} of row"):
        mbody.kinetostatics(
            bob(mbody.AngleDriver("d", "bob", 0.3), joint=kind("O", "ground", "bob"))
        )


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("guess", [0.0, 0.5 * math.pi, 2.0])
def test_a_right_joint_passes_at_every_size(size, guess):
    machine = mbody.Mechanism("right")
    machine.add(
        mbody.Body("bob", mass=1.0, inertia=0.2 * size**2, cg=(size, 0.0), guess=guess),
        Loose("O", "ground", "bob"),
    )
    assert mbody.simulate(machine, 0.01).status == "completed"


# -- units ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mistaken(CustomLoad):
    """A spring that declares its stiffness as a force."""

    k: float = mbody.number_field("force", 3.0)

    def physics(self, i, j, p, t):
        x, y = self.k * (j[0] - i[0]), self.k * (j[1] - i[1])
        return x, y, 0.0, -x, -y, 0.0


@dataclass(frozen=True)
class MistakenJoint(Arm):
    """An arm whose length is declared as an angle."""

    length: float = mbody.number_field("angle", 1.0)


def test_check_load_holds_numbers_against_their_dimension():
    with pytest.raises(AssertionError, match=r"units: in other units of length, mass and time"):
        check_load(Mistaken("m", "a", "b"))
    with pytest.raises(AssertionError, match=r"units|world|description"):
        check_joint(MistakenJoint("m", "ground", "b"))
    for element in (
        mbody.Spring("s", "a.A", "b.B", stiffness=2.0, free_length=0.3),
        mbody.TorsionSpring("t", "b", stiffness=1.0),
    ):
        assert check_load(element)["units"].error < 1e-12

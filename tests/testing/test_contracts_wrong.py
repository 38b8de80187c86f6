"""Wrong joints and loads are caught, with the right sentence."""

import importlib
import math
from dataclasses import dataclass

import pytest

from mbody import Damper, Revolute
from mbody.kernels.layout import PER_PRIMITIVE
from mbody.laws import Polynomial
from mbody.model.joints import CustomJoint
from mbody.testing import check_joint, check_load
from tests.support.own_elements import Attraction, I, J, OwnRevolute, PointOnLine, turned


def changed(base, change):
    """A class like `base` whose physics is changed afterwards."""

    class Wrong(base):
        def physics(self, i, j, p, t):
            return change(*super().physics(i, j, p, t), i=i, j=j, t=t)

    return Wrong("wrong", I, J)


def wrong_joint(change, base=PointOnLine):
    def apply(phi, blocks, nu, gamma, i, j, t):
        parts = {"phi": phi, "blocks": blocks, "nu": nu, "gamma": gamma}
        parts |= change(**parts, i=i, j=j, t=t)
        return parts["phi"], parts["blocks"], parts["nu"], parts["gamma"]

    return changed(base, apply)


WRONG_JOINTS = {
    r"Φ_q: row 0 has .* ∂Φ/∂θ of 'arm' = ": lambda blocks, **_: {
        "blocks": (*blocks[:8], -blocks[8], *blocks[9:])
    },
    r"Φ_q: row 0 has .* ∂Φ/∂θ of 'bar' = ": lambda blocks, **_: {
        "blocks": (*blocks[:2], 1.01 * blocks[2], *blocks[3:])
    },
    r"γ: row 0 has .* Φ_q a − d²Φ/dt² = ": lambda gamma, i, **_: {
        "gamma": (gamma[0] + 1e-3 * i[7] ** 2, 0.0)
    },
    r"ν: row 0 has 0, but differences of Φ give −∂Φ/∂t = -0\.1": lambda phi, t, **_: {
        "phi": (phi[0] + 0.1 * t, 0.0)
    },
    r"position only: Φ, Φ_q and ν of row 0": lambda phi, i, **_: {"phi": (phi[0] + i[7], 0.0)},
    r"padding: beyond its own rows": lambda phi, **_: {"phi": (phi[0], 1.0)},
    r"'wrong' failed: ValueError: physics gave a number that is not finite": lambda **_: {
        "gamma": (math.inf, 0.0)
    },
    r"'wrong' failed: ZeroDivisionError": lambda **_: {"gamma": (1.0 / 0.0, 0.0)},
}


@pytest.mark.parametrize("sentence", WRONG_JOINTS)
def test_wrong_joints_are_caught(sentence):
    with pytest.raises(AssertionError, match="^Wrong 'wrong': .*" + sentence) as caught:
        check_joint(wrong_joint(WRONG_JOINTS[sentence]))
    assert "state 0 of seed 0: t = 0." in str(caught.value)
    assert "mass centre of 'bar' at (x, y, θ) = (" in str(caught.value)


@dataclass(frozen=True)
class Tackle(CustomJoint):
    """y_j = 2 y_i: right derivatives, but something must pull the difference."""

    def physics(self, i, j, p, t):
        return (j[1] - 2.0 * i[1], 0), (0, -2, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0), (0, 0), (0, 0)


@dataclass(frozen=True)
class AxesOnly(CustomJoint):
    """Equal angles of the bodies' axes, whatever the markers say."""

    rows = "a"

    def physics(self, i, j, p, t):
        return (j[2] - i[2], 0), (0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0), (0, 0), (0, 0)


@dataclass(frozen=True)
class Twice(CustomJoint):
    """The same row twice."""

    rows = "aa"

    def physics(self, i, j, p, t):
        phi = j[2] + p[5] - i[2] - p[4]
        return (phi, phi), (0, 0, -1, 0, 0, -1, 0, 0, 1, 0, 0, 1), (0, 0), (0, 0)


@dataclass(frozen=True)
class Never(CustomJoint):
    """Φ = (θ_j − θ_i)² + 1 has no zero."""

    rows = "a"

    def physics(self, i, j, p, t):
        x, w = j[2] + p[5] - i[2] - p[4], j[7] - i[7]
        block = (0, 0, -2 * x, 0, 0, 0, 0, 0, 2 * x, 0, 0, 0)
        return (x * x + 1.0, 0), block, (0, 0), (-2.0 * w * w, 0)


@dataclass(frozen=True)
class Level(CustomJoint):
    """Both mass centres at one height: the world's y axis is nobody's."""

    def physics(self, i, j, p, t):
        return (j[1] - i[1], 0), (0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0), (0, 0), (0, 0)


class Incomparable(OwnRevolute):
    """Equal to nothing but itself."""

    __eq__ = object.__eq__
    __hash__ = object.__hash__


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        (Tackle, "description: Φ of row 0 must not change"),
        (AxesOnly, "description: Φ of row 0 must not change when the bodies get other axes"),
        (Twice, "full rank: of its 2 rows only 1 are independent"),
        (Never, "closed: no place with Φ = 0 found"),
        (Level, "description"),
        (Incomparable, "equality: it is not equal to its copy"),
    ],
)
def test_joints_that_are_no_joints(kind, sentence):
    with pytest.raises(AssertionError, match=f"^{kind.__name__} 'wrong': {sentence}"):
        check_joint(kind("wrong", I, J))


def test_reactions_that_do_not_balance():
    # the places alone, so that the description is in order: y_j = 2 y_i
    @dataclass(frozen=True)
    class Places(CustomJoint):
        def physics(self, i, j, p, t):
            pix, piy = turned(i, p[0], p[1])
            pjx, pjy = turned(j, p[2], p[3])
            blocks = (0, -2, -2 * pix, 0, 0, 0, 0, 1, pjx, 0, 0, 0)
            gamma = j[7] ** 2 * pjy - 2.0 * i[7] ** 2 * piy
            return (j[1] + pjy - 2.0 * (i[1] + piy), 0), blocks, (0, 0), (gamma, 0)

    with pytest.raises(AssertionError, match=r"'wrong': action = reaction: .* leaves a force of"):
        check_joint(Places("wrong", I, J))


def test_what_a_solution_tells_is_what_is_checked(monkeypatch):
    def tampered(L, W, *rest):
        breakdown(L, W, *rest)
        rest[-1][:, :, 4::PER_PRIMITIVE] += 1e-6

    bench = importlib.import_module("mbody.testing.contracts")
    breakdown = bench.breakdown
    monkeypatch.setattr(bench, "breakdown", tampered)
    with pytest.raises(AssertionError, match=r"'pin': action = reaction: .* leaves a moment about"):
        check_joint(Revolute("pin", I, J))


def wrong_load(change):
    return changed(Attraction, lambda *f, i, j, t: change(*f, i, j))


WRONG_LOADS = {
    r"action = reaction: .* leaves a force of .*; it must sum to zero": (
        lambda *f: (0.0, 0.0, 0.0, *f[3:6])
    ),
    r"action = reaction: .* leaves a moment about": lambda *f: (*f[:2], -f[2], *f[3:6]),
    r"world: with the whole world moved, its forces do not go along": (
        lambda *f: tuple((2.0 + math.sin(f[6][0])) * x for x in f[:6])
    ),
    r"description: its forces must not change": (
        lambda *f: tuple((2.0 + math.sin(f[6][2] - f[7][2])) * x for x in f[:6])
    ),
    r"'wrong' failed: ValueError: physics gave 5 numbers, 6 are wanted": lambda *f: f[:5],
}


@pytest.mark.parametrize("sentence", WRONG_LOADS)
def test_wrong_loads_are_caught(sentence):
    with pytest.raises(AssertionError, match="^Wrong 'wrong': .*" + sentence) as caught:
        check_load(wrong_load(WRONG_LOADS[sentence]))
    assert "state 0 of seed 0: t = 0." in str(caught.value)


def test_a_damper_that_pushes():
    with pytest.raises(AssertionError, match=r"'c': dissipation: it gives the power .* only takes"):
        check_load(Damper("c", I, J, law=Polynomial((0.5, 1.0))))

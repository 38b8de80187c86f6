"""Functions and poses: known mechanisms are among the solutions, and two routes have the same."""

import itertools
import math

import numpy as np
import pytest

import mbody
from mbody.errors import SolveError
from mbody.synthesis.guidance import (
    displaced,
    dyads,
    four_bars,
    places,
    slider_cranks,
    sliding_points,
)
from tests.support.synthesis_cases import four_bar, meet, random_four_bar

#: Points at which circle points are sought; of four and five poses they follow by themselves.
EVERY = np.empty(0)


def generated(crank, coupler, rocker, theta, side):
    """Angle of the rocker of a four-bar on a ground of 1, by circles."""
    pins = crank * np.exp(1j * theta)
    return np.angle([meet(a, coupler, 1.0, rocker, side) - 1.0 for a in pins])


def random_sides(rng):
    values = random_four_bar(rng)
    ground = abs(
        complex(values["ground.O4.x"], values["ground.O4.y"])
        - complex(values["ground.O2.x"], values["ground.O2.y"])
    )
    return [values[name] / ground for name in ("crank.A.x", "coupler.B.x", "rocker.B.x")]


@pytest.mark.processor
@pytest.mark.parametrize("count", [3, 4, 5])
def test_a_known_four_bar_generates_its_function(count):
    rng, numbers = np.random.default_rng(count), set()
    for _ in range(60):
        sides, side = random_sides(rng), rng.choice([-1, 1])
        zeros = (0.0 if count < 5 else rng.uniform(0, 6), 0.0 if count < 4 else rng.uniform(0, 6))
        theta = np.sort(rng.uniform(0.0, 6.0, count))
        psi = generated(*sides, theta, side)
        found = four_bars(theta - zeros[0], psi - zeros[1])
        numbers.add(len(found))
        off = [
            max(abs(a - b) for a, b in zip((one.crank, one.coupler, one.third), sides, strict=True))
            for one in found
        ]
        assert min(off) < 1e-6
        for one in found:  # each meets the pairs, whatever else it is
            angles = [theta - zeros[0] + one.input_zero, psi - zeros[1] + one.output_zero]
            pin = one.crank * np.exp(1j * angles[0])
            end = 1.0 + one.third * np.exp(1j * angles[1])
            lengths = np.abs(end - pin)
            assert np.ptp(lengths) < 1e-7 * lengths.max()
    assert numbers <= {3: {1}, 4: {2}, 5: {1, 3}}[count]


@pytest.mark.processor
@pytest.mark.parametrize("count", [3, 4, 5])
def test_a_known_slider_crank_generates_its_function(count):
    rng = np.random.default_rng(count)
    for _ in range(60):
        crank, offset = rng.uniform(0.1, 0.5), rng.uniform(-0.4, 0.4)
        zeros = (0.0 if count < 5 else rng.normal(), 0.0 if count < 4 else rng.normal())
        theta = np.sort(rng.uniform(0.0, 6.0, count))
        x = crank * np.cos(theta) + np.sqrt(1.0 - (offset - crank * np.sin(theta)) ** 2)
        found = slider_cranks(theta - zeros[0], x - zeros[1])
        off = [
            max(abs(one.crank - crank), abs(one.coupler - 1.0), abs(one.third - offset))
            for one in found
        ]
        assert min(off) < 1e-5


def test_five_pairs_are_five_poses():
    """A second route: seen from the crank, the rocker takes five poses, and the coupler is one of
    Burmester's pairs; another is the ground.
    """
    rng = np.random.default_rng(8)
    for _ in range(40):
        theta = np.sort(rng.uniform(0.0, 6.0, 5))
        psi = generated(*random_sides(rng), theta, 1)
        poses = displaced(np.exp(-1j * theta), psi - theta)  # of the rocker, O4 at e^{-iθ}
        pairs = dyads(poses, EVERY)
        # m is the coupler's end on the crank, Q that on the rocker, in the first pose
        o4 = np.exp(-1j * theta[0])
        lengths = {
            (round(abs(m), 5), round(abs(q - m), 5), round(abs(q - o4), 5))
            for q, m in pairs
            if abs(m) > 1e-6
        }
        found = four_bars(theta, psi)
        assert lengths == {
            (round(one.crank, 5), round(one.coupler, 5), round(one.third, 5)) for one in found
        }


def test_more_pairs_are_met_in_the_mean():
    x = np.linspace(0.0, 1.0, 9)
    pairs = [(f"{60 * a} deg", f"{60 * a**1.5} deg") for a in x]
    best = mbody.synthesize(function=pairs, ground=2.0)[0]
    assert 0.0 < best.error < 1e-4
    # at a minimum: no lengths near it are better, by circles
    names = ("crank.A.x", "coupler.B.x", "rocker.B.x")
    sides = np.array([best.values[name] for name in names]) / 2.0
    theta = np.radians(60.0 * x) + best.zeros[0]
    wanted = np.radians(60.0 * x**1.5) + best.zeros[1]

    def error(sides):
        turned = [generated(*sides, theta, side) - wanted for side in (1, -1)]
        turned = np.mod(np.array(turned) + np.pi, 2.0 * np.pi) - np.pi
        return np.square(turned).sum(axis=1).min()

    assert error(sides) == pytest.approx(best.error, rel=1e-6)
    for n, step in itertools.product(range(3), (-1e-3, 1e-3)):
        near = sides.copy()
        near[n] *= 1.0 + step
        assert error(near) > best.error


@pytest.mark.processor
def test_the_four_bar_that_took_five_poses_is_among_their_solutions():
    rng, numbers = np.random.default_rng(2), set()
    for _ in range(60):
        values = random_four_bar(rng)
        theta = np.sort(rng.uniform(0.0, 6.0, 5))
        a, b, p = four_bar(values, theta, rng.choice([-1, 1]))
        moves = displaced(p, np.angle(b - a) + 0.3)
        found = dyads(moves, EVERY)
        numbers.add(len(found))
        for point, pivot in ((a[0], "O2"), (b[0], "O4")):
            centre = complex(values[f"ground.{pivot}.x"], values[f"ground.{pivot}.y"])
            off = np.abs(found - [point, centre]).max(axis=1)
            assert off.min() < 1e-6
        for point, centre in found:
            radii = np.abs(places(point, moves) - centre)
            assert np.ptp(radii) < 1e-8 * radii.max()
    assert numbers <= {2, 4} and 4 in numbers


def test_curves_of_four_poses_pass_the_pairs_of_five():
    """Burmester's curves of four of the poses contain the pairs of all five."""
    rng = np.random.default_rng(6)
    where, angle = rng.normal(size=5) + 1j * rng.normal(size=5), rng.uniform(-1.5, 1.5, 5)
    five = displaced(where, angle)
    four = displaced(where[:4], angle[:4])
    curve = dyads(four, EVERY)
    for point, centre in curve[::97]:
        radii = np.abs(places(point, four) - centre)
        assert np.ptp(radii) < 1e-6 * radii.max()
    for pair in dyads(five, EVERY):
        near = np.abs(curve - pair).max(axis=1).min()
        assert near < 0.1 * np.abs(pair).max()  # the next of 1440 samples


def test_sliding_points_lie_on_lines():
    rng = np.random.default_rng(5)
    for count, expected in ((3, 8), (4, 1)):
        where, angle = (
            rng.normal(size=count) + 1j * rng.normal(size=count),
            rng.uniform(-1, 1, count),
        )
        found = sliding_points(displaced(where, angle), 8)
        assert len(found) == expected
        for point in found:
            line = places(point, displaced(where, angle))
            area = ((line[1:] - line[0]) * np.conj(line[1] - line[0])).imag
            assert np.abs(area).max() < 1e-9 * np.abs(line - line[0]).max() ** 2


@pytest.mark.parametrize("count", [3, 4, 5])
def test_poses_are_taken_by_the_assembled_mechanism(count):
    values = random_four_bar(np.random.default_rng(11))
    theta = 0.3 + np.arange(5) * 0.5
    a, b, p = four_bar(values, theta, 1)
    poses = [(z.real, z.imag, t) for z, t in zip(p, np.angle(b - a) + 0.3, strict=True)][:count]
    for design in mbody.synthesize(poses=poses, count=3):
        run = mbody.kinematics(design.mechanism, drive={"motor": design.driven})
        place = run.measure("coupler.origin.x") + 1j * run.measure("coupler.origin.y")
        turn = run["coupler"].angle - [angle for _, _, angle in poses]
        size = np.abs(p).max()
        assert np.abs(place - p[:count]).max() < 1e-8 * size
        assert np.abs(np.exp(1j * turn) - 1.0).max() < 1e-8
        assert design.defects == () and design.error < 1e-16 * size**2


def test_a_slider_crank_takes_four_poses():
    poses = [(0, 0, 0), (1, 0.5, "20 deg"), (2, 0.7, "50 deg"), (2.5, 0.5, "70 deg")]
    for design in mbody.synthesize(kind="slider_crank", poses=poses):
        run = mbody.kinematics(design.mechanism, drive={"motor": design.driven})
        assert run.measure("rod.P.x") == pytest.approx([0, 1, 2, 2.5], abs=1e-9)
        assert run.measure("rod.P.y") == pytest.approx([0, 0.5, 0.7, 0.5], abs=1e-9)
        turn = np.degrees(run["rod"].angle)
        assert np.mod(turn + 180.0, 360.0) - 180.0 == pytest.approx([0, 20, 50, 70], abs=1e-7)


def test_defects_are_those_of_the_position_analysis():
    """All six four-bars of five poses with either link as crank: their circuits and branches by
    circles, against what following them found.
    """
    rng, words = np.random.default_rng(0), set()
    for _ in range(12):
        values = random_four_bar(rng)
        theta = np.sort(rng.uniform(0.0, 6.0, 5))
        a, b, p = four_bar(values, theta, 1)
        poses = [(z.real, z.imag, t) for z, t in zip(p, np.angle(b - a), strict=True)]
        for design in mbody.synthesize(poses=poses, defective=True, count=12):
            number = design.values.__getitem__
            pose = (
                [complex(x, y) for x, y, _ in poses],
                np.exp(1j * np.array([t for *_, t in poses])),
            )
            pins = [
                pose[0] + complex(number(f"coupler.{k}.x"), number(f"coupler.{k}.y")) * pose[1]
                for k in "AB"
            ]
            pivots = [
                complex(number(f"ground.{k}.x"), number(f"ground.{k}.y")) for k in ("O2", "O4")
            ]
            side = np.sign(((pins[1] - pins[0]) * np.conj(pivots[1] - pins[0])).imag)
            word = design.defects[0].partition(":")[0] if design.defects else ""
            words.add(word)
            if word in ("", "order"):
                assert np.ptp(side) == 0.0  # a crank passes no dead centre
            if word == "order" and design.grashof in ("crank-rocker", "double crank"):
                turn = np.angle(pins[0] - pivots[0])
                steps = np.diff(turn)
                for sign in (1, -1):
                    assert np.mod(sign * steps, 2.0 * np.pi).sum() > 2.0 * np.pi - 1e-6
            if word == "circuit":
                assert np.ptp(side) > 0.0 or design.grashof in ("double rocker", "rocker-crank")
    assert {"", "circuit", "branch"} <= words


def test_poses_without_a_mechanism_are_a_sentence():
    poses = [(0, 0, 0), (1, 0.2, 0.1), (0.1, 2, -0.6), (3, -1, 0.9), (-2, 0.3, 0.4)]
    with pytest.raises(SolveError, match="no four_bar takes the poses"):
        mbody.synthesize(poses=poses)


def test_the_example_of_the_documentation_by_hand():
    """Freudenstein's three equations by Cramer's rule."""
    pairs = [(40, 70), (60, 78), (90, 95)]
    phi, psi = np.radians(np.array(pairs, dtype=float)).T
    rows = np.column_stack([np.cos(psi), -np.cos(phi), np.ones(3)])
    right = np.cos(phi - psi)
    whole = np.linalg.det(rows)
    k = []
    for n in range(3):
        other = rows.copy()
        other[:, n] = right
        k.append(np.linalg.det(other) / whole)
    crank, rocker = 1.0 / k[0], 1.0 / k[1]
    coupler = math.sqrt(crank**2 + rocker**2 + 1.0 - 2.0 * crank * rocker * k[2])
    found = mbody.synthesize(function=[(f"{a} deg", f"{b} deg") for a, b in pairs])[0]
    assert found.values["crank.A.x"] == pytest.approx(abs(crank), rel=1e-9)
    assert found.values["coupler.B.x"] == pytest.approx(coupler, rel=1e-9)
    assert found.values["rocker.B.x"] == pytest.approx(abs(rocker), rel=1e-9)


@pytest.mark.parametrize("count", [3, 4, 5, 8])
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_travels_of_any_size(count, unit):
    """A slider-crank of micrometres has the proportions of one of metres, in closed form and in the
    mean.
    """
    phi = np.linspace(0.3, 2.4, count)
    travel = 0.5 * np.cos(phi) + np.sqrt(1.6**2 - (0.2 - 0.5 * np.sin(phi)) ** 2)
    if count == 8:
        travel = travel + 0.01 * np.cos(9.0 * phi)
    wanted = slider_cranks(phi, travel)
    found = slider_cranks(phi, unit * travel)
    assert len(found) == len(wanted) > 0
    for one, other in zip(found, wanted, strict=True):
        assert one.crank == pytest.approx(unit * other.crank, rel=1e-6)
        assert one.coupler == pytest.approx(unit * other.coupler, rel=1e-6)
        assert one.third == pytest.approx(unit * other.third, rel=1e-5, abs=1e-7 * unit)
        assert one.output_zero == pytest.approx(unit * other.output_zero, abs=1e-5 * unit)
    if count < 8:
        known = min(abs(one.crank / unit - 0.5) for one in found)
        assert known < 1e-8

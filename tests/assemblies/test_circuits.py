"""Circuits, branches and dead centres: closed forms, and scans by another route."""

import json
import math

import numpy as np
import pytest

import mbody
from mbody import AngleDriver, Body, Marker, Mechanism, Prismatic, Revolute
from mbody.cli import main
from tests.assembly_scan import KINDS, compare
from tests.support.assembly_cases import slider_sixbar
from tests.support.cases import first_fast

FOUR_BARS = {
    "crank-rocker": (1, 3, 2, 3.5),
    "double crank": (3, 2.5, 3.2, 1),
    "double rocker": (4, 2, 3.5, 5),
    "rocker-crank": (2, 3, 1, 3.5),
    "triple rocker": (6, 18, 12, 8),
    "another triple rocker": (3, 4, 5, 7),
}


def limits(a, b, c, d):
    """Dead centres of a four-bar by the law of cosines: the diagonal is b + c or |b − c| long."""
    found = []
    for diagonal in (b + c, abs(b - c)):
        cosine = (a * a + d * d - diagonal * diagonal) / (2.0 * a * d)
        if abs(cosine) < 1.0:
            found += [math.acos(cosine), 2.0 * math.pi - math.acos(cosine)]
    return sorted(found)


def start_of(lengths):
    """An angle at which the four-bar closes."""
    ends = limits(*lengths)
    if not ends:
        return 0.3
    middles = [0.5 * (x + y) for x, y in zip(ends, [*ends[1:], ends[0] + 2 * math.pi], strict=True)]
    a, b, c, d = lengths

    def closes(x):
        diagonal = math.sqrt(a * a + d * d - 2 * a * d * math.cos(x))
        return abs(b - c) < diagonal < b + c

    return next(x for x in middles if closes(x))


@pytest.mark.parametrize("kind", FOUR_BARS)
def test_four_bars_by_the_law_of_cosines(kind):
    """Grashof's linkages have two circuits, others one; dead centres to 1e-9 rad."""
    lengths = FOUR_BARS[kind]
    machine = mbody.makers.four_bar(*lengths, start=start_of(lengths))
    found = mbody.dead_centres(machine)
    assert found.complete
    assert found.values == pytest.approx(limits(*lengths), abs=1e-9)
    circuits = mbody.circuits(machine)
    short, *middle, long = sorted(lengths)
    grashof = short + long < sum(middle)
    assert circuits.complete and len(circuits) == (2 if grashof else 1)
    turns = kind in ("crank-rocker", "double crank")
    assert found.full_turn is turns
    assert {one.full_turn for one in circuits} == {turns}
    walked = sorted(x % (2 * math.pi) for one in circuits for x in one.dead_centres)
    assert walked == pytest.approx(limits(*lengths), abs=1e-9)


@pytest.mark.parametrize("off", [1e-7, -1e-7, 1e-5, -1e-5, 1e-3, -1e-3])
@pytest.mark.parametrize("lengths", [(1, 2, 4, 5), (5, 2, 4, 1), (2, 4, 1, 5), (4, 1, 2, 5)])
def test_circuits_that_nearly_meet_are_told_apart(lengths, off):
    """Beside Grashof's limit branches pass each other at the root of what is left: on one side of
    it there are two circuits, on the other one; dead centres by the law of cosines, once a circuit.
    """
    lengths = [one + off if one == 5 else one for one in lengths]
    ends = limits(*lengths)
    found = mbody.circuits(mbody.makers.four_bar(*lengths, start=start_of(lengths)))
    assert found.complete and len(found) == (2 if off < 0.0 else 1)
    for circuit in found:
        values = [value % (2.0 * math.pi) for value in circuit.dead_centres]
        assert all(min(abs(value - end) for end in ends) < 1e-7 for value in values)
        assert len({round(value, 6) for value in values}) == len(values)
        assert off < 0.0 or len(values) == len(ends)


def unused(system):
    """No position of the mechanism: which mode its guesses lead to is not asked."""
    return np.full(system.coordinates + 3, np.nan)


def scanned(machine, count=720):
    """Where the number of modes changes, from one value of the driver to the next: a scan that
    knows nothing of singular Jacobians.
    """
    system = mbody.assemble(machine)
    x = (np.arange(count) + 0.5) * 2.0 * math.pi / count
    counts = []
    for value in x:
        modes = mbody.assembly_modes(system, {"motor": value}, used=unused(system))
        assert modes.complete
        counts.append(len(modes))
    return x, np.array(counts)


@first_fast("seed", [1, 3, 4], 1)
def test_between_dead_centres_the_number_of_modes_is_one(seed):
    """It changes by two at each of them and nowhere else."""
    machine = slider_sixbar(seed)
    found = mbody.dead_centres(machine)
    assert found.complete
    x, counts = scanned(machine, 72)
    for k in range(len(x)):
        low, high = x[k], x[(k + 1) % len(x)] + (2 * math.pi if k + 1 == len(x) else 0.0)
        between = [v for v in found for turn in (0.0, 2 * math.pi) if low < v.value + turn < high]
        change = abs(int(counts[(k + 1) % len(x)]) - int(counts[k]))
        if not between:
            assert change == 0
        elif len(between) == 1 and counts[k] + counts[(k + 1) % len(x)] == 2:
            assert change == 2


@first_fast("seed", [4, 7], 1)
def test_dead_centres_where_the_rest_does_not_close_are_none(seed):
    """Where the first four-bar of Watt's linkage turns back, its second one may be open already:
    beside every dead centre that is reported modes appear or vanish (both once counted 2 and 3 that
    no position reaches).
    """
    compared = compare("Watt's six-bar", seed, starts=50, most=50)
    assert not compared.wrong and compared.dead == {4: 6, 7: 9}[seed]


def test_what_never_closes_does_not_turn():
    """A ground longer than all links together: no dead centre, and no turn either."""
    machine = mbody.makers.four_bar(100, 250, 150, 540)
    found = mbody.dead_centres(machine)
    assert (len(found), found.complete, found.closes, found.full_turn) == (0, True, False, False)
    assert "the loops close at no value of 'motor'" in str(found)
    assert "turns all the way round" not in str(mbody.circuits(machine))


def test_stephenson_and_watt_turn_in_every_mode():
    for name, count in (("stephenson_sixbar", 2), ("watt_sixbar", 2)):
        machine = mbody.gallery.load(name)
        found = mbody.circuits(machine)
        assert found.complete and found.dead_centres.full_turn is True
        assert len(found) == count and all(one.full_turn for one in found)
        # by another route: every mode is followed for a turn
        for mode in found.modes:
            run = mbody.kinematics(machine, turn=True, instants=73, guess=mode)
            for body in ("output",):
                ends = run[body].angle[[0, -1]]
                assert abs(math.remainder(ends[1] - ends[0], 2 * math.pi)) < 1e-9


def test_circuits_that_never_reach_the_value():
    """The double rocker 4, 2, 3.5, 5 has two circuits, of which a position lies on one."""
    found = mbody.circuits(mbody.makers.four_bar(4, 2, 3.5, 5, start=0.6))
    assert [one.modes for one in found] == [(1, 2), ()]
    assert found.of(1) == (1, 1) and found.of(2) == (1, 2) and found.of(9) == (None, None)
    low, high = found[1].range
    assert low % (2 * math.pi) > math.pi and high > low


def test_branches_are_what_the_driver_reaches():
    """From each mode the driver goes to the ends of its circuit and no further."""
    machine = mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2)
    (one,) = mbody.circuits(machine)
    assert one.branches == ((1,), (2,))
    for mode in mbody.assembly_modes(machine):
        reach = mbody.driver_range(machine, guess=mode)
        assert (reach.low, reach.high) == pytest.approx(one.range, abs=1e-9)


def test_a_train_closes_after_several_turns():
    found = mbody.circuits(mbody.gallery.load("planetary_train"))
    assert found.complete and len(found) == 1 and found[0].full_turn


def test_drivers_of_lengths_are_walked_without_proof():
    found = mbody.circuits(mbody.gallery.load("scissor_lift"))
    assert not found.complete and found.doubts
    assert all(one.full_turn is None for one in found)


def test_a_change_point_is_not_called_a_dead_centre():
    """The parallelogram's crank turns all the way round; its branches cross at 0 and 180 deg."""
    found = mbody.dead_centres(mbody.makers.four_bar(1, 3, 1, 3, start=1.0))
    assert not found.complete and found.full_turn is not True
    parallel = mbody.dead_centres(mbody.gallery.load("parallel_cranks"))
    assert not parallel.positions and parallel.full_turn is None


def test_command(capsys):
    assert main(["assemblies", "stephenson_sixbar", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["full_turn"] for one in data["circuits"]] == [True, True]
    assert sorted(mode["circuit"] for mode in data["modes"]) == [1, 2]
    assert data["dead_centres"] == []
    assert main(["check", "stephenson_sixbar", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["assemblies"] == {
        "count": 2,
        "complete": True,
        "within": None,
        "used": "open-open",
    }


def components(machine, count=180):
    """The number of circuits by nearness alone: modes at neighbouring values of the crank are
    joined to the nearest one, and two that vanish together to each other.
    """
    name = machine.drivers[0].name
    system = mbody.assemble(machine)
    x = (np.arange(count) + 0.5) * 2.0 * math.pi / count
    places = []
    for value in x:
        modes = mbody.assembly_modes(system, {name: value}, used=unused(system))
        assert modes.complete
        keys = [[f(mode[b][2]) for b in mode for f in (math.cos, math.sin)] for mode in modes]
        places.append(np.array(keys).reshape(len(modes), 2 * len(machine.bodies)))
    parent = {(k, n): (k, n) for k, rows in enumerate(places) for n in range(len(rows))}

    def root(node):
        while parent[node] != node:
            node = parent[node]
        return node

    for k in range(count):
        here, there = places[k], places[(k + 1) % count]
        apart = np.linalg.norm(here[:, None] - there[None], axis=2)
        left = {(k, n) for n in range(len(here))}, {((k + 1) % count, n) for n in range(len(there))}
        for index in np.argsort(apart, axis=None)[: min(apart.shape, default=0) ** 2]:
            n, m = np.unravel_index(index, apart.shape)
            one, other = (k, int(n)), ((k + 1) % count, int(m))
            if one in left[0] and other in left[1]:
                left[0].remove(one)
                left[1].remove(other)
                parent[root(one)] = root(other)
        for rest in left:
            # what vanishes goes in pairs: the two nearest of them
            own = sorted(rest)
            assert len(own) in (0, 2), "several dead centres in one step: take more of them"
            if own:
                parent[root(own[0])] = root(own[1])
    return len({root(node) for node in parent})


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_circuits_of_stephensons_six_bars(seed):
    machine = KINDS["Stephenson's six-bar"](seed)
    found = mbody.circuits(machine)
    assert found.complete
    assert len(found) == components(machine)


def slotted_lever(a, d, h):
    """A lever under the crank; its slot runs beside its pivot, over a block on the crank's pin."""
    machine = Mechanism("slotted lever", ground={"O": (0, 0), "A": (0, -d)})
    machine.add(
        *(Body("crank", points={"B": (a, 0)}), Body("block"), Body("lever")),
        Revolute("O", "ground.O", "crank"),
        Revolute("B", "crank.B", "block"),
        Revolute("A", "ground.A", "lever"),
        Prismatic("slot", Marker("lever", (0, h), 0.0), "block"),
        AngleDriver("motor", "crank", 0.3),
    )
    # the pin comes as near to the pivot as the slot passes it: a² + d² + 2 a d sin x = h²
    return machine, roots_of_sine([(h * h - a * a - d * d) / (2 * a * d)])


def slotted_crank(b, d, h):
    """A slot on the crank, over a block at the end of a rocker."""
    machine = Mechanism("slotted crank", ground={"O": (0, 0), "A": (d, 0)})
    machine.add(
        *(Body("crank"), Body("block"), Body("rocker", points={"B": (b, 0)})),
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "ground.A", "rocker"),
        Revolute("B", "rocker.B", "block"),
        Prismatic("slot", Marker("crank", (0, h), 0.0), "block"),
        AngleDriver("motor", "crank", 0.3),
    )
    # the slot touches the circle of the rocker: |d sin x + h| = b
    return machine, roots_of_sine([(b - h) / d, (-b - h) / d])


def knee(a, b, c, d):
    """A four-bar whose angle between crank and coupler is driven."""
    machine = Mechanism("knee", ground={"O": (0, 0), "P": (d, 0)})
    machine.add(
        Body("crank", points={"A": (a, 0)}),
        *(Body("coupler", points={"B": (b, 0)}), Body("rocker", points={"B": (c, 0)})),
        Revolute("O", "ground.O", "crank"),
        Revolute("A", "crank.A", "coupler"),
        Revolute("B", "coupler.B", "rocker.B"),
        Revolute("P", "ground.P", "rocker"),
        AngleDriver("motor", "coupler", 1.0, relative_to="crank"),
    )
    # the bars c and d are in line where |a + b e^(ix)| is their difference or their sum
    cosines = [(reach**2 - a * a - b * b) / (2 * a * b) for reach in (abs(c - d), c + d)]
    found = [math.acos(q) for q in cosines if abs(q) < 1.0]
    return machine, sorted([*found, *(2.0 * math.pi - x for x in found)])


def roots_of_sine(values):
    found = [math.asin(q) for q in values if abs(q) < 1.0]
    return sorted([*(x % (2.0 * math.pi) for x in found), *(math.pi - x for x in found)])


@first_fast(("make", "count"), [(slotted_lever, 3), (slotted_crank, 3), (knee, 4)], 2)
def test_slots_that_turn_and_angles_between_links(make, count):
    """In closed form, for ten of each; proven to be all."""
    rng = np.random.default_rng(11)
    turning = 0
    for _ in range(10):
        machine, wanted = make(*rng.uniform(0.5, 3.0, count).tolist())
        found = mbody.dead_centres(machine)
        assert found.complete
        if found.closes:
            assert found.values == pytest.approx(wanted, abs=1e-9)
            assert found.full_turn is (not wanted)
            turning += not wanted
    assert turning or make is knee


def test_a_shaper_turns_in_every_mode():
    found = mbody.dead_centres(mbody.gallery.load("quick_return"))
    assert found.complete and found.full_turn


def test_reports_and_pages_begin_in_the_assembly_that_is_chosen():
    from mbody.reports.described import run_of
    from mbody.views.shapes import motion

    machine = mbody.makers.four_bar(1, 3, 2, 3.5, masses=(1, 1, 1), speed=2.0)
    wanted = {
        name: mbody.kinetostatics(machine, turn=True, assembly=name)["rocker"].angle
        for name in ("open", "crossed")
    }
    assert np.abs(wanted["open"] - wanted["crossed"]).min() > 0.1
    for name, angle in wanted.items():
        for run in (motion(machine, assembly=name), run_of(machine, None, None, name)[0]):
            assert np.abs(run["rocker"].angle - angle).max() < 1e-12

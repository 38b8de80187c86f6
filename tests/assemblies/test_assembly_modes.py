"""All assembly modes: against literature, against an exhaustive search by another route, and what
is said where there is no proof.
"""

import itertools
import json
import math

import numpy as np
import pytest

import mbody
from mbody import (
    AngleDriver,
    Body,
    Gravity,
    Marker,
    Mechanism,
    ModelError,
    PinSlot,
    Revolute,
    makers,
)
from mbody.cli import main
from tests.assembly_scan import KINDS, compare
from tests.support.assembly_cases import (
    CHAINS,
    Exhaustive,
    geared,
    platform,
    redundant,
    slider_sixbar,
    slotted,
    structure,
)
from tests.support.cases import first_fast

#: Degrees of printed answers that have eleven digits.
PRINTED = 1e-9
STARTS = 120


def degrees(modes, body):
    return sorted(math.degrees(mode[body][2]) for mode in modes)


def test_four_bar_of_the_book():
    """Norton, example 4-1: open 20.30 and 57.33 deg, crossed -60.98 and -98.01 deg."""
    modes = mbody.assembly_modes(mbody.makers.four_bar(40, 120, 80, 100), {"crank": "40 deg"})
    assert modes.complete and modes.certificate == "interval" and not modes.unresolved
    found = {m.name: (math.degrees(m["coupler"][2]), math.degrees(m["rocker"][2])) for m in modes}
    assert found["open"] == pytest.approx((20.297882788196475, 57.324880070360784), abs=PRINTED)
    crossed = (-60.97796679586442, -98.00496407802873)
    assert found["crossed"] == pytest.approx(crossed, abs=PRINTED)
    assert max(mode.residual for mode in modes) < 1e-14


def test_slider_crank_of_the_book():
    """Norton, example 4-2: the slider at 126.84 and -86.84 mm."""
    machine = mbody.makers.slider_crank(40, 120, offset=-20, start=math.radians(60))
    modes = mbody.assembly_modes(machine)
    (slider,) = {name for name in modes[0] if name not in ("crank", "rod", "coupler")}
    places = {mode.name: mode[slider][0] for mode in modes}
    assert modes.complete and len(modes) == 2
    assert places["open"] == pytest.approx(126.83800519452289, abs=PRINTED)
    assert places["crossed"] == pytest.approx(-86.83800519452289, abs=PRINTED)


def test_platform_of_the_literature_has_six():
    """3-RPR: six real modes (Innocenti and Parenti-Castelli 1992), poses to ten digits."""
    modes = mbody.assembly_modes(platform((14.98, 15.38, 12.0)))
    assert len(modes) == 6 and modes.complete
    found = np.array(sorted(mode["platform"] for mode in modes))
    known = [
        [-14.896128100172763, 1.582961661962597, 0.2453095309916269],
        [-13.419939013974387, -6.656247956710157, 0.585672783258552],
        [-8.726595331862912, 12.17566975217004, -0.9869742378454451],
        [-5.495660815452858, -13.935498276039363, -0.04733136936691773],
        [14.673943655735037, -3.0126031249259286, 2.1329043651290895],
        [14.9201332471544, -1.337917743046228, 1.0020385399022498],
    ]
    assert np.abs(found - known).max() < 1e-9


#: How a linkage is made from a seed, and the seeds; 0 and 1 are in the part of the scan.
RANDOM = {
    "slots": (slotted, range(2, 5)),
    "sliders": (slider_sixbar, range(2, 5)),
    "redundant rows": (redundant, range(2, 4)),
    "gears": (geared, range(2, 4)),
    "triads": (lambda seed: structure(*CHAINS["triad"], seed), range(2, 5)),
    "serial tetrads": (lambda seed: structure(*CHAINS["tetrad serial"], seed), [2]),
    "quaternary tetrads": (lambda seed: structure(*CHAINS["tetrad quaternary"], seed), [2]),
}


@first_fast("kind", RANDOM, 4)
def test_random_linkages_against_many_starts_of_newton(kind):
    """None is missed: many starts on equations of their own never find more than a proof allows,
    and find as many.
    """
    make, seeds = RANDOM[kind]
    proven = 0
    for seed in seeds:
        machine = make(seed)
        modes = mbody.assembly_modes(machine)
        assert all(mode.residual < 1e-12 for mode in modes)
        proven += modes.complete
        assert len(modes) == Exhaustive(machine).count(STARTS), seed
    assert proven == len(seeds)


@first_fast("kind", KINDS, 1)
def test_a_part_of_the_scan_of_random_linkages(kind):
    """`python -m tests.assembly_scan` compares 210 and more; here two of every kind."""
    for seed in (0, 1):
        one = compare(kind, seed, starts=200, most=800)
        assert one.complete and not one.wrong, (seed, one.wrong)
        assert one.exhaustive == one.found


def test_nearly_parallel_guides_close_far_away():
    """Two slides in series on lines at 10 deg: in one mode they go far beyond the size of what they
    close. Both are found (the search ended at four times that size, and called it proven that there
    is none).
    """
    modes = mbody.assembly_modes(KINDS["triad with two slides"](0))
    assert (len(modes), modes.complete) == (2, True) and modes.used is not None
    assert max(abs(mode["b3"][0]) for mode in modes) > 3.0


@pytest.mark.slow
def test_every_gallery_model_without_family_cam_or_road_is_proven():
    open_ones, counts = {}, {}
    for name in mbody.gallery.names():
        machine = mbody.gallery.load(name)
        if mbody.mobility(machine).driven.freedom != 0 or not machine.drivers:
            continue
        modes = mbody.assembly_modes(machine)
        assert modes.used is not None, name
        counts[name] = len(modes)
        if not modes.complete:
            open_ones[name] = modes.certificate
    families = ("flyball_governor", "peaucellier", "porter_governor", "scissor_lift")
    expected = dict.fromkeys(families, "interval")
    expected |= dict.fromkeys(("cam_follower", "vehicle"), "multi-start")
    assert open_ones == expected
    isolated = {"flyball_governor": 2, "porter_governor": 2, "peaucellier": 4, "scissor_lift": 8}
    assert {name: counts[name] for name in isolated} == isolated
    assert len(counts) >= 18


def test_a_family_is_named():
    """The arms of a governor fold onto each other and turn freely: a continuum of positions."""
    modes = mbody.assembly_modes(mbody.gallery.load("flyball_governor"))
    (open_part,) = modes.unresolved
    assert "a family" in open_part.reason and set(open_part.bodies) <= {"arm_r", "link_r"}
    assert open_part.width > 6.0
    assert modes.status.startswith("doubtful") and modes.doubts[0].kind == "incomplete"


@pytest.mark.parametrize("away", [1e-2, 1e-5, 1e-7, 1e-9])
def test_beside_a_dead_centre(away):
    """cos θ = 2/3 is a dead centre of the triple rocker 6, 18, 12, 8: two modes 1e-9 rad before it,
    none 1e-9 rad beyond it.
    """
    machine = mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2)
    dead = math.acos(2 / 3)
    inside = mbody.assembly_modes(machine, {"motor": dead + away})
    outside = mbody.assembly_modes(machine, {"motor": dead - away})
    assert (len(inside), inside.complete) == (2, True)
    assert (len(outside), outside.complete) == (0, True)
    # the two positions are apart by the root of the way: closed form of two circles
    apart = abs(inside[0]["rocker"][2] - inside[1]["rocker"][2])
    d = math.sqrt(36 + 64 - 96 * math.cos(dead + away))
    half = math.acos((d * d + 144 - 324) / (24 * d))
    assert apart == pytest.approx(2.0 * abs(math.pi - half), rel=1e-5) or apart == pytest.approx(
        2.0 * half, rel=1e-5
    )


def test_at_a_dead_centre_it_says_so():
    machine = mbody.makers.four_bar(6, 18, 12, 8, start=math.pi / 2)
    modes = mbody.assembly_modes(machine, {"motor": math.acos(2 / 3)})
    assert not modes.complete
    assert any("dead centre" in one.reason for one in modes.unresolved)


def test_no_assembly_is_proven_too():
    modes = mbody.assembly_modes(mbody.makers.four_bar(100, 250, 150, 540))
    assert (len(modes), modes.complete, modes.used) == (0, True, None)
    assert "the loops close nowhere there" in str(modes)


def test_a_mode_is_a_guess_for_any_analysis():
    machine = mbody.makers.four_bar(1, 3, 2, 3.5, start=1.0, speed=2.0)
    modes = mbody.assembly_modes(machine)
    for mode in modes:
        run = mbody.kinetostatics(machine, guess=mode)
        for body in ("crank", "coupler", "rocker"):
            turned = math.remainder(run[body].angle[0] - mode[body][2], 2.0 * math.pi)
            assert abs(turned) < 1e-12
    assert modes["open"] is modes[1] and modes.used in list(modes)
    with pytest.raises(mbody.ModelError, match="there is no mode 'opn'"):
        modes["opn"]


def test_the_count_does_not_depend_on_place_size_or_names():
    counts = set()
    for size, turn in itertools.product((1e-3, 1.0, 1e4), (0.0, 2.0)):
        machine = mbody.makers.four_bar(6 * size, 18 * size, 12 * size, 8 * size, start=1.5 + turn)
        modes = mbody.assembly_modes(machine)
        counts.add((len(modes), modes.complete))
    assert counts == {(2, True)}


def test_a_cam_has_random_starts_and_says_so():
    modes = mbody.assembly_modes(mbody.gallery.load("cam_follower"))
    assert (modes.certificate, modes.complete) == ("multi-start", False)
    assert "CamFollower" in modes.unresolved[0].reason
    assert modes.used is not None


def test_a_search_may_be_cut_short():
    machine = structure(*CHAINS["tetrad serial"], 1)
    modes = mbody.assembly_modes(machine, most=20)
    assert not modes.complete and "20 boxes" in modes.unresolved[0].reason


def test_free_motion_is_refused():
    machine = Mechanism("pendulum")
    machine.add(Body("rod", points={"P": (1, 0)}), Revolute("O", "ground", "rod"))
    machine.add(Gravity("gravity", y=-9.81))
    with pytest.raises(mbody.SolveError, match="needs 0 free degrees of freedom"):
        mbody.assembly_modes(machine)


def test_command(capsys):
    assert main(["assemblies", "norton_fourbar", "--at", "crank=60", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["count"], data["complete"], data["certificate"]) == (2, True, "interval")
    assert list(data["at"].values()) == [pytest.approx(60.0)]
    used = [mode for mode in data["modes"] if mode["used"]]
    run = mbody.kinematics(mbody.gallery.load("norton_fourbar"), drive={"motor": math.pi / 3})
    (one,) = used
    turned = one["bodies"]["rocker"]["angle"] - math.degrees(float(run["rocker"].angle[0]))
    assert abs(math.remainder(turned, 360.0)) < 1e-9
    assert {"circuit", "branch", "residual", "number", "name"} <= set(one)
    assert data["circuits"] and data["dead_centres"] == [] and data["boxes"] > 0
    assert main(["assemblies", "norton_fourbar", "--at", "crank=60"]) == 0
    assert "it is proven that there are no more" in capsys.readouterr().out
    assert main(["assemblies", "norton_fourbar", "--at", "crank=60,70"]) == 2
    assert "give --at one value" in capsys.readouterr().err


def test_picture(tmp_path, capsys):
    file = tmp_path / "modes.svg"
    assert main(["assemblies", "mud_pump", "-o", str(file)]) == 0
    assert f"wrote {file}" in capsys.readouterr().err
    text = file.read_text("utf-8")
    assert text.count('id="link:rod1"') == 4


@pytest.mark.parametrize(
    ("which", "angle"), [("open", 57.3249), ("crossed", -98.0050), (1, -98.0050)]
)
def test_an_analysis_takes_the_mode_that_assembly_names(which, angle):
    """By its name and its number, as the guess of that mode does, whatever the instants are."""
    machine = makers.four_bar(40, 120, 80, 100, start="40 deg", speed=2.0)
    modes = mbody.assembly_modes(machine)
    for analysis in (mbody.kinematics, mbody.kinetostatics, mbody.statics):
        run = analysis(machine, assembly=which)
        assert math.degrees(run["rocker"].angle[0]) == pytest.approx(angle, abs=1e-4)
        mode = modes[which] if isinstance(which, str) else modes[which - 1]
        same = analysis(machine, guess=mode)
        assert run["rocker"].angle[0] == pytest.approx(same["rocker"].angle[0], abs=1e-14)
    # at the first instant, by a time, a turn and a place of the driver
    for instants in ({"t": [0.3, 0.5]}, {"turn": True}, {"drive": {"motor": np.array([1.1, 1.5])}}):
        run = mbody.kinematics(machine, assembly=which, **instants)
        crank = float(run["crank"].angle[0])
        there = mbody.assembly_modes(machine, {"motor": crank})
        mode = there[which] if isinstance(which, str) else there[which - 1]
        turned = run["rocker"].angle[0] - mode["rocker"][2]
        assert math.remainder(turned, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_an_assembly_that_there_is_not_is_refused():
    machine = makers.four_bar(40, 120, 80, 100, start="40 deg")
    with pytest.raises(ModelError, match=r"no assembly mode 'folded' .*'1 crossed', '2 open'"):
        mbody.kinematics(machine, assembly="folded")
    with pytest.raises(ModelError, match="no assembly mode 3"):
        mbody.kinematics(machine, assembly=3)
    with pytest.raises(ModelError, match="assembly is True"):
        mbody.kinematics(machine, assembly=True)
    with pytest.raises(ModelError, match="not both"):
        mbody.kinematics(machine, assembly="open", guess={"rocker": 1.0})
    designs = mbody.assemble(machine).with_values({"rocker.B.x": [80.0, 81.0]})
    with pytest.raises(ModelError, match="no assembly mode 'folded'"):
        mbody.kinematics(designs, assembly="folded")


def test_commands_take_an_assembly(capsys):
    """The mode at the first instant requested, as `mbody assemblies` shows it there."""
    found = {}
    for which in ("open", "crossed", "1"):
        words = [
            "kinematics",
            "norton_fourbar",
            "--at",
            "crank=60,62",
            "--assembly",
            which,
            "--json",
        ]
        assert main(words) == 0
        data = json.loads(capsys.readouterr().out)
        found[which] = data["bodies"]["rocker"]["angle"][0]
    modes = mbody.assembly_modes(mbody.gallery.load("norton_fourbar"), {"crank": "60 deg"})
    for which in ("open", "crossed"):
        expected = math.degrees(modes[which]["rocker"][2])
        assert abs(math.remainder(found[which] - expected, 360.0)) < 1e-9
    assert found["1"] == found[modes[0].name]
    assert (
        main(["poles", "norton_fourbar", "--at", "crank=60", "--assembly", "crossed", "--json"])
        == 0
    )
    centres = json.loads(capsys.readouterr().out)["centres"]
    (pole,) = [one for one in centres if one["symbol"] == "I13"]
    assert abs(pole["y"][0] - 22.7739241063854) > 1.0
    assert main(["kinematics", "norton_fourbar", "--assembly", "sideways"]) == 2
    assert "there is no assembly mode 'sideways'" in capsys.readouterr().err
    assert main(["poles", "double_pendulum", "--to", "0.1", "--assembly", "open"]) == 2
    assert "--assembly is of driven analyses" in capsys.readouterr().err


def test_what_is_searched_up_to_a_length_is_complete_within_it(capsys):
    """Two more modes lie beyond: each closes as a guess of kinematics, which needs no search."""
    turned = 2.300359754327082
    machine = Mechanism("three slots")
    first = (-0.53725, -0.07709, 1.27939)
    machine.add(Body("b0", guess=first), Body("b1", guess=(0.85833, -0.96167, turned)))

    def at(body, x, y, angle=0.0):
        return Marker(body, (x, y), angle)

    machine.add(
        Revolute("j0", at("ground", -0.05404576, 1.38138721), at("b0", 1.53581168, -0.04382104)),
        PinSlot(
            "j1",
            at("b0", 1.49125479, 1.8824374, -2.3580804654744876),
            at("b1", 0.41376094, 1.02455237),
        ),
        PinSlot(
            "j2",
            at("ground", -0.40540857, -1.59902656, 0.2189570032198996),
            at("b1", -0.33358532, 0.11582242),
        ),
        PinSlot(
            "j3",
            at("b1", 1.35092624, -1.66558889, -5.241548673915042),
            at("b0", 0.47462049, 0.94003431),
        ),
        AngleDriver("motor", "b1", turned),
    )
    modes = mbody.assembly_modes(machine)
    assert modes.complete and 30.0 < modes.within < 45.0 and modes.data()["within"] == modes.within
    assert "no more within displacements of 38.22 m" in " ".join(str(modes).split())
    beyond = {"b0": (1.23953, 0.55236, 2.60018), "b1": (-50.25654, -12.33598, turned)}
    run = mbody.kinematics(machine, [0.0], guess=beyond)
    assert run["b1"].x[0] == pytest.approx(-50.25654, abs=1e-4) and run.checks.constraint < 1e-12
    bounded = mbody.assembly_modes(mbody.makers.slider_crank(1.0, 3.0))
    assert bounded.complete and bounded.within is None

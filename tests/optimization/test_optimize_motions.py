"""Optimization over a motion in time, against closed forms; cycles of several turns; starts."""

import math

import pytest

import mbody
from mbody import Event, Gravity, SolveError, makers
from mbody.cli import main

#: A mass of 1 kg on a spring of 6 N/m, let go 0.3 m out.
SPRING = """
units = "SI"
[ground]
points = { O = [0, 0] }
[bodies.block]
mass = 1
inertia = 1
points = { P = [0, 0] }
[joints]
guide = { prismatic = ["ground.O", "block.P"] }
[loads]
spring = { spring = ["ground.O", "block.P"], stiffness = 6, free_length = 0 }
[simulate]
until = 5
start.block = { x = 0.3 }
[optimize.back]
minimize = "last(block.x)"
by       = { "spring.stiffness" = [4, 16] }
analysis = "simulate"
until    = "1000 ms"
starts   = 2
"""


def spring():
    return mbody.from_toml(SPRING)


def test_a_smooth_optimum_of_a_motion():
    """x = x₀ cos(√(k/m) t) is least after 1 s where √(k/m) = π; nothing binds, and nothing is
    left to be said of its derivatives.
    """
    found = mbody.optimize(spring(), "back")
    assert found.values["spring.stiffness"] == pytest.approx(math.pi**2, abs=1e-4)
    assert found.objective == pytest.approx(-0.3, rel=1e-9)
    assert found.agreeing == found.starts == 2 and not found.active and not found.notes


@pytest.mark.slow
def test_a_limit_of_a_motion_binds():
    """Slower than x₀ ω at all instants: ω = 2.5 / s. The multiplier is d(x₀ cos ω)/d(x₀ ω)."""
    found = mbody.optimize(
        spring(),
        minimize="last(block.x)",
        by={"spring.stiffness": (4.0, 16.0)},
        subject_to="peak(block.vx) <= 0.75 m/s",
        analysis="simulate",
        until=1.0,
        instants=401,
        starts=1,
    )
    # the greatest speed between instants 2.5 ms apart is at most (ω Δt/2)²/2 = 5e-6 greater
    assert found.values["spring.stiffness"] == pytest.approx(6.25, rel=2e-5)
    (one,) = found.active
    assert one.multiplier == pytest.approx(math.sin(2.5), rel=1e-2)
    assert one.t == pytest.approx(math.pi / 5.0, abs=2.5e-3)


def test_a_motion_of_a_linkage():
    """The mass centre that ends a swing fastest, beside a scan of plain motions."""
    machine = mbody.gallery.load("free_fourbar")
    options = {"until": 0.5, "rtol": 1e-9, "instants": 51}
    by = {"coupler.cg.r": (4.0, 12.0)}
    found = mbody.optimize(
        machine, minimize="last(rocker.omega)", by=by, analysis="simulate", starts=2, **options
    )
    system = mbody.assemble(machine)
    values = []
    for k in range(33):
        run = mbody.simulate(system.with_values({"coupler.cg.r": 4.0 + 0.25 * k}), **options)
        values.append(float(run["rocker"].omega[-1]))
    assert found.objective <= min(values) + 1e-9 * abs(min(values))
    again = mbody.simulate(system.with_values(found.values), **options)
    assert float(again["rocker"].omega[-1]) == pytest.approx(found.objective, rel=1e-6)


def test_the_table_comes_back():
    again = mbody.from_toml(mbody.to_toml(spring()))
    assert mbody.optimize(again, "back").values == mbody.optimize(spring(), "back").values


def test_the_command_takes_a_motion(tmp_path, capsys):
    path = tmp_path / "spring.toml"
    path.write_text(SPRING)
    words = ["--minimize", "last(block.x)", "--by", "spring.stiffness=4:16", "--starts", "1"]
    words += ["--analysis", "simulate", "--until", "1 s"]
    assert main(["optimize", str(path), *words]) == 0
    assert "9.869" in capsys.readouterr().out


def test_a_motion_that_ends_at_another_time():
    """Designs whose motion is ended elsewhere than that of the description have other instants."""
    with pytest.raises(SolveError, match="the motion ends at t = "):
        mbody.optimize(
            spring(),
            minimize="last(block.x)",
            by={"spring.stiffness": (10.0, 16.0)},
            analysis="simulate",
            until=0.6,
            events=[Event("block.x", stop=True)],
            starts=1,
        )


def test_two_turns():
    """A load over two turns: the work of a cycle by `turns` in a file."""
    machine = makers.four_bar(1, 3, 2, 3.5, masses=(1, 3, 2), speed=10.0)
    machine.add(Gravity("g", y=-9.81))
    table = '\n[optimize.two]\nminimize = "rms(motor.effort)"\nby = { "coupler.cg.x" = [0, 3] }\n'
    text = mbody.to_toml(machine) + table + 'over = "turn"\nturns = 2\ninstants = 41\nstarts = 1\n'
    found = mbody.optimize(mbody.from_toml(text), "two")
    assert float(found.run["crank"].angle[-1] - found.run["crank"].angle[0]) == pytest.approx(
        4.0 * math.pi
    )
    once = mbody.optimize(
        machine,
        minimize="rms(motor.effort)",
        by={"coupler.cg.x": (0.0, 3.0)},
        over="turn",
        instants=21,
        starts=1,
    )
    assert found.values["coupler.cg.x"] == pytest.approx(once.values["coupler.cg.x"], rel=0.05)


def test_a_description_beyond_its_bounds_is_said():
    found = mbody.optimize(
        spring(),
        minimize="last(block.x)",
        by={"spring.stiffness": (7.0, 16.0)},
        analysis="simulate",
        until=1.0,
        starts=1,
    )
    assert found.notes == (
        "'spring.stiffness' is 6 N/m in the description, beyond its bounds: the first search "
        "begins at 7 N/m",
    )

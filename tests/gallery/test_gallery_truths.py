"""The gallery: every model agrees with a closed form."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import mbody
from mbody import gallery
from tests.support.gallery_runs import asked, run

pytestmark = pytest.mark.processor

ROUNDING = 1e-13  # some hundred roundings of 2.2e-16: positions of one loop, closed to rounding
# a sweep accepts a last correction of 1e-12 of the size; times the condition of the loops, below 10
SWEEP = 1e-11


def turn(name, count=720):
    """A whole turn, its end left out: crank angles (count,), and what takes histories to it."""
    found = mbody.kinetostatics(gallery.load(name), turn=True, instants=count + 1)
    return found, found["crank"].angle[:-1], lambda history: history[:-1]


def rate(values):
    """Derivative by the crank angle of a periodic history over an even turn, by Fourier series.

    The histories are analytic: with 720 instants what the series leaves out is below rounding.
    """
    waves = np.fft.rfft(values)
    return np.fft.irfft(1j * np.arange(waves.size) * waves, len(values))


def meet(p, r, q, s, side):
    """Where circles about p and q meet: the corner left (+1) or right (−1) of the way p → q."""
    way = q - p
    along = 0.5 * (1.0 + (r * r - s * s) / abs(way) ** 2)
    return p + way * (along + 1j * side * np.sqrt(r * r / abs(way) ** 2 - along**2))


def turning(way):
    """Continuous angle of a vector."""
    return np.unwrap(np.angle(way))


def torque(omega, links, power=0.0):
    """Torque at a constant speed from energy alone: T ω = dE/dt − power of the loads.

    Links are (mass, inertia, mass centre, angle) over a turn.
    """
    energy = sum(
        0.5 * m * abs(rate(c.real) + 1j * rate(c.imag)) ** 2 + 0.5 * inertia * rate(angle) ** 2
        for m, inertia, c, angle in links
    )
    return omega**2 * rate(energy) - power / omega


def at(run, place):
    point = run.point(place)
    return point.x + 1j * point.y


def test_rotating_mass():
    """Newton: m r ω² towards the centre."""
    found = run("rotating_mass")
    pin, u = found.reaction("O", on="link"), np.exp(1j * found["link"].angle)
    assert_allclose(pin.fx + 1j * pin.fy, -2.0 * 0.3 * 20.0**2 * u, atol=240.0 * ROUNDING)
    assert_allclose(found.effort("motor"), 0.0, atol=0.3 * 240.0 * ROUNDING)


def test_slider_crank():
    """Statics of piston and rod with −m a, the piston's acceleration from the loop by hand."""
    found = run("slider_crank")
    r, l, theta, omega = 0.3, 1.2, math.radians(60.0), 250.0 * math.pi / 30.0
    s = r / l * math.sin(theta)
    c = math.sqrt(1.0 - s * s)
    psi1 = r / l * omega * math.cos(theta) / c
    psi2 = (psi1**2 - omega**2) * s / c
    a = -r * omega**2 * math.cos(theta) - l * (psi2 * s + psi1**2 * c)
    force = 0.35e6 * math.pi / 4.0 * 0.5**2 + 250.0 * a  # on the pin, towards the crank
    moment = r * force / c * math.sin(theta + math.asin(s))
    assert moment == pytest.approx(14489.51798560644, rel=ROUNDING)  # in quadruple precision
    assert_allclose(-found.effort("motor"), moment, rtol=ROUNDING)
    assert_allclose(found.reaction("B").magnitude, force / c, rtol=ROUNDING)
    assert_allclose(found.reaction("guide", on="slider").fy, force * s / c, rtol=ROUNDING)
    # the note: a good quarter of the gas load goes into the piston
    assert 0.25 < 1.0 - force / (0.35e6 * math.pi / 4.0 * 0.5**2) < 0.3


def test_peaucellier():
    """Inversion of a circle through O: x = (5² − 3²)/(2 · 1.5), y = x tan(θ/2)."""
    found = run("peaucellier")
    Q, half = found.point("QA.Q"), 0.5 * found["crank"].angle
    line = (5.0**2 - 3.0**2) / (2.0 * 1.5)
    assert_allclose(np.degrees(2.0 * half), np.arange(-90.0, 91.0, 30.0), atol=1e-11)
    # at ±90° the rhombus is near flat, 0.26 rad: the law of cosines loses that factor
    small = 5.0 * ROUNDING / 0.26
    assert_allclose(Q.x, line, atol=small)
    assert_allclose(Q.y, line * np.tan(half), atol=small)
    assert_allclose(Q.vx / np.abs(Q.vy).max(), 0.0, atol=small)
    # virtual work: T dθ + 5 N dy = 0, and the 10 N across the line do none
    alone = found.breakdown("motor")
    assert_allclose(alone["across"], 0.0, atol=10.0 * small)
    assert_allclose(found.effort("motor"), -5.0 * line / 2.0 / np.cos(half) ** 2, rtol=1e-12)


@pytest.mark.parametrize("a", [40.0, 7.5])
def test_hoekens(a):
    """Both coordinates of the tracer in closed form, c = cos θ (validation/straight_lines)."""
    found = asked(gallery.load("hoekens", {"a": a}))
    P, c = found.point("coupler.P"), np.cos(found["crank"].angle)
    assert_allclose(P.y**2, a**2 * 4 * (5 + c) * (2 - c) ** 2 / (5 - 4 * c), rtol=SWEEP)
    wanted = a**2 * 4 * (5 + c) * (1 - c * c) / (5 - 4 * c)
    assert_allclose((P.x - 2 * a) ** 2, wanted, atol=25 * a**2 * SWEEP)
    # the half turn of the line: from 4 to 7√21/8, which is at c = −5/8, between two instants
    line = P.y[np.abs(c + 0.5) <= 0.5 + 1e-12] / a
    assert line.min() == pytest.approx(4.0, abs=5 * SWEEP)
    highest = 7.0 * math.sqrt(21.0) / 8.0
    # half a degree beside the top: y″/2 of the closed form is below 0.1
    assert highest - 0.1 * math.radians(0.5) ** 2 < line.max() <= highest + 5 * SWEEP
    assert highest - 4.0 < 0.01  # the note


def watt():
    """Centres and angles of the links over a turn, by circles that meet."""
    found, theta, cut = turn("watt_sixbar")
    A = 50.0 * np.exp(1j * theta)
    B = meet(A, 110.0, 120.0, 70.0, 1)
    bell = (B - 120.0) / 70.0
    C = 120.0 - 120j * bell
    D = meet(C, 80.0, 180.0, 50.0, 1)
    return SimpleNamespace(found=found, cut=cut, A=A, B=B, bell=bell, C=C, D=D)


def test_watt_positions():
    w = watt()
    for place, hand in (("coupler.B", w.B), ("rocker.C", w.C), ("output.D", w.D)):
        assert_allclose(w.cut(at(w.found, place)), hand, atol=240.0 * SWEEP)
    swings = [np.degrees(np.ptp(w.found[link].angle)) for link in ("rocker", "output")]
    assert [round(swing) for swing in swings] == [91, 186]  # the note


def test_watt_torque():
    w, omega = watt(), 2.0 * math.pi
    output = turning(w.D - 180.0)
    links = [  # tonnes and mm
        (3e-4, 0.3, (w.A + w.B) / 2.0, turning(w.B - w.A)),
        (6e-4, 1.2, 120.0 + (20.0 - 40j) * w.bell, turning(w.bell)),
        (2e-4, 0.1, (w.C + w.D) / 2.0, turning(w.D - w.C)),
        (5e-4, 0.8, 180.0 + 0.0 * w.D, output),
    ]
    by_energy = torque(omega, links, power=-2000.0 * omega * rate(output))
    effort = w.cut(w.found.effort("motor"))
    # two derivatives of a series of 720: 360² × 2.2e-16, and the sweep's own
    assert_allclose(effort, by_energy, atol=1e-9 * np.abs(effort).max())


def stephenson():
    """Places of the links over a turn, by circles that meet."""
    found, theta, cut = turn("stephenson_sixbar")
    A = 40.0 * np.exp(1j * theta)
    B = meet(A, 90.0, 90.0, 90.0, 1)
    u = (B - A) / 90.0
    P = A + 180.0 * math.cos(math.radians(25.0)) * np.exp(1j * math.radians(25.0)) * u
    D = meet(P, 202.0, 70.0 - 30j, math.hypot(30.0, 9.0), 1)
    return SimpleNamespace(found=found, theta=theta, cut=cut, A=A, B=B, u=u, P=P, D=D)


def test_stephenson_positions_and_dwell():
    s = stephenson()
    for place, hand in (("coupler.B", s.B), ("coupler.P", s.P), ("output.D", s.D)):
        assert_allclose(s.cut(at(s.found, place)), hand, atol=200.0 * SWEEP)
    output = np.degrees(s.found["output"].angle)
    dwell = output[np.degrees(s.found["crank"].angle) <= 60.0]
    # the note: still for a third of the turn, to a hundredth of its swing
    assert np.ptp(dwell) < 0.011 * np.ptp(output) < 0.25


def test_stephenson_torque():
    s, omega = stephenson(), 2.0 * math.pi
    links = [
        (5e-4, 1.0, s.A + (80.0 + 25j) * s.u, turning(s.u)),
        (3e-4, 0.2, (90.0 + s.B) / 2.0, turning(s.B - 90.0)),
        (4e-4, 1.4, (s.P + s.D) / 2.0, turning(s.D - s.P)),
        (1e-3, 2.0, 70.0 - 30j + 0.0 * s.D, turning(s.D - (70.0 - 30j))),
    ]
    effort = s.cut(s.found.effort("motor"))
    # as of Watt's six-bar
    assert_allclose(effort, torque(omega, links), atol=1e-9 * np.abs(effort).max())


def test_cam_follower():
    """The lift by its formula; the contact presses as long as the spring is what it is."""
    found = run("cam_follower")
    theta = found["shaft"].angle
    up, down = (
        np.clip((theta - np.pi / 3.0) / (2.0 * np.pi / 3.0), 0, 1),
        np.clip((theta - 7.0 * np.pi / 6.0) / (np.pi / 2.0), 0, 1),
    )
    lift = up - np.sin(2.0 * np.pi * up) / (2.0 * np.pi)
    lift -= 10.0 * down**3 - 15.0 * down**4 + 6.0 * down**5
    assert_allclose(found["follower"].y, 50.0 + 20.0 * lift, atol=50.0 * SWEEP)
    # the spring and the weight hold the follower down, 0.5e-3 t follow the lift
    push = 120.0 + 6.0 * 20.0 * lift + 0.5e-3 * (9810.0 + found["follower"].ay)
    assert_allclose(found.reaction("contact").fy, push, atol=1e-9 * push.max())
    assert (found.contact("contact") > 0.0).all() and not found.notes
    weak = asked(gallery.load("cam_follower", {"preload": "20 N", "rate": "1 N/mm"}))
    assert "would leave 'shaft'" in weak.notes[0]


def test_planetary_train():
    """Willis: the arm turns 1 : 3, so that it has three times the torque; F = T / r_sun."""
    found = run("planetary_train")
    omega = 1500.0 * 2.0 * np.pi / 60.0
    assert_allclose(found["arm"].omega, omega / 3.0, rtol=SWEEP)
    assert_allclose(found["planet"].omega, -omega, rtol=SWEEP)
    assert_allclose(found.effort("motor"), 20e3, rtol=SWEEP)
    assert_allclose(found.measure("tooth"), 20e3 / 40.0, rtol=SWEEP)


def test_quick_return_stroke_and_times():
    """Khurmi: the lever leans sin⁻¹(120/240) = 30° to each side, times 240° : 120°, stroke 450."""
    machine = gallery.load("quick_return")
    ends = mbody.kinematics(machine, t=[0.0, 2.0 * 240.0 / 360.0, 2.0])
    lean = np.degrees(ends["lever"].angle) - 90.0
    assert_allclose(lean, [-30.0, 30.0, -30.0], atol=1e-10)
    assert_allclose(ends["ram"].vx, 0.0, atol=1000.0 * SWEEP)  # mm/s; both are its turning points
    assert_allclose(ends["ram"].x[0] - ends["ram"].x[1], 450.0, rtol=SWEEP)
    found = run("quick_return")
    for begin, end, way in ((0.0, 4.0 / 3.0, -1.0), (4.0 / 3.0, 2.0, 1.0)):
        inside = (found.t > begin + 1e-6) & (found.t < end - 1e-6)
        assert (way * found["ram"].vx[inside] > 0.0).all()


def test_quick_return_torque():
    found, theta, cut = turn("quick_return")
    omega, height = math.pi, 450.0 * math.sqrt(0.75)
    lever = np.angle(240j + 120.0 * np.exp(1j * theta))
    P = 450.0 * np.exp(1j * lever)
    ram = P.real - np.sqrt(200.0**2 - (height - P.imag) ** 2)
    assert_allclose(cut(found["ram"].x), ram, atol=450.0 * SWEEP)
    # the cut rises and falls in a tenth of a second each, by the polynomial 3-4-5
    t = cut(found.t)
    up, down = np.clip(t / 0.1, 0.0, 1.0), np.clip((t - 0.1 - 2.0 * (0.4 + 1.0 / 6.0)) / 0.1, 0, 1)
    force = 2000.0 * sum(s * (10 * x**3 - 15 * x**4 + 6 * x**5) for s, x in ((1, up), (-1, down)))
    inertia = 12e-3 * 450.0**2 / 12.0
    links = [(12e-3, inertia, P / 2.0, lever), (30e-3, 0.0, ram + 1j * height, 0.0 * ram)]
    by_energy = torque(omega, links, power=force * omega * rate(ram))
    effort = cut(found.effort("motor"))
    assert_allclose(effort, by_energy, atol=1e-9 * np.abs(effort).max())  # as of Watt's six-bar


def test_scissor_lift():
    """Virtual work: F dl = dV; V = g L sin θ (2 M + 4 m), l² = 1² + 1.6² − 2 · 1.6 cos θ."""
    machine = gallery.load("scissor_lift")
    found = asked(machine, mbody.statics)
    l = 0.65 + 0.025 * found.t
    theta = np.arccos((1.0 + 1.6**2 - l * l) / 3.2)
    dl = 1.6 * np.sin(theta) / l
    force = 9.81 * 2.0 * np.cos(theta) * (2.0 * 920.0 + 4.0 * 40.0) / dl
    # the first lean is 11°: acos loses 1/sin, 5 times
    assert_allclose(found["a1"].angle, theta, atol=5.0 * ROUNDING)
    assert_allclose(found.point("platform.P").y, 4.0 * np.sin(theta), rtol=10.0 * ROUNDING)
    assert_allclose(found.effort("cylinder"), force, rtol=SWEEP)
    assert (np.diff(force) < 0.0).all()  # hardest at the bottom
    # the platform never turns: where the payload is makes no difference to the cylinder
    moved = asked(gallery.load("scissor_lift", {"place": "1.5 m"}), mbody.statics)
    assert_allclose(moved.effort("cylinder"), force, rtol=SWEEP)
    assert np.abs(moved.reaction("P").fy - found.reaction("P").fy).min() > 1000.0


def test_parallel_cranks():
    """One freedom, one redundant row; T = 3.5 g cos θ, and idle cranks carry half their weight."""
    found, g = run("parallel_cranks"), 9.81
    theta, omega = found["crank1"].angle, math.radians(60.0)
    small = 5.0 * g * SWEEP
    assert_allclose(found.effort("motor"), 3.5 * g * np.cos(theta), atol=small)
    pins = [found.reaction(f"A{k}", on=f"crank{k}") for k in (1, 2, 3)]
    forces = [(pin.fx + 1j * pin.fy) * np.exp(-1j * theta) for pin in pins]  # along, across
    for force, across in zip(forces, (-3.0, 0.5, 0.5), strict=True):
        assert_allclose(force.imag, across * g * np.cos(theta), atol=small)
    # along the cranks only the sum is known: 2 kg on a circle of 1 m under their weight …
    whole = sum(force.real for force in forces)
    assert_allclose(whole, 2.0 * omega**2 - 2.0 * g * np.sin(theta), atol=small)
    # … and that the coupler does not turn; (1, −2, 1) of any size stays open
    assert_allclose(pins[0].fy, pins[2].fy, atol=small)
    assert [pin.unique for pin in pins] == [(False, False, True)] * 3


@pytest.mark.parametrize(("r", "rpm"), [(0.2, 126.5008315355888), (0.25, 146.89354367518698)])
def test_porter_governor(r, rpm):
    """ω² = (m + M) g/(m h), h² = l² − r²: the driver has nothing to do at either radius."""
    found = asked(gallery.load("porter_governor", {"r": f"{r} m", "omega": f"{rpm!r} rpm"}))
    assert (rpm * math.pi / 30.0) ** 2 == pytest.approx(4.0 * 9.81 / math.sqrt(0.09 - r * r))
    assert_allclose(found.measure("radius"), r, rtol=SWEEP)
    assert_allclose(found.effort("theta"), 0.0, atol=6.0 * 9.81 * SWEEP)

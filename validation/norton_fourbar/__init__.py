"""Four-bar, dynamic force analysis: Norton, *Design of Machinery*, example 11-3."""

from __future__ import annotations

import math

import numpy as np

import mbody
from validation.case import Row, Source, degrees
from validation.norton_fourbar import newton_euler

__all__ = ["build", "forces", "rows"]

BOOK = Source("norton_fourbar", "Norton, Design of Machinery, ex. 11-3, print")
EXACT = Source("norton_fourbar", "Norton ex. 11-3 with masses W/g, recomputed independently")
BY_HAND = Source("norton_fourbar", "nine Newton-Euler equations by hand, newton_euler.py")
NATURE = Source("norton_fourbar", "principle of virtual work")

#: Models of the gallery by their masses: weights by g, and as the book rounds them.
MODELS = {"exact": "norton_fourbar", "printed": "norton_fourbar_printed"}

# the book's F_ij, force of link i on link j: the joint, and link j
PINS = {
    "F12": ("O2", "crank"),
    "F32": ("A", "crank"),
    "F43": ("B", "coupler"),
    "F14": ("O4", "rocker"),
}
LINKS = {2: "crank", 3: "coupler", 4: "rocker"}

PRINT = {  # components; magnitude @ direction [deg]
    "F12": ("-117.65", "-107.84", "159.60", "222.52"),
    "F32": ("118.13", "100.34", "154.99", "40.35"),
    "F43": ("-1.34", "87.43", "87.44", "90.88"),
    "F14": ("-20.23", "77.71", "80.30", "104.59"),
}
PRINT_T12 = "243.23"
PRINT_MOTION = {  # θ [deg], ω [rad/s], α [rad/s²]
    3: ("20.92", "-5.87", "120.9"),
    4: ("104.41", "7.93", "276.29"),
}
PRINT_AG = {2: ("1878.84", "273.66"), 3: ("3646.10", "226.51"), 4: ("1416.80", "207.24")}

EXACT_FORCES = {
    "F12": (-117.55959232776144, -107.4585265485302),
    "F32": (118.02591357128473, 100.17225711847838),
    "F43": (-1.3095628736696991, 87.40148615519001),
    "F14": (-20.23782406161011, 77.6581310210478),
}
EXACT_T12 = 243.23759076122965
EXACT_MOTION = {
    3: (20.917224866506565, -5.869354068454685, 120.89684543729135),
    4: (104.40972127476182, 7.931634292031015, 276.28909907606595),
}
EXACT_AG = {
    2: (1878.8360758725069, 273.6619355755198),
    3: (3646.100065542985, 226.51379837346462),
    4: (1416.804837135667, 207.2372232313552),
}
UNITS = ("deg", "rad/s", "rad/s²")


def build(masses: str = "exact") -> mbody.Mechanism:
    """The four-bar of the example."""
    return mbody.gallery.load(MODELS[masses])


def forces(run: mbody.Solution) -> np.ndarray:
    """The nine unknowns of eq. 11.9, (9, instants)."""
    pins = [run.reaction(joint, on=link) for joint, link in PINS.values()]
    return np.array([*(f for pin in pins for f in (pin.fx, pin.fy)), run.effort("motor")])


def motion(run: mbody.Solution, link: int) -> tuple[float, float, float]:
    """θ [deg], ω, α of a link at the first instant."""
    body = run[LINKS[link]]
    return math.degrees(body.angle[0]), body.omega[0], body.alpha[0]


def rows() -> list[Row]:
    return [*exact_masses(), *printed_masses(), *whole_turn()]


def exact_masses() -> list[Row]:
    """At 60°, masses W/g."""
    # the smallest component, F43x, is 1/120 of the greatest
    reason = "2.2e-16 × condition 70 of the nine equations × 120, as F43x is so small"
    run = mbody.kinetostatics(build("exact"))
    found = []

    def row(quantity: str, ours: float, reference: float, unit: str) -> None:
        found.append(EXACT.relative(f"{quantity}, exact", ours, reference, 2e-12, reason, unit))

    for name, (joint, link) in PINS.items():
        pin = run.reaction(joint, on=link)
        for axis, ours, reference in zip("xy", (pin.fx, pin.fy), EXACT_FORCES[name]):
            row(f"{name}{axis}", ours, reference, "lbf")
    row("T12", run.effort("motor"), EXACT_T12, "lbf·in")
    for n, reference in EXACT_MOTION.items():
        for letter, ours, exact, unit in zip("θωα", motion(run, n), reference, UNITS):
            row(f"{letter}{n}", ours, exact, unit)
    for n, (size, direction) in EXACT_AG.items():
        body = run[LINKS[n]]
        row(f"a_G{n}", np.hypot(body.ax, body.ay), size, "in/s²")
        row(f"direction of a_G{n}", degrees(body.ax, body.ay), direction, "deg")
    return found


def printed_masses() -> list[Row]:
    """At 60°, the masses that the book rounds to 0.004, 0.020, 0.015 blob: all that it prints."""
    run = mbody.kinetostatics(build("printed"))
    cause = "the book rounds its masses to 0.004, 0.020, 0.015 blob: ours has them here, W/g above"
    found = []
    for name, (joint, link) in PINS.items():
        pin = run.reaction(joint, on=link)
        x, y, size, direction = PRINT[name]
        found += [
            BOOK.printed(f"{name}x", pin.fx, x, "lbf", cause=cause),
            BOOK.printed(f"{name}y", pin.fy, y, "lbf", cause=cause),
            BOOK.printed(name, pin.magnitude, size, "lbf", cause=cause),
        ]
        ours = np.degrees(pin.direction)
        if name == "F12":
            found += direction_of_F12(ours)
        else:
            found.append(BOOK.printed(f"direction of {name}", ours, direction, "deg", cause=cause))
    found.append(BOOK.printed("T12", run.effort("motor"), PRINT_T12, "lbf·in", cause=cause))
    for n, texts in PRINT_MOTION.items():
        for letter, ours, text, unit in zip("θωα", motion(run, n), texts, UNITS):
            found.append(BOOK.printed(f"{letter}{n}", ours, text, unit))
    for n, (size, direction) in PRINT_AG.items():
        body = run[LINKS[n]]
        found += [
            BOOK.printed(f"a_G{n}", np.hypot(body.ax, body.ay), size, "in/s²"),
            BOOK.printed(f"direction of a_G{n}", degrees(body.ax, body.ay), direction, "deg"),
        ]
    return found


def direction_of_F12(ours: np.ndarray) -> list[Row]:
    """The print's 222.52° is not the direction of its own components: both are shown."""
    x, y, _, direction = PRINT["F12"]
    pointing = degrees(float(x), float(y))
    rounding = math.degrees(math.hypot(0.005, 0.005) / 159.6)
    off = abs(float(direction) - pointing)
    return [
        BOOK.printed(
            "direction of F12",
            ours,
            direction,
            "deg",
            tolerance=off + rounding,
            reason=f"how far the print is from its own components, {off:.4f}°, and their rounding",
            cause=f"the print contradicts itself: its components ({x}, {y}) point to "
            f"{pointing:.3f}°",
        ),
        BOOK.absolute(
            "direction of F12, from the printed components",
            ours,
            pointing,
            rounding,
            "both components rounded by 0.005 lbf turn a force of 159.6 lbf by so much",
            "deg",
        ),
    ]


def whole_turn() -> list[Row]:
    """3600 positions: along the law in time, and each with ω₂ = 25, α₂ = −40."""
    system = mbody.assemble(build("exact"))
    turned = np.linspace(0.0, 2.0 * math.pi, 3600)
    theta2 = math.radians(60.0) + turned
    # ω₂² = 25² − 2 · 40 Δθ₂ as the crank slows down
    along = mbody.kinetostatics(system, turn="motor", instants=3600)
    found = compare("along the law", along, np.sqrt(25.0**2 - 80.0 * turned))
    same = mbody.kinetostatics(system, drive={"motor": (theta2, 25.0, -40.0)})
    return [*found, *compare("each at ω2 = 25", same, np.full(3600, 25.0))]


def compare(turn: str, run: mbody.Solution, omega2: np.ndarray) -> list[Row]:
    """Every reaction against the equations by hand, and the power balance."""
    theta2 = math.radians(60.0) + np.linspace(0.0, 2.0 * math.pi, 3600)
    ours, by_hand = forces(run), newton_euler.forces(newton_euler.motion(theta2, omega2, -40.0))
    reason = "of the peak; loops closed to 1e-13 × condition of the nine equations, at most 110"
    parts = {name: slice(2 * k, 2 * k + 2) for k, name in enumerate(PINS)} | {"T12": slice(8, 9)}
    found = []
    for name, part in parts.items():
        unit = "lbf·in" if name == "T12" else "lbf"
        quantity = f"{name}, 3600 positions, {turn}"
        found.append(BY_HAND.relative(quantity, ours[part], by_hand[part], 1.1e-11, reason, unit))
    reason = "part of the peak power; loops closed to 1e-13 × condition 110, at most"
    work = run.checks.virtual_work
    return [*found, NATURE.absolute(f"virtual work, {turn}", work, 0.0, 1.1e-11, reason)]

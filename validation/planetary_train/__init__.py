"""A planetary train with any of its members fixed: speeds by Willis, torques by equilibrium."""

from __future__ import annotations

import numpy as np

import mbody
from validation.case import Row, Source

__all__ = ["build", "rows"]

WILLIS = Source("planetary_train", "Willis: (ω_ring − ω_arm) / (ω_sun − ω_arm) = −N_sun / N_ring")
STATICS = Source(
    "planetary_train", "equilibrium: T_sun : T_ring : T_arm = N_s : N_r : −(N_s + N_r)"
)
TWO_CARRIERS = Source("planetary_train", "the train seen from its arm: two pairs of plain gears")

N_SUN, N_PLANET, N_RING = 40, 20, 80
MODULE = 0.002  # m: pitch diameter by number of teeth
LOAD = 120.0  # N·m
SPEED = 30.0  # rad/s
ROUNDING = (
    1e-12,
    "of the greatest; a position accepts a last correction of 1e-12 × condition, below 10, on "
    "speeds that follow from constant ratios",
)


def radius(teeth: int) -> float:
    """Of a pitch circle [m]."""
    return 0.5 * MODULE * teeth


def build(held: str = "ring", driven: str = "sun") -> mbody.Mechanism:
    """Sun, planet on an arm, ring: one of them is fixed, one driven, the third carries the load."""
    loaded = ({"sun", "ring", "arm"} - {held, driven}).pop()
    reach = radius(N_SUN) + radius(N_PLANET)
    machine = mbody.Mechanism(f"planetary train, {driven} drives, {held} held")
    machine.add(
        mbody.Body("sun", mass=1.0, inertia=2e-4),
        mbody.Body("arm", mass=1.0, inertia=1e-3, points={"P": (reach, 0.0)}),
        mbody.Body("planet", mass=0.3, inertia=3e-5),
        mbody.Body("ring", mass=2.0, inertia=5e-3),
        mbody.Revolute("S", "ground", "sun"),
        mbody.Revolute("A", "ground", "arm"),
        mbody.Revolute("R", "ground", "ring"),
        mbody.Revolute("P", "arm.P", "planet"),
        mbody.Gear("inner", "sun", "planet", radius(N_SUN), radius(N_PLANET)),
        mbody.Gear("outer", "ring", "planet", radius(N_RING), radius(N_PLANET), internal=True),
        mbody.AngleDriver("brake", held, 0.0),
        mbody.AngleDriver("motor", driven, mbody.laws.ConstantSpeed(0.0, SPEED)),
        mbody.Torque("load", loaded, value=-LOAD),
    )
    return machine


def willis(held: str, driven: str) -> dict[str, float]:
    """Speeds [rad/s]: N_s ω_s + N_r ω_r = (N_s + N_r) ω_a, the fixed one 0, the driven given."""
    weights = {"sun": N_SUN, "ring": N_RING, "arm": -(N_SUN + N_RING)}
    loaded = ({*weights} - {held, driven}).pop()
    speeds = {held: 0.0, driven: SPEED, loaded: -weights[driven] * SPEED / weights[loaded]}
    # the planet rolls on the sun
    speeds["planet"] = speeds["arm"] - N_SUN / N_PLANET * (speeds["sun"] - speeds["arm"])
    return speeds


def rows() -> list[Row]:
    pairs = [(a, b) for a in ("ring", "arm", "sun") for b in ("sun", "arm", "ring") if a != b]
    return [row for held, driven in pairs for row in of_train(held, driven)]


def of_train(held: str, driven: str) -> list[Row]:
    """All rows of one way to use it."""
    run = mbody.kinetostatics(build(held, driven), t=np.linspace(0.0, 1.0, 11))
    name = f"{driven} drives, {held} held: "
    speeds = willis(held, driven)
    ours = [run[body].omega for body in speeds]
    wanted = [np.full(11, speed) for speed in speeds.values()]
    parts = {"sun": N_SUN, "ring": N_RING, "arm": -(N_SUN + N_RING)}
    loaded = ({*parts} - {held, driven}).pop()
    torques = {body: parts[body] / parts[loaded] * -LOAD for body in (held, driven)}
    found = [
        WILLIS.relative(name + "speeds", ours, wanted, *ROUNDING, "rad/s"),
        STATICS.relative(
            name + "driving torque", run.effort("motor"), torques[driven], *ROUNDING, "N·m"
        ),
        STATICS.relative(
            name + "holding torque", run.effort("brake"), torques[held], *ROUNDING, "N·m"
        ),
    ]
    tooth = abs(LOAD / parts[loaded]) * N_SUN / radius(N_SUN)
    for mesh in ("inner", "outer"):
        force = run.reaction(mesh).magnitude
        found.append(
            TWO_CARRIERS.relative(f"{name}tooth force, {mesh}", force, tooth, *ROUNDING, "N")
        )
    return found

"""A ball above a floor and a row of blocks on a line, for events and impacts."""

from mbody import Body, Gravity, Mechanism, Prismatic, SimulationSettings

G = 9.81


def ball(height=1.0, **start):
    """2 kg at rest in the air, or as it is said."""
    machine = Mechanism("ball")
    machine.add(
        Body("ball", mass=2.0, inertia=0.3, guess=(0.0, height, 0.0)), Gravity("gravity", y=-G)
    )
    machine.simulation = SimulationSettings(1.0, {"ball": {"y": height, **start}})
    return machine


def blocks(*places, speed=1.0):
    """Blocks of 1 kg on one line, the first moving."""
    machine = Mechanism("blocks")
    for n, place in enumerate(places):
        machine.add(
            Body(f"b{n}", mass=1.0, guess=(place, 0.0, 0.0)), Prismatic(f"g{n}", "ground", f"b{n}")
        )
    machine.simulation = SimulationSettings(
        1.0, {f"b{n}": {"x": x, "vx": 0.0 if n else speed} for n, x in enumerate(places)}
    )
    return machine

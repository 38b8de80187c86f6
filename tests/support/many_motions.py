"""Mechanisms with inputs for tests of many motions."""

import mbody


def driven_four_bar() -> mbody.Mechanism:
    machine = mbody.gallery.load("free_fourbar")
    machine.add(mbody.Input("u", "0 lbf*in"), mbody.Torque("motor", "crank", value="u"))
    return machine


def cart_pole() -> mbody.Mechanism:
    machine = mbody.Mechanism("cart-pole")
    machine.add(
        mbody.Body("cart", mass=1.0, inertia=0.1, cg=(0, 0), points={"P": (0, 0)}, guess=0.0),
        mbody.Body("pole", mass=0.1, inertia=0.00833, cg=(0, 0.5), points={"P": (0, 0)}, guess=0.0),
        mbody.Prismatic("rail", "ground", "cart"),
        mbody.Revolute("P", "cart.P", "pole.P"),
        mbody.Gravity("gravity", y=-9.81),
        mbody.Input("u", "0 N"),
        mbody.Force("push", "cart.P", value="u"),
    )
    return machine


def parallelogram() -> mbody.Mechanism:
    """Two equal cranks and a coupler as long as the ground, without loads."""
    machine = mbody.Mechanism("parallelogram", ground={"D": (3.0, 0.0)})
    arm = {"cg": (0.5, 0.0), "points": {"E": (1.0, 0.0)}, "guess": 0.5}
    long = {"cg": (1.5, 0.0), "points": {"E": (3.0, 0.0)}, "guess": 0.0}
    machine.add(
        mbody.Body("crank", mass=1.0, inertia=0.1, **arm),
        mbody.Body("coupler", mass=3.0, inertia=2.0, **long),
        mbody.Body("rocker", mass=1.0, inertia=0.1, **arm),
        mbody.Revolute("O", "ground", "crank"),
        mbody.Revolute("A", "crank.E", "coupler"),
        mbody.Revolute("B", "coupler.E", "rocker.E"),
        mbody.Revolute("D", "ground.D", "rocker"),
    )
    return machine


#: What an environment of the cart-pole is.
TASK = {
    "actions": {"u": ("-10 N", "10 N")},
    "observations": ["cart.x", "cart.vx", "pole.angle", "pole.omega"],
    "reward": "cos(pole.angle)",
    "step": "10 ms",
    "frame_skip": 2,
    "terminated": ["abs(pole.angle) > 24 deg", "abs(cart.x) > 2.4 m"],
    "max_steps": 60,
    "reset": {"cart.x": (-0.05, 0.05), "pole.angle": ("-5 deg", "5 deg")},
    "method": "dopri5",
    "rtol": 1e-6,
}

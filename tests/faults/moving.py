"""Small mechanisms in motion, each with one kind of load or of friction on which faults show."""

import mbody
from mbody.laws import Cam, Dwell, Rise, Table
from mbody.model.contact import Between

__all__ = ["MOVING"]


def turner(*loads, w=3.0, until=0.3, inertia=0.5, **k):
    """A link that turns, under loads."""
    m = mbody.Mechanism("turner", ground={"O": (0, 0), "S": (0.5, 1.0)})
    m.add(
        mbody.Body(
            "r", mass=2.0, inertia=inertia, cg=(0.1, 0.02), points={"O": (0, 0), "A": (0.4, 0.1)}
        ),
        mbody.Revolute("O", "ground.O", "r.O", **k),
        mbody.Gravity("g", y=-9.81),
        *loads,
    )
    m.simulation = mbody.SimulationSettings(until=until, start={"r": dict(angle=0.2, omega=w)})
    return m


def slider(*loads, v=1.0, until=0.3, mass=2.0, **k):
    """A block on a rail."""
    m = mbody.Mechanism("slider", ground={"O": (-1.0, 0.2)})
    m.add(
        mbody.Body("s", mass=mass, inertia=0.5, cg=(0.05, 0.02), points={"A": (0.1, 0.05)}),
        mbody.Prismatic("rail", "ground", "s", **k),
        mbody.Gravity("g", y=-9.81),
        *loads,
    )
    m.simulation = mbody.SimulationSettings(until=until, start={"s": dict(x=0.1, vx=v)})
    return m


def two(*more, until=0.4, wa=5.0, wb=0.0, d=0.8):
    """Two wheels on shafts."""
    m = mbody.Mechanism("two", ground={"P": (0, 0), "Q": (d, 0)})
    m.add(
        mbody.Body("a", mass=1, inertia=0.5, points={"O": (0, 0)}),
        mbody.Body("b", mass=1, inertia=0.2, points={"O": (0, 0)}),
        mbody.Revolute("P", "ground.P", "a.O"),
        mbody.Revolute("Q", "ground.Q", "b.O"),
        *more,
    )
    m.simulation = mbody.SimulationSettings(
        until=until, start={"a": dict(angle=0.0, omega=wa), "b": dict(angle=0.0, omega=wb)}
    )
    return m


def wheel(*more, **start):
    """A wheel on a road."""
    m = mbody.Mechanism("wheel", ground={"O": (0, 0)})
    m.add(
        mbody.Body("w", mass=3.0, inertia=0.1, points={"C": (0, 0)}),
        mbody.Gravity("g", y=-9.81),
        *more,
    )
    m.simulation = mbody.SimulationSettings(until=0.3, start={"w": start})
    return m


def driven(law):
    """A link moved by a law, and a pendulum on it that is free."""
    made = mbody.Mechanism("driven", ground={"O": (0, 0)})
    made.add(
        mbody.Body("r", mass=2.0, inertia=0.5, points={"A": (0.4, 0.1)}),
        mbody.Body("p", mass=1.0, inertia=0.1, cg=(0.3, 0.0)),
        mbody.Revolute("O", "ground.O", "r"),
        mbody.Revolute("A", "r.A", "p"),
        mbody.Gravity("g", y=-9.81),
        mbody.AngleDriver("motor", "r", law),
    )
    made.simulation = mbody.SimulationSettings(until=0.6, start={"p": dict(angle=0.2, omega=0.0)})
    return made


def tied(*more, **start):
    """A wheel that falls, held by something."""
    return wheel(*more, **{"angle": 0.0, "omega": 0.0, "vx": 0.0, "vy": 0.0} | start)


def disc(body, *more, friction=0.0, static=None, restitution=0.0, **start):
    """A disc on a floor."""
    made = mbody.Mechanism(
        "disc", ground={"O": (0, 0)}, ground_shapes={"floor": {"line": {"point": "O"}}}
    )
    rim = {"rim": {"disc": "C", "radius": 0.3}}
    touches = mbody.Contact(
        *("floor", "ground.floor", f"{body}.rim"),
        friction=friction,
        static=static,
        restitution=restitution,
    )
    made.add(
        mbody.Body(body, mass=3.0, inertia=0.1, points={"C": (0, 0)}, shapes=rim),
        mbody.Gravity("g", y=-9.81),
        touches,
        *more,
    )
    begins = {"x": 0.0, "angle": 0.0, "vx": 0.0, "vy": 0.0, "omega": 0.0} | start
    made.simulation = mbody.SimulationSettings(until=0.4, start={body: begins})
    return made


def heap():
    """Two discs on a floor, one of which strikes the other: contacts of groups."""
    floor = {"floor": {"line": {"point": "O"}}}
    made = mbody.Mechanism("heap", ground={"O": (0, 0)}, ground_shapes=floor)
    for name in "ab":
        rim = {"rim": {"disc": "C", "radius": 0.3}}
        made.add(mbody.Body(name, mass=2.0, inertia=0.1, points={"C": (0, 0)}, shapes=rim))
    made.add(
        mbody.Gravity("g", y=-9.81),
        Between("pile", "ground.floor", "*.rim", friction=0.4),
        Between("pair", "*.rim", "*.rim", friction=0.4),
    )
    start = {"a": dict(x=0.0, y=0.3, vx=1.0), "b": dict(x=0.7, y=0.3)}
    made.simulation = mbody.SimulationSettings(until=0.3, start=start)
    return made


OIL = dict(
    bore="50 mm",
    rod="28 mm",
    closed="0.5 m",
    stroke="0.9 m",
    flow="40 l/min",
    drop="5 bar",
    supply="160 bar",
    tank="2 bar",
    bulk_modulus="1.4 GPa",
    dead_volume="50 cm^3",
    start_a="20 bar",
    start_b="30 bar",
)
PULLEYS = dict(radius_i=0.1, radius_j=0.25, distance=0.8, friction=0.3)
TYRE = dict(
    radius=0.3,
    stiffness=2e5,
    friction=0.9,
    steepness=10.0,
    relaxation=0.3,
    damping=100.0,
    shape=1.6,
    curvature=0.3,
)
MOVING = {
    "dc": lambda: turner(
        mbody.DCMotor(
            "m",
            "r",
            voltage="12 V*cos(20*t)",
            resistance=0.5,
            inductance=1e-2,
            constant=0.1,
            ratio=3.0,
        )
    ),
    "im": lambda: turner(
        mbody.InductionMotor(
            "m", "r", synchronous=157.0, breakdown_torque=40.0, breakdown_slip=0.15, ratio=2.0
        )
    ),
    "im_star": lambda: turner(
        mbody.InductionMotor(
            "m", "r", synchronous=-157.0, breakdown_torque=40.0, breakdown_slip=0.15, star_until=0.1
        )
    ),
    "im_below": lambda: turner(
        mbody.InductionMotor(
            "m",
            "r",
            synchronous=157.0,
            breakdown_torque=400.0,
            breakdown_slip=0.15,
            star_below=30.0,
        )
    ),
    "actuator": lambda: slider(
        mbody.Actuator("m", "ground.O", "s.A", push="30*sin(20*t)", dead_band=5.0, limit=20.0)
    ),
    "actuator_lag": lambda: slider(
        mbody.Actuator(
            "m",
            "ground.O",
            "s.A",
            push="-50*s.x+9",
            dead_band=5.0,
            limit=20.0,
            lag=0.02,
            slew=400.0,
        )
    ),
    "hyd": lambda: slider(
        mbody.HydraulicCylinder(
            "h", "ground.O", "s.A", valve="0.5*sin(30*t)", relief="170 bar", **OIL
        ),
        mass=200.0,
    ),
    "tyre": lambda: wheel(
        mbody.Tyre("t", "ground.O", "w.C", **TYRE),
        x=0.0,
        y=0.2998,
        angle=0.0,
        omega=0.0,
        vx=5.0,
        vy=0.0,
    ),
    "belt": lambda: two(mbody.Belt("b1", "a.O", "b.O", tension=400.0, **PULLEYS), wa=40.0),
    "belt_crossed": lambda: two(
        mbody.Belt("b1", "a.O", "b.O", tension="400*(1+t)", crossed=True, **PULLEYS),
        wa=40.0,
        until=0.2,
    ),
    "belt_stick": lambda: two(
        mbody.Belt("b1", "a.O", "b.O", tension=4000.0, static=1.2, **PULLEYS),
        mbody.Torque("T", "a", value="5*sin(40*t)"),
        wa=5.0,
    ),
    "clutch": lambda: two(
        mbody.Clutch("c", "a", "b", torque=8.0, static=1.3, stribeck=0.5),
        mbody.Torque("T", "a", value=4.0),
    ),
    "brake": lambda: turner(
        mbody.BandBrake(
            "k",
            "ground.O",
            "r.O",
            force=20.0,
            radius=0.15,
            wrap="240 deg",
            friction=0.3,
            lever=0.5,
            arm=0.1,
            helping_arm=0.02,
        ),
        w=-3.0,
        until=1.0,
    ),
    "pack": lambda: slider(
        mbody.FrictionForce("f", "ground", "s.A", force="10*(1+t)"), v=1.0, until=0.8
    ),
    "rail": lambda: slider(mbody.Force("F", "s.A", 5.0, angle=0.7), friction=0.2, until=0.8),
    "rail_long": lambda: slider(
        mbody.Force("F", "s.A", 80.0, angle=0.2),
        friction=0.2,
        length=0.03,
        height=0.01,
        static=0.3,
        stribeck=0.1,
    ),
    "rail_visc": lambda: slider(friction=0.05, viscous=2.0, length=0.3),
    "pin": lambda: turner(
        friction=0.3, static=0.4, pin_radius=0.05, stribeck=0.1, viscous=0.1, until=1.5, w=1.0
    ),
    "pin_stick": lambda: turner(friction=0.9, static=1.0, pin_radius=0.15, until=1.0, w=0.5),
    "gear": lambda: two(
        mbody.Gear("g1", "a.O", "b.O", radius_i=0.5, radius_j=0.3, efficiency=0.9),
        mbody.Torque("T", "a", value=4.0),
        wa=3.0,
        wb=-5.0,
    ),
    "gear_mu": lambda: two(
        mbody.Gear(
            "g1", "a.O", "b.O", radius_i=0.5, radius_j=0.3, friction=0.1, pressure_angle="20 deg"
        ),
        mbody.Torque("T", "a", value=4.0),
        wa=3.0,
        wb=-5.0,
    ),
    "gear_alpha": lambda: two(
        mbody.Gear("g1", "a.O", "b.O", radius_i=0.5, radius_j=0.3, pressure_angle="20 deg"),
        mbody.Torque("T", "a", value=4.0),
        wa=3.0,
        wb=-5.0,
    ),
    "roll": lambda: wheel(
        mbody.Rolling("road", "ground.O", "w.C", radius=0.3, resistance=0.005),
        mbody.Torque("T", "w", value=-1.0),
        x=0.0,
        y=0.3,
        angle=0.0,
        omega=-2.0,
        vx=0.6,
        vy=0.0,
    ),
    "dampers": lambda: turner(
        mbody.Damper("d", "ground.S", "r.A", coefficient=3.0),
        mbody.Spring("s", "ground.S", "r.A", stiffness=200.0, free_length=0.3),
        mbody.TorsionDamper("t", "r", coefficient=0.4),
    ),
    "gas": lambda: slider(
        mbody.ReciprocatingCylinder(
            *("c", "ground.O", "s.A"),
            area=0.01,
            near=0.8,
            far=1.6,
            suction=1e3,
            delivery=5e3,
            clearance=0.5,
            exponent=1.3,
            ambient=1e3,
        ),
        v=0.5,
        until=0.4,
    ),
    "program": lambda: driven(
        Cam([Rise("modified-sine", 0.2, 0.1, 0.3), Dwell(0.1), Rise("3-4-5", -0.2, 0.0, 0.3)], 1.0)
    ),
    "table": lambda: driven(Table([0.0, 0.2, 0.3, 0.6], [0.0, 0.4, -0.1, 0.3])),
    "bounce": lambda: disc("w", x=0.0, y=0.4, vx=1.0, omega=12.0, friction=0.3, restitution=0.6),
    "slide": lambda: disc("w", x=0.0, y=0.3, vx=1.0, omega=6.0, friction=0.3),
    "grip": lambda: disc(
        "w", mbody.Torque("T", "w", value="-20*t"), x=0.0, y=0.3, friction=0.3, static=0.4
    ),
    "lift": lambda: disc("w", mbody.Force("F", "w", "120*t", angle=1.5707963267948966), y=0.3),
    "rope": lambda: tied(mbody.Rope("rope", "ground.O", "w.C", length=0.5), x=0.2, y=0.0, vx=2.0),
    "stop": lambda: tied(mbody.Stop("stop", "w.y + 0.2 m", restitution=0.7), x=0.0, y=0.0, vx=0.3),
    "limit": lambda: turner(
        mbody.Torque("T", "r", value="6*t"), limits=(-0.9, 0.6), restitution=0.5, w=2.0
    ),
    "overload": lambda: two(
        mbody.Clutch("c", "a", "b", torque=2.0, static=1.3),
        mbody.Torque("T", "a", value="60*t"),
        wa=0.0,
    ),
    "rests": lambda: turner(friction=0.9, static=1.0, pin_radius=0.5, w=0.0),
    "group": heap,
}

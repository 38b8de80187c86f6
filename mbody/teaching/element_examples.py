"""An example of every kind of element and law, as a model file has it."""

from __future__ import annotations

__all__ = ["BODY", "ELEMENTS", "LAW_EXAMPLES", "SURROUNDINGS"]

#: What the examples stand beside, in mm, N and s.
SURROUNDINGS = """\
units = "mm-N-s"
[ground]
points = { A = [0, 0], B = [300, 0], F = [0, -50] }
[ground.shapes]
floor = { line = { point = "F", angle = 0 } }
[bodies.arm]
mass = "2 kg"
points = { A = [0, 0], B = [100, 0] }
spread = "point"
[bodies.wheel]
mass = "1 kg"
points = { O = [0, 0] }
[bodies.wheel.shapes]
rim = { disc = "O", radius = 50 }
"""

#: A body, below the table [bodies].
BODY = """\
[bodies.arm]
mass    = "2 kg"
inertia = "0.01 kg*m^2"
cg      = [50, 0]
points  = { A = [0, 0], B = ["100 mm", 0] }
guess   = "30 deg\""""

#: Elements by section and kind: a line of the table of that section.
ELEMENTS: dict[tuple[str, str], str] = {
    ("joints", "revolute"): 'A = { revolute = ["ground.A", "arm.A"] }',
    ("joints", "prismatic"): (
        'guide = { prismatic = [{ body = "ground", point = "A", angle = 90 }, '
        '{ body = "arm", point = "A", angle = 90 }] }'
    ),
    ("joints", "fixed"): 'weld = { fixed = ["arm.B", "wheel.O"] }',
    ("joints", "distance"): 'rod = { distance = ["ground.B", "arm.B"], length = "220 mm" }',
    ("joints", "pin_slot"): (
        'slot = { pin_slot = [{ body = "ground", point = "A", angle = 45 }, "arm.B"] }'
    ),
    ("joints", "gear"): (
        'mesh = { gear = ["arm.A", "wheel.O"], radius_i = "40 mm", radius_j = "60 mm" }'
    ),
    ("joints", "rack_pinion"): 'mesh = { rack_pinion = ["arm.A", "wheel.O"], radius = "50 mm" }',
    ("joints", "rolling"): 'road = { rolling = ["ground.A", "wheel.O"], radius = "50 mm" }',
    ("joints", "cam_follower"): (
        'cam = { cam_follower = ["wheel.O", "arm.A"], base_radius = "40 mm", roller = "10 mm", '
        "profile = { harmonic = { mean = 10, amplitude = 10, frequency = 1 } } }"
    ),
    ("joints", "belt"): (
        'belt = { belt = ["ground.A", "wheel.O"], tension = "400 N", radius_i = "100 mm", '
        'radius_j = "50 mm", distance = "300 mm", friction = 0.3 }'
    ),
    ("joints", "band_brake"): (
        'brake = { band_brake = ["ground.A", "wheel.O"], force = "100 N", radius = "50 mm", '
        'wrap = "270 deg", friction = 0.3, lever = "300 mm", arm = "60 mm" }'
    ),
    ("joints", "clutch"): 'clutch = { clutch = ["arm.A", "wheel.O"], torque = "20 N*m" }',
    ("joints", "friction_force"): (
        'pad = { friction_force = ["ground.A", "arm.B"], force = "30 N" }'
    ),
    ("couplings", "angle"): (
        'chain = { angle = [{ factor = 2, angle = "wheel" }, { factor = -1, angle = "arm" }] }'
    ),
    ("couplings", "length"): (
        'rope = { length = [{ factor = 1, distance = ["ground.A", "arm.B"] }, '
        '{ factor = 2, distance = ["ground.B", "wheel.O"] }], value = "500 mm" }'
    ),
    ("drivers", "angle"): (
        'motor = { angle = "arm", law = { constant_speed = { value = 0, speed = "300 rpm" } } }'
    ),
    ("drivers", "distance"): (
        'cylinder = { distance = ["ground.B", "arm.B"], law = "220 mm + 10 mm/s*t" }'
    ),
    ("drivers", "coordinate"): (
        'feed = { coordinate = [{ body = "ground", point = "A", angle = 0 }, "wheel.O"], '
        'law = "10 mm/s*t" }'
    ),
    ("loads", "force"): 'push = { force = "120 N", at = "arm.B", angle = -90 }',
    ("loads", "torque"): 'load = { torque = "-3 N*m", body = "arm" }',
    ("loads", "gravity"): 'gravity = { gravity = [0, "-9.81 m/s^2"] }',
    ("loads", "spring"): (
        'spring = { spring = ["ground.B", "arm.B"], stiffness = "2 N/mm", free_length = "150 mm" }'
    ),
    ("loads", "damper"): 'damper = { damper = ["ground.B", "arm.B"], coefficient = "50 N*s/m" }',
    ("loads", "torsion_spring"): (
        'coil = { torsion_spring = "arm", stiffness = "5 N*m/rad", free_angle = "30 deg" }'
    ),
    ("loads", "torsion_damper"): (
        'drag = { torsion_damper = "arm", coefficient = "0.1 N*m*s/rad" }'
    ),
    ("loads", "actuator"): 'jack = { actuator = ["ground.B", "arm.B"], push = "200 N" }',
    ("loads", "centrifugal_field"): 'field = { centrifugal_field = "ground", speed = "200 rpm" }',
    ("loads", "piston_pressure"): (
        'gas = { piston_pressure = ["ground.A", "arm.A"], cycle = "wheel", '
        'head_area = "50 cm^2", head = "6 bar" }'
    ),
    ("loads", "reciprocating_cylinder"): (
        'air = { reciprocating_cylinder = ["ground.A", "arm.A"], area = "50 cm^2", near = "10 mm", '
        'far = "110 mm", clearance = "5 mm", suction = "0 bar", delivery = "5 bar", '
        'exponent = 1.3, ambient = "1 bar" }'
    ),
    ("loads", "dc_motor"): (
        'motor = { dc_motor = "wheel", voltage = "24 V", resistance = "0.5 ohm", '
        'inductance = "1 mH", constant = "0.05 N*m/A" }'
    ),
    ("loads", "induction_motor"): (
        'motor = { induction_motor = "wheel", breakdown_torque = "40 N*m", breakdown_slip = 0.2, '
        'synchronous = "1500 rpm" }'
    ),
    ("loads", "hydraulic_cylinder"): (
        'ram = { hydraulic_cylinder = ["ground.B", "arm.B"], bore = "50 mm", rod = "30 mm", '
        'closed = "150 mm", stroke = "200 mm", valve = 1, flow = "10 L/min", drop = "10 bar", '
        'supply = "100 bar", bulk_modulus = "1.4 GPa", dead_volume = "20 cm^3" }'
    ),
    ("loads", "tyre"): (
        'tyre = { tyre = ["ground.A", "wheel.O"], radius = "300 mm", stiffness = "200 N/mm", '
        'friction = 0.9, steepness = 10, shape = 1.6, relaxation = "150 mm" }'
    ),
    ("contacts", "contact"): (
        'floor = { contact = ["ground.floor", "wheel.rim"], friction = 0.3, restitution = 0.2 }'
    ),
    ("contacts", "between"): (
        'pile = { between = ["ground.floor", "wheel*.rim"], friction = 0.3 }'
    ),
    ("contacts", "rope"): 'rope = { rope = ["ground.B", "arm.B"], length = "250 mm" }',
    ("contacts", "freewheel"): 'ratchet = { freewheel = ["ground.A", "wheel.O"] }',
    ("contacts", "stop"): 'end = { stop = "60 deg - arm.angle", restitution = 0.1 }',
}

#: Laws by kind, as the law of a motor.
LAW_EXAMPLES: dict[str, str] = {
    "constant": '{ constant = { value = "30 deg" } }',
    "constant_speed": '{ constant_speed = { value = 0, speed = "300 rpm" } }',
    "constant_acceleration": (
        '{ constant_acceleration = { value = 0, speed = "10 rad/s", acceleration = "2 rad/s^2" } }'
    ),
    "polynomial": "{ polynomial = [0, 1, 0.5] }",
    "harmonic": '{ harmonic = { mean = 0, amplitude = "30 deg", frequency = "2 rad/s" } }',
    "table": '{ table = { x = [0, "1 s", "2 s"], y = [0, "30 deg", "40 deg"] } }',
    "rise": ('{ rise = { shape = "cycloidal", height = "90 deg", start = 0, duration = "2 s" } }'),
    "cam": (
        '{ cam = { period = "4 s", segments = [{ rise = { shape = "3-4-5", height = "90 deg", '
        'start = 0, duration = "1 s" } }, { dwell = "1 s" }, { rise = { shape = "3-4-5", '
        'height = "-90 deg", start = 0, duration = "2 s" } }] } }'
    ),
}

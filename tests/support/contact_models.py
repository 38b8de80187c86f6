"""Models with contacts whose motion is known otherwise, as model files."""

from __future__ import annotations

FLOOR = """
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O", angle = "ALPHA rad" } } }
"""

BALL = """
name = "ball"
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.ball]
mass = 1
inertia = 1
points = { C = [0, 0] }
guess = [0, 1.0, 0]
[contacts]
hit = { contact = ["ground.floor", "ball.C"], restitution = 0.8 }
[gravity]
y = -9.81
"""

#: A block, a point, up a rough incline of 0.3 rad at 3 m/s.
INCLINE = """
name = "block up an incline"
angle = "rad"
[ground]
points = { O = [0, 0] }
shapes = { slope = { line = { point = "O", angle = 0.3 } } }
[bodies.block]
mass = 2
inertia = 1
points = { C = [0, 0] }
[contacts]
under = { contact = ["ground.slope", "block.C"], friction = 0.4 }
[gravity]
y = -9.81
[simulate]
until = 2.0
rtol = 1e-13
start = { block = { x = 0, y = 0, angle = 0, vx = "3*cos(0.3) m/s", vy = "3*sin(0.3) m/s" } }
"""

OSCILLATOR = """
name = "Coulomb oscillator"
[ground]
points = { O = [0, 0], W = [-2, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.block]
mass = 1.5
inertia = 1
points = { C = [0, 0] }
[contacts]
under = { contact = ["ground.floor", "block.C"], friction = 0.25 }
[loads]
spring = { spring = ["ground.W", "block.C"], stiffness = 60, free_length = 2 }
[gravity]
y = -9.81
[simulate]
until = 5.0
rtol = 1e-13
start = { block = { x = 0.7, y = 0, angle = 0 } }
"""

DISC = """
name = "disc, sliding to rolling"
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.wheel]
mass = 3
inertia = 0.06
points = { C = [0, 0] }
shapes = { rim = { disc = "C", radius = 0.2 } }
[contacts]
road = { contact = ["wheel.rim", "ground.floor"], friction = 0.15 }
[gravity]
y = -9.81
[simulate]
until = 1.0
rtol = 1e-13
start = { wheel = { x = 0, y = 0.2, angle = 0, vx = 2 } }
"""

#: A disc that strikes the floor at (2, −3) m/s.
THROWN = """
name = "disc thrown on a floor"
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.wheel]
mass = 1.3
inertia = "1.3*0.1^2/2"
points = { C = [0, 0] }
shapes = { rim = { disc = "C", radius = 0.1 } }
[contacts]
hit = { contact = ["ground.floor", "wheel.rim"], friction = 0.2, restitution = 0.6 }
[simulate]
until = 1.0
rtol = 1e-13
start = { wheel = { x = 0, y = 0.4, angle = 0, vx = 2, vy = -3 } }
"""

LADDER = """
name = "ladder leaves the wall"
angle = "rad"
[ground]
points = { O = [0, 0] }
[ground.shapes]
floor = { line = { point = "O" } }
wall = { line = { point = "O", angle = "-pi/2" } }
[bodies.ladder]
mass = 1
inertia = "1/3"
points = { A = [-1, 0], B = [1, 0] }
[contacts]
foot = { contact = ["ground.floor", "ladder.A"], friction = 0.25 }
top = { contact = ["ground.wall", "ladder.B"], friction = 0.15 }
[gravity]
y = -9.81
[simulate]
until = 0.9
rtol = 1e-13
[simulate.start.ladder]
x = "cos(1.0)*1 m"
y = "sin(1.0)*1 m"
angle = "pi - 1.0"
"""

#: A rod on its lower end, which slides to the left.
ROD = """
name = "Painlevé's rod"
angle = "rad"
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.rod]
mass = 1
inertia = "1/3"
points = { A = [-1, 0], B = [1, 0] }
[contacts]
end = { contact = ["ground.floor", "rod.A"], friction = 1.4 }
[gravity]
y = -9.81
"""

BLOCK = """
name = "rocking block"
angle = "rad"
[parameters]
R = "sqrt(0.1^2 + 0.4^2)"
[ground]
points = { O = [0, 0] }
shapes = { floor = { line = { point = "O" } } }
[bodies.block]
mass = 1
inertia = "(0.1^2 + 0.4^2)/3"
points = { A = [-0.1, -0.4], B = [0.1, -0.4], C = [0.1, 0.4], D = [-0.1, 0.4] }
shapes = { box = { polygon = ["A", "B", "C", "D"] } }
[contacts]
base = { contact = ["ground.floor", "block.box"], friction = 0.8 }
[gravity]
y = -9.81
"""

#: A toy: a sleeve with clearance on a pole, a bird on a spring that strikes the pole with its beak.
#: Numbers of Glocker's (Pfeiffer, Glocker 1996, 10), with the geometry of rigid bodies; it begins
#: where the low corner of the sleeve begins to slip in the limit cycle.
WOODPECKER = """
name = "woodpecker toy"
angle = "rad"
[ground]
points = { O = [0, 0], P = [0.0025, 0] }
shapes = { pole = { line = { point = "P", angle = "-pi/2" } } }
[bodies.sleeve]
mass = 0.0003
inertia = 5e-9
points = { M = [0, 0], H = [0.010, 0], low = [0.0031, -0.0058], high = [0.0031, 0.0058] }
[bodies.bird]
mass = 0.0045
inertia = 7e-7
points = { S = [0, 0], H = [-0.015, 0], beak = [-0.0201, 0.02] }
[joints]
pole = { pin_slot = [{ body = "ground", point = "O", angle = "pi/2" }, "sleeve.M"] }
hinge = { revolute = ["sleeve.H", "bird.H"] }
[loads]
spring = { torsion_spring = "bird", by = "sleeve", stiffness = 0.0056 }
[contacts]
beak = { contact = ["ground.pole", "bird.beak"], friction = 0.3, restitution = 0.5 }
low = { contact = ["ground.pole", "sleeve.low"], friction = 0.3 }
high = { contact = ["ground.pole", "sleeve.high"], friction = 0.3 }
[gravity]
y = -9.81
[simulate]
until = 0.2
rtol = 1e-13
[simulate.start.sleeve]
x = 0
y = 0
angle = -0.10090092472062455
vy = 0
omega = 0
[simulate.start.bird]
angle = -0.2296076072944122
omega = 13.888670718733145
"""

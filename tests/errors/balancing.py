"""Balance: counterweights and springs."""

import mbody
from mbody import AngleDriver, Body, Fixed, Gravity, Mechanism, Revolute, Spring
from mbody.engineering import force_balance, spring_balance
from mbody.laws import Constant, ConstantSpeed
from tests.errors.command import said
from tests.errors.models import four_bar


def counterweights(on, machine=None, **options):
    return force_balance(machine or four_bar(), on, **options)


def frame():
    machine = Mechanism("frame")
    machine.add(Body("frame", mass=1.0), Fixed("weld", "ground", "frame"))
    return machine


def batch():
    return mbody.assemble(four_bar()).with_values({"crank.A.x": [0.9, 1.1]})


def arm(*more, driver=True, gravity=True, law=None):
    machine = Mechanism("arm", ground={"top": (0, 0.4)})
    machine.add(
        Body("arm", mass=2.0, cg=(0.5, 0), points={"P": (0.3, 0)}),
        Revolute("O", "ground", "arm"),
        *more,
    )
    if driver:
        machine.add(AngleDriver("hold", "arm", law or ConstantSpeed(0.0, 1.0)))
    if gravity:
        machine.add(Gravity("g", y=-9.81))
    return machine


def spring(name="spring", **more):
    return Spring(name, "ground.top", "arm.P", **(more or {"stiffness": 1.0}))


def springs(which, machine=None, **options):
    return spring_balance(machine or arm(spring()), which, **(options or {"turn": True}))


SCENARIOS = {
    "counterweights of a batch": lambda: counterweights({"crank": 1.0}, batch()),
    "counterweights on nothing": lambda: counterweights({}),
    "a counterweight on no link": lambda: counterweights({"wheel": 1.0}),
    "a counterweight at no radius": lambda: counterweights({"crank": 0.0}),
    "a counterweight at a mass": lambda: counterweights({"crank": "3 kg"}),
    "two counterweights on a link": lambda: counterweights({"crank": 1.0, "crank.A": 1.0}),
    "counterweights at one position": lambda: counterweights({"crank": 1.0}, t=0.0),
    "counterweights with another option": lambda: counterweights({"crank": 1.0}, about="O"),
    "counterweights without mass": lambda: counterweights(
        {"crank": 1.0}, mbody.gallery.load("hoekens")
    ),
    "counterweights of what is free": lambda: counterweights(
        {"pendulum": 1.0}, mbody.gallery.load("simple_pendulum")
    ),
    "counterweights of what is fixed": lambda: counterweights(
        {"frame": 1.0}, frame(), t=[0.0, 1.0]
    ),
    "springs of a batch": lambda: spring_balance(
        mbody.assemble(arm(spring())).with_values({"arm.mass": [1.0, 2.0]}), ["spring"]
    ),
    "no springs": lambda: springs([]),
    "a spring where there is none": lambda: springs(["spring"], arm()),
    "a spring twice": lambda: springs(["spring", "spring"]),
    "a spring with a law": lambda: springs([spring("other", law=lambda x: x**3)]),
    "springs against no load": lambda: springs(["spring"], against=["wind"], turn=True),
    "springs without loads": lambda: springs(["spring"], arm(spring(), gravity=False)),
    "springs of what stands still": lambda: springs(
        ["spring"], arm(spring(), law=Constant(0.0)), t=0.0
    ),
    "a balance by nothing": said(["balance", "norton_fourbar"]),
}

SENTENCES = r"""
counterweights of a batch | ModelError | - | force_balance takes one design: choose one of the batch with design(n)
counterweights on nothing | ModelError | - | force_balance: on must name links with radii, such as {"crank": "3 in"}, not {}
a counterweight on no link | ModelError | wheel | force_balance: there is no link 'wheel' for a counterweight (there are: 'crank', 'coupler', 'rocker')
a counterweight at no radius | ModelError | crank | the counterweight on 'crank' has the radius 0 m, it must be positive: its direction is found
a counterweight at a mass | ModelError | crank | 'crank': radius: '3 kg' is a mass (kg), where a length (m) is wanted
two counterweights on a link | ModelError | crank | force_balance: 'crank' has two counterweights: one does the work of both
counterweights at one position | ModelError | - | force_balance takes several positions: give over="turn", or drive with the values of the drivers
counterweights with another option | ModelError | - | force_balance: there is no option 'about' (there are: 't', 'drive', 'turn', 'instants', 'turns', 'guess', 'at', 'over')
counterweights without mass | ModelError | - | 'Hoekens' linkage: a straight line from four bars' has no link with mass: there is nothing to balance
counterweights of what is free | SolveError | - | kinematics needs 0 free degrees of freedom, 'Simple pendulum' has 1 degree left: add a driver, for example on 'pendulum'
counterweights of what is fixed | ModelError | - | 'frame' has no driver: force_balance takes positions of a driven motion, add one
springs of a batch | ModelError | - | spring_balance takes one design: choose one of the batch with design(n)
no springs | ModelError | - | spring_balance: springs must be names such as ["spring"], or Spring elements, not []
a spring where there is none | ModelError | spring | spring_balance: there is no spring 'spring' (there are none: give Spring elements)
a spring twice | ModelError | spring | spring_balance: 'spring' is given twice: give it once
a spring with a law | ModelError | other | 'other' has a law of its own, spring_balance finds stiffnesses: give it one in its place
springs against no load | ModelError | wind | spring_balance: there is no load 'wind' to balance (there are: 'g')
springs without loads | ModelError | - | spring_balance: without springs 'hold' needs no effort in these positions: there is nothing to balance
springs of what stands still | ModelError | - | spring_balance: 1 stiffnesses need at least as many efforts of drivers that move, and there are 0: analyse more positions, as with turn=True
a balance by nothing | UsageError | - | choose what is to balance: --on LINK=RADIUS for counterweights, or --springs NAMES
"""

"""Motors with gears, and bearings."""

from mbody import kinematics, kinetostatics
from mbody.engineering import MotorCurve, bearing_load, motor_sizing
from tests.errors.engines import turn
from tests.errors.models import four_bar
from tests.errors.results import batch

MOTOR = MotorCurve([0.0, 100.0], [9.0, 9.0], [3.0, 2.0], 0.01)


def sized(motor=MOTOR, run=None, **more):
    return motor_sizing(turn() if run is None else run, motor, **more)


def curve(*rows):
    return lambda: sized(MotorCurve(*rows))


def of_joint(*arguments, **more):
    return bearing_load(turn(), *arguments, **more)


SCENARIOS = {
    "a motor of kinematics": lambda: sized(run=kinematics(four_bar())),
    "a motor of a batch": lambda: sized(run=batch()),
    "a motor at one instant": lambda: sized(run=kinetostatics(four_bar())),
    "a motor at rest": lambda: sized(run=kinetostatics(four_bar(speed=0.0), t=[0.0, 1.0])),
    "a gear that gives more than it takes": lambda: sized(efficiency=1.1),
    "a rest of negative time": lambda: sized(rest=-1.0),
    "a gear without a ratio": lambda: sized(ratio=0.0),
    "a motor that turns too fast": lambda: sized(ratio=1000.0),
    "a motor in words": lambda: sized("a servo"),
    "a motor with fewer torques": curve([0.0, 1.0], [1.0], [1.0]),
    "a motor whose speeds fall": curve([0.0, 2.0, 1.0], [1.0] * 3, [1.0] * 3),
    "a motor without torque": curve([0.0, 1.0], [1.0, 0.0], [1.0, 1.0]),
    "a motor of negative inertia": curve([0.0, 1.0], [1.0] * 2, [1.0] * 2, -1.0),
    "a bearing of a batch": lambda: bearing_load(batch(), "A"),
    "a bearing that is no joint": lambda: of_joint("crank"),
    "a bearing of another kind": lambda: of_joint("A", "plain"),
    "a bearing at one instant": lambda: bearing_load(kinetostatics(four_bar()), "A"),
    "a bearing without a rating": lambda: of_joint("A", rating=0.0),
    "a spectrum of no classes": lambda: of_joint("A").spectrum(0),
}

SENTENCES = r"""
a motor of kinematics | ModelError | - | kinematics finds no torques: a motor is sized by kinetostatics
a motor of a batch | ModelError | - | a motor is sized for one design, this is a batch of 2 designs: take one of them, run.design(n)
a motor at one instant | ModelError | - | a motor is sized over a cycle of time, this is one instant: analyse a turn, or several times
a motor at rest | ModelError | motor | driver 'motor' does not move: a motor is sized for a motion
a gear that gives more than it takes | ModelError | - | the efficiency of a gear is above 0 and at most 1, not 1.1
a rest of negative time | ModelError | motor | driver 'motor': the rest after a cycle is a time from 0 on, not -1
a gear without a ratio | ModelError | motor | driver 'motor': a gear ratio is above 0, not 0: give one
a motor that turns too fast | ModelError | motor | with the ratio 1000 the motor would turn at up to 1000 rad/s, its curve ends at 100 rad/s: the ratio is at most 100
a motor in words | ModelError | - | a motor is MotorCurve(speed, peak, continuous), not 'a servo'
a motor with fewer torques | ModelError | - | a motor's curve has as many speeds as torques, two or more, not 2, 1 and 1
a motor whose speeds fall | ModelError | - | the speeds of a motor's curve rise from 0 on: sort the points
a motor without torque | ModelError | - | the torques of a motor's curve are above 0: end it at a speed where there is some
a motor of negative inertia | ModelError | - | the inertia of a motor is not negative: -1
a bearing of a batch | ModelError | - | loads of bearings are of one design, this is a batch of 2 designs: take one of them, run.design(n)
a bearing that is no joint | ModelError | crank | there is no revolute joint 'crank' (there are: 'O2', 'A', 'B', 'O4')
a bearing of another kind | ModelError | A | bearing 'A' is 'ball', 'roller', or its exponent from 1 to 20, not 'plain'
a bearing at one instant | ModelError | A | the load of bearing 'A' is of a cycle of time, this is one instant: analyse a turn, or several times
a bearing without a rating | ModelError | A | the rating of bearing 'A' is above 0, not 0
a spectrum of no classes | ModelError | - | a spectrum has 1 to 10000 classes, not 0
"""

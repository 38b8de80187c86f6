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
    "a bearing of kinematics": lambda: bearing_load(kinematics(four_bar()), "A"),
    "a bearing of a batch": lambda: bearing_load(batch(), "A"),
    "a bearing that is no joint": lambda: of_joint("crank"),
    "a bearing of another kind": lambda: of_joint("A", "plain"),
    "a bearing at one instant": lambda: bearing_load(kinetostatics(four_bar()), "A"),
    "a bearing without a rating": lambda: of_joint("A", rating=0.0),
    "a spectrum of no classes": lambda: of_joint("A").spectrum(0),
}

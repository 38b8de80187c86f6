"""Many motions side by side, and environments."""

import importlib.util
import sys
from unittest import mock

import numpy as np

import mbody
from mbody import Controller, Simulators
from tests.errors.results import batch
from tests.many_motions import TASK, cart_pole


def lot():
    return Simulators(cart_pole(), 3)


def asked(ask):
    return lambda: ask(lot())


def setting(value, name="u"):
    return asked(lambda sims: sims.inputs.__setitem__(name, value))


def controlled():
    machine = cart_pole()
    machine.add(Controller("pid", lambda t, x: -x, every=1e-3, reads=["cart.x"], sets=["u"]))
    Simulators(machine, 2)


def followed():
    machine = cart_pole()
    machine.add(mbody.Input("w", mbody.laws.Harmonic(0.0, 1.0, 2.0)))
    Simulators(machine, 2).inputs["w"] = 1.0


def impossible():
    """A crank of a four-bar at an angle at which its loop does not close."""
    machine = mbody.makers.four_bar(4.0, 3.0, 2.0, 6.0, masses=(1.0, 1.0, 1.0))
    Simulators(machine, 2).reset([1], {"crank.angle": 3.1})


def backwards(sims):
    sims.step(0.1)
    sims.until(0.05)


def other_state(sims):
    sims.state = Simulators(cart_pole(), 40).state


def no_state(sims):
    sims.state = [0.0]


def task(**changes):
    return lambda: mbody.envs.make(cart_pole(), **TASK | changes)


def missing():
    """None in the place of a module is as if it were not installed."""
    with mock.patch.dict(sys.modules, {"gymnasium": None}):
        task()()


def environment(ask):
    return lambda: ask(mbody.envs.make_vec(cart_pole(), 2, **TASK))


def begun(ask):
    def scenario(env):
        env.reset(seed=0)
        ask(env)

    return environment(scenario)


#: What Gymnasium itself is needed for.
IF_INSTALLED = {
    "environments that have not begun": environment(lambda env: env.step([[0.0], [0.0]])),
    "an environment that has not begun": lambda: mbody.envs.make(cart_pole(), **TASK).step([0]),
    "too few seeds": environment(lambda env: env.reset(seed=[1])),
    "a mask of environments that is none": environment(
        lambda env: env.reset(options={"reset_mask": np.array([1, 0])})
    ),
    "actions of another shape": begun(lambda env: env.step([0.0, 0.0])),
    "actions that are no numbers": begun(lambda env: env.step("ab")),
}

SCENARIOS = {
    "no motions": lambda: Simulators(cart_pole(), 0),
    "as many motions as a batch has not": lambda: Simulators(batch().system, 7),
    "no threads": lambda: Simulators(cart_pole(), 2, threads=0),
    "a controller for many": controlled,
    "many steps of nothing": asked(lambda sims: sims.step(0.0)),
    "many steps of no numbers": asked(lambda sims: sims.step(["much"] * 3)),
    "many motions that go back": asked(backwards),
    "a state of other motions": asked(other_state),
    "a state of many that is none": asked(no_state),
    "an input of too many numbers": setting([1.0, 2.0]),
    "inputs that are no numbers": setting(["a", "b", "c"]),
    "inputs that are not finite": setting([0.0, np.nan, 0.0]),
    "an input of many that there is not": setting(1.0, "w"),
    "an input of many that follows its law": followed,
    "an input of many that is taken away": asked(lambda sims: sims.inputs.__delitem__("u")),
    "a reset of what is no mask": asked(lambda sims: sims.reset([0.5])),
    "a reset of motions that there are not": asked(lambda sims: sims.reset([7])),
    "a reset to too few numbers": asked(lambda sims: sims.reset(None, {"cart.x": [1.0]})),
    "a reset to no numbers": asked(lambda sims: sims.reset(None, {"cart.x": ["a", "b", "c"]})),
    "a reset to what is not finite": asked(
        lambda sims: sims.reset(None, {"cart.x": [np.nan, 0.0, 0.0]})
    ),
    "a reset of one of many where nothing closes": impossible,
    "a body that none of many has": asked(lambda sims: sims["krank"]),
    "an environment of no time": task(step=0.0),
    "an environment that skips nothing": task(frame_skip=0),
    "an environment without actions": task(actions={}),
    "an action that there is not": task(actions={"w": (-1.0, 1.0)}),
    "an action without bounds": task(actions={"u": 1.0}),
    "an action of bounds the wrong way": task(actions={"u": (1.0, -1.0)}),
    "an environment that observes nothing": task(observations=[]),
    "an observation of bounds the wrong way": task(observations=[("cart.x", 1.0, -1.0)]),
    "a reset of an environment that there is not": task(reset={"cart.colour": (0.0, 1.0)}),
    "a reward that is none": task(reward=1.0),
    "an end that is no relation": task(terminated="cart.x"),
    "environments without Gymnasium": missing,
    **(IF_INSTALLED if importlib.util.find_spec("gymnasium") else {}),
}

"""Many motions side by side, and environments."""

import importlib.util
import sys
from unittest import mock

import numpy as np

import mbody
from mbody import Controller, Simulators
from tests.errors.results import batch
from tests.support.many_motions import TASK, cart_pole


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
    "a picture of what has not begun": lambda: mbody.envs.make(
        cart_pole(), **TASK, render_mode="rgb_array"
    ).render(),
    "pictures of what has not begun": lambda: mbody.envs.make_vec(
        cart_pole(), 2, **TASK, render_mode="rgb_array"
    ).render(),
    "pictures in a window": lambda: mbody.envs.make(cart_pole(), **TASK, render_mode="human"),
    "too few seeds": environment(lambda env: env.reset(seed=[1])),
    "a mask of environments that is none": environment(
        lambda env: env.reset(options={"reset_mask": np.array([1, 0])})
    ),
    "actions of another shape": begun(lambda env: env.step([0.0, 0.0])),
    "actions that are no numbers": begun(lambda env: env.step("ab")),
}

SCENARIOS = {
    "as many motions as a batch has not": lambda: Simulators(batch().system, 7),
    "a controller for many": controlled,
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

SENTENCES = r"""
as many motions as a batch has not | ModelError | - | Simulators: n is 7, the system has 2 designs, one for each motion: leave n out
a controller for many | ModelError | pid | the controller 'pid' is a function of one motion: Simulators take none; read what it reads and set its inputs between steps
many steps of no numbers | ModelError | - | step: dt takes one time or an array of 3, not ['much', 'much', 'much']
many motions that go back | ModelError | - | until: t leads motion 0 from 0.1 to 0.05 s: give a later time; to go back, keep sims.state and set it again, or reset it
a state of other motions | ModelError | - | the state that is set is of other motions: these are 3; take one of their own
a state of many that is none | ModelError | - | the state that is set must be one that sims.state gave, of the same mechanism, not [0.0]
an input of too many numbers | ModelError | u | the input 'u' has an array of shape (2,): give one number, or one for each of the 3 motions
inputs that are no numbers | ModelError | u | the input 'u' takes a number or an array of 3, not ['a', 'b', 'c']
inputs that are not finite | ModelError | u | the input 'u' is nan in motion 1: give finite numbers
an input of many that there is not | ModelError | w | there is no input 'w' (there are: 'u')
an input of many that follows its law | ModelError | w | the input 'w' follows its law of time: declare it with a number to set it here
an input of many that is taken away | ModelError | u | the input 'u' belongs to the mechanism: set it to a number
a reset of what is no mask | ModelError | - | reset takes a mask of 3 bool or numbers of motions, not [0.5]; positions by name are its second argument
a reset of motions that there are not | ModelError | - | reset: motions [7] must be different numbers from 0 to 2
a reset to too few numbers | ModelError | cart.x | reset: 'cart.x' has an array of shape (1,) for 3 motions: give one number, or one for each
a reset to no numbers | ModelError | cart.x | reset: 'cart.x' must be numbers, not ['a', 'b', 'c']
a reset to what is not finite | ModelError | cart.x | reset: 'cart.x' is not finite everywhere: give finite numbers
a reset of one of many where nothing closes | SolveError | motor | driver 'motor' cannot bring 'crank' to 1.0472 rad at t = 0 s: it comes within 0.0738 rad where the links are stretched; check lengths and the law
a body that none of many has | ModelError | krank | there is no body 'krank' (there are: 'cart', 'pole')
an environment of no time | ModelError | - | envs.make: step is 0 s: give a positive time
an environment without actions | ModelError | - | envs.make: actions must be inputs with their bounds, such as {"u": ("-5 N*m", "5 N*m")}, not {}
an action that there is not | ModelError | w | envs.make: there is no input 'w' to act by (there are: 'u'); declare it, such as Input('u', '0 N*m')
an action without bounds | ModelError | u | envs.make: 'u' takes a pair (low, high), not 1.0
an action of bounds the wrong way | ModelError | u | envs.make: 'u' goes from 1 to -1 N: give low, then high
an environment that observes nothing | ModelError | - | envs.make: observations must be measures such as ["crank.angle", "crank.omega"]: give at least one
an observation of bounds the wrong way | ModelError | cart.x | envs.make: 'cart.x' goes from 1 to -1: give low, then high
a reset of an environment that there is not | ModelError | cart.colour | envs.make: reset has no 'cart.colour': give ranges of places and rates such as {"crank.angle": ("-5 deg", "5 deg")}, or of auxiliary states
a reward that is none | ModelError | - | envs.make: reward must be a measure such as "cos(pole.angle)", or measures with their weights such as {"cart.x^2": -1.0}, not 1.0
an end that is no relation | ModelError | - | envs.make: terminated must be relations such as "abs(pole.angle) > 24 deg", not 'cart.x'
environments without Gymnasium | ModelError | - | environments need Gymnasium, which is not installed: pip install 'mbody-planar[gym]'
environments that have not begun | ModelError | - | the environments have not begun: call reset before step
an environment that has not begun | ModelError | - | the environment has not begun: call reset before step
a picture of what has not begun | ModelError | - | the environment has not begun: call reset before render
pictures of what has not begun | ModelError | - | the environments have not begun: call reset before render
pictures in a window | ModelError | - | render_mode is 'human': give "rgb_array", whose pictures any viewer of arrays shows, or None
too few seeds | ModelError | - | reset: 1 seeds for 2 environments: give one number, or one for each
a mask of environments that is none | ModelError | - | reset: reset_mask must be an array of 2 bool, not array([1, 0])
actions of another shape | ModelError | - | step: the action has the shape (2,), the environment takes (2, 1): give a number for each input
actions that are no numbers | ModelError | - | step: the action must be numbers, not 'ab'
"""

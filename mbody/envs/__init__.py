"""Environments of Gymnasium made from mechanisms, for reinforcement learning (extra ``gym``).

>>> import mbody
>>> machine = mbody.gallery.load("double_pendulum")
>>> machine.add(mbody.Input("u", "0 N*m"), mbody.Torque("motor", "upper", value="u"))
>>> env = mbody.envs.make(
...     machine,
...     actions={"u": ("-5 N*m", "5 N*m")},
...     observations=["upper.angle", "upper.omega", "lower.angle", "lower.omega"],
...     reward="cos(upper.angle)",
...     step="10 ms",
... )
>>> env.action_space
Box(-5.0, 5.0, (1,), float32)
"""

from mbody.envs.making import make, make_vec

__all__ = ["make", "make_vec"]

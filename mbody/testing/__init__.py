"""Contract checks: what every joint, driver and load must obey, the built-in ones and yours.

Each check puts the element between free massive bodies with mass centres off their origins,
assembles that like any mechanism, and evaluates the kernels at random states. A failure is an
`AssertionError` in one sentence: which element, what is wrong, by how much, at which state.

>>> import mbody
>>> report = mbody.testing.check_joint(mbody.Distance("rod", "a.P", "b.Q", length=2.0))
>>> report["full rank"].error
0.0
"""

from mbody.testing.contracts import Check, Report, check_joint, check_load

__all__ = ["Check", "Report", "check_joint", "check_load"]

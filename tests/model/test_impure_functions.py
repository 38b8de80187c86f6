"""Functions with a memory are refused as loads; forces need no derivatives of Python laws."""

import ctypes
import ctypes.util
import math

import numpy as np
import pytest

import mbody


def arm(*more):
    machine = mbody.Mechanism("arm")
    machine.add(
        mbody.Body("arm", mass=1.0, inertia=0.1, cg=(0.2, 0.0)),
        mbody.Revolute("O", "ground", "arm"),
    )
    machine.add(*more)
    return machine


class Remembering(mbody.CustomLoad):
    """A PID as people write it first: it sums up over the time since it was called last, so that
    two calls at one instant agree.
    """

    def physics(self, i, j, p, t):
        MEMORY["sum"] += (0.5 - j[2]) * (t - MEMORY["t"])
        MEMORY["t"] = t
        torque = 5.0 * (0.5 - j[2]) + 8.0 * MEMORY["sum"]
        return 0.0, 0.0, -torque, 0.0, 0.0, torque


MEMORY = {"sum": 0.0, "t": 0.0}


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_a_load_with_a_memory_is_refused(rtol):
    MEMORY.update(sum=0.0, t=0.0)
    with pytest.raises(mbody.ModelError, match=r"'pid' keeps a memory.*Controller") as caught:
        mbody.simulate(arm(Remembering("pid", "ground", "arm")), 1.0, rtol=rtol)
    assert caught.value.element == "pid"


def test_a_law_with_a_memory_is_refused():
    last = [0.0]

    def lagging(t):
        last[0] += 0.1 * (t - last[0])
        return 0.01 * last[0] if t > 0.01 else 0.0

    with pytest.raises(mbody.ModelError, match=r"'motor' keeps a memory"):
        mbody.simulate(arm(mbody.Torque("motor", "arm", value=lagging)), 1.0)


def test_noise_is_refused():
    random = np.random.default_rng(1)
    with pytest.raises(mbody.ModelError, match=r"same arguments"):
        mbody.simulate(arm(mbody.Torque("motor", "arm", value=lambda t: random.normal())), 1.0)


def test_a_force_asks_for_no_derivatives():
    """A load calls its function once an evaluation, a driver as often as its derivatives want."""
    counts = {}
    for name in ("load", "driver"):
        calls = []

        def function(t, calls=calls):
            calls.append(t)
            return math.sin(t)

        element = (
            mbody.Torque("motor", "arm", value=function)
            if name == "load"
            else mbody.AngleDriver("motor", "arm", law=function)
        )
        mbody.kinetostatics(
            arm(element, *([mbody.AngleDriver("turn", "arm", "2*t")] if name == "load" else [])),
            t=np.linspace(0.0, 1.0, 11),
        )
        counts[name] = len(calls)
    assert counts["load"] < 0.2 * counts["driver"]


def test_functions_of_c_are_taken():
    """As SciPy's LowLevelCallable has them: an object with the function of C."""
    library = ctypes.CDLL(ctypes.util.find_library("m"))
    library.cos.restype, library.cos.argtypes = ctypes.c_double, [ctypes.c_double]
    LowLevelCallable = type("LowLevelCallable", (), {"function": library.cos})
    machine = arm(mbody.Torque("motor", "arm", value=LowLevelCallable()))
    run = mbody.simulate(machine, 1.0, rtol=1e-10)
    # θ″ = cos t / I from rest
    assert run["arm"].angle[-1] == pytest.approx((1.0 - math.cos(1.0)) / 0.14, abs=1e-8)

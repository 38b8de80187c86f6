"""One instant of a result against the dense oracle: place, accelerations, reactions, efforts."""

from typing import Any

import numpy as np

from mbody.engines.oracle import Reference
from mbody.solution.solution import Solution


def assert_agrees(oracle: Reference, run: Solution, k: int) -> dict[str, dict[str, Any]]:
    """The oracle closes from near instant k, where the branch is; its forces there."""
    order, t = [run[body.name] for body in run.mechanism.bodies], run.t[k]
    near = np.array([getattr(body, key)[k] for body in order for key in ("x", "y", "angle")])
    q = oracle.close(near + 1e-3 * np.cos(np.arange(len(near))), t)
    assert np.abs(q - near).max() < 1e-9
    v = np.linalg.solve(oracle.phi_q(q, t), oracle.nu(q, t))
    a = np.linalg.solve(oracle.phi_q(q, t), oracle.gamma(q, v, t))
    alpha = np.array([body.alpha[k] for body in order])
    # condition of the loops is below 1e3: rounding leaves 1e-12 of the greatest
    assert np.abs(a[2::3] - alpha).max() < 1e-10 * np.abs(a).max()
    forces: dict[str, dict[str, Any]] = oracle.kinetostatics(q, v, a, t)
    top = max(np.abs(force).max() for force in forces["reactions"].values())
    for name, wanted in forces["reactions"].items():
        mine = run.reaction(name)
        found = np.array([mine.fx[k], mine.fy[k], mine.torque[k]])
        assert np.abs(found - wanted).max() < 1e-10 * top, name
    for name, wanted in forces["efforts"].items():
        assert abs(run.effort(name)[k] - wanted) < 1e-10 * top, name
    return forces

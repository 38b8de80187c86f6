"""Cross-check by Pinocchio: efforts, joint forces, and accelerations by forward dynamics.

J. Carpentier et al., The Pinocchio C++ library, SII 2019. The mechanism is modelled as a tree of
its joints with loop constraints; from the run only the motion is taken.
"""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.engines.balance import Comparison, CrosscheckResult, Inexpressible
from mbody.engines.independent_reading import laws_of
from mbody.engines.pinocchio.dynamics import (
    Forces,
    Forward,
    Instant,
    Inverse,
    Undetermined,
    integrate,
)
from mbody.engines.spanning_tree import spanning_tree
from mbody.errors import SolveError
from mbody.model.element import listed
from mbody.solution.solution import Solution
from mbody.system.system import System

__all__ = ["crosscheck_result"]

Array = np.ndarray

#: Most bodies times instants.
NUMBERS = 4000


def crosscheck_result(system: System, run: Solution) -> CrosscheckResult:
    """Cross-check by Pinocchio of a result of kinetostatics, statics or simulate.

    Raises SolveError where Pinocchio is not installed.
    """
    try:
        import pinocchio  # noqa: F401
    except ImportError:
        raise SolveError(
            "Pinocchio is not installed: pip install pin (on Windows it is not packaged: use WSL, "
            "or leave it out of against)"
        ) from None
    return _PinocchioCheck(system, run).result()


class _PinocchioCheck:
    """One check by Pinocchio."""

    def __init__(self, system: System, run: Solution) -> None:
        self.comparison, self.notes = Comparison(), list[str]()
        most = max(2, NUMBERS // max(1, len(system.mechanism.bodies)))
        if len(run) > most:
            self.notes.append(f"compared at {most} of {len(run)} instants, evenly over the run")
            run = run.take(np.linspace(0, len(run) - 1, most).round().astype(int))
        self.system, self.run = system, run
        self.tree = spanning_tree(system)
        self.inverse = Inverse(system, self.tree, run)
        self.missing = [self._missing(element) for element in self.inverse.others]
        self.expected: dict[str, Any] = {}
        self.reasons: dict[str, str] = {}

    @staticmethod
    def _missing(element: Any) -> Inexpressible:
        kind = type(element).__name__
        return Inexpressible(
            element.name,
            f"Pinocchio has no {kind}: its force from our result was applied, and the balance of "
            "all other forces is compared",
        )

    def result(self) -> CrosscheckResult:
        found = [self.inverse.at(k) for k in range(len(self.run))]
        rank = max((forces.rank for _, forces in found), default=0)
        good = [
            k
            for k, (_, forces) in enumerate(found)
            if forces.rank == rank and forces.condition < tol.COMPARISON_CONDITION_SINGULAR
        ]
        if len(good) < len(found):
            self.notes.append(
                f"{len(found) - len(good)} of {len(found)} instants are singular positions: they "
                "are not compared"
            )
        if not good:
            why = "every instant is a singular position"
            self.missing.append(Inexpressible("model", why))
        self._motion(found, good)
        self._forces(found, good)
        if self.run.analysis != "statics":
            self._forward(good, found)
        adopted = self.inverse.adopted
        if adopted:
            self.notes.append(f"taken from our result as forces: {listed(adopted)}")
        rows = self.comparison.rows(self.expected, self.reasons)
        engine = f"pinocchio {version('pin')}"
        taken = (*adopted, *(element.name for element in self.inverse.others))
        return CrosscheckResult(engine, tuple(rows), tuple(self.missing), tuple(self.notes), taken)

    # -- compared quantities -------------------------------------------------------------------

    def _motion(self, found: list[tuple[Instant, Forces]], good: list[int]) -> None:
        """Compare poses, rates and accelerations of bodies and drivers, and the gaps of loops."""
        system, run, comparison = self.system, self.run, self.comparison
        length = system.length
        rates = max((float(np.abs(run[b].omega[good]).max(initial=0.0)) for b in run), default=0.0)
        comparison.size("place", length)
        comparison.size("angle", 1.0)
        comparison.size("turning acceleration", rates * rates)
        at_rest = run.analysis == "statics"
        parts = [
            ("place", 0, ("x", "y")),
            ("angle", 0, ("angle",)),
            ("velocity", 1, ("vx", "vy")),
            ("turning", 1, ("omega",)),
            ("acceleration", 2, ("ax", "ay")),
            ("turning acceleration", 2, ("alpha",)),
        ]
        for name in run:
            poses = [found[k][0].bodies[name] for k in good]
            table = [
                np.array([[*p.place, p.angle] for p in poses]).reshape(-1, 3),
                np.array([p.velocity for p in poses]).reshape(-1, 3),
                np.array([p.acceleration for p in poses]).reshape(-1, 3),
            ]
            for kind, order, keys in parts:
                if at_rest and order:
                    continue
                for key in keys:
                    column = 2 if len(keys) == 1 else "xy".index(key[-1])
                    ours, theirs = getattr(run[name], key)[good], table[order][:, column]
                    if key == "angle":
                        theirs = ours + _nearest(theirs - ours)
                    comparison.add(kind, f"{name}.{key}", ours, theirs)
        self._driven(found, good)
        # rotations are compared relative to translations
        comparison.size("turning", comparison.top("velocity") / length)
        comparison.size("turning acceleration", comparison.top("acceleration") / length)
        gaps = ("gap", "gap rate", "gap acceleration")
        tops = [1.0, comparison.top("velocity") / length, comparison.top("acceleration") / length]
        for name in found[0][1].gaps if found else ():
            history = np.array([found[k][1].gaps[name] for k in good]).reshape(-1, 3)
            for n, kind in enumerate(gaps[: 1 if at_rest else 3]):
                comparison.size(kind, tops[n])
                comparison.add(kind, f"{name}.{kind}", np.zeros(len(good)), history[:, n])
        # the condition of the loops amplifies positions, rates and accelerations equally
        worse = (
            tol.COMPARISON_OPERATIONS
            * tol.MACHINE_EPSILON
            * np.array([found[k][1].condition for k in good])
        )
        whole = f"rounding times the condition of the loops, {_top(found, good):.3g}"
        for kind in comparison.kinds:
            self.expected[kind], self.reasons[kind] = worse, whole

    def _driven(self, found: list[tuple[Instant, Forces]], good: list[int]) -> None:
        """Compare the values of the drivers by Pinocchio's kinematics."""
        at_rest = self.run.analysis == "statics"
        for driver in self.system.drivers:
            theirs = np.array([found[k][1].given[driver.name] for k in good]).reshape(-1, 3)
            kinds = ("angle", "turning", "turning acceleration")
            if not driver.angular:
                kinds = ("place", "velocity", "acceleration")
            ours = [part[good] for part in self.run.driven(driver.name)]
            if driver.angular:
                theirs[:, 0] = ours[0] + _nearest(theirs[:, 0] - ours[0])
            by_law = laws_of(self.system, self.run, driver, good)
            for n, key in enumerate(("value", "rate", "acceleration")[: 1 if at_rest else 3]):
                self.comparison.add(kinds[n], f"{driver.name}.{key}", ours[n], theirs[:, n])
                if by_law is not None:
                    name = f"{driver.name}.{key} by its law"
                    self.comparison.add(kinds[n], name, ours[n], by_law[n])

    def _forces(self, found: list[tuple[Instant, Forces]], good: list[int]) -> None:
        """Compare every effort and every unique reaction, and the residual in free joints."""
        system, run, comparison = self.system, self.run, self.comparison
        open_ones = []
        for joint in system.mechanism.joints:
            if joint in self.inverse.others:
                continue
            ours = run.reaction(joint.name)
            unique = ours.unique or (False, False, False)
            theirs = np.array([found[k][1].reactions[joint.name] for k in good]).reshape(-1, 3)
            for n, key in enumerate(("fx", "fy", "torque")):
                kind = "torque" if n == 2 else "force"
                if not unique[n]:
                    open_ones.append(f"{joint.name}.{key}")
                else:
                    comparison.add(
                        kind, f"{joint.name}.{key}", getattr(ours, key)[good], theirs[:, n]
                    )
        for driver in system.drivers:
            kind = driver.effort_dimension
            theirs = np.array([found[k][1].efforts[driver.name] for k in good])
            comparison.add(kind, f"{driver.name}.effort", run.effort(driver.name)[good], theirs)
        needed = np.array([found[k][1].needed for k in good])
        comparison.size("force", needed)
        comparison.size("torque", system.length * comparison.top("force"))
        left = np.array([found[k][1].residual for k in good])
        comparison.add("force", "balance", np.zeros(len(good)), left)
        if open_ones:
            self.notes.append(
                f"not determined by the redundant constraints, not compared: {listed(open_ones)}"
            )
        worse = (
            tol.COMPARISON_OPERATIONS
            * tol.MACHINE_EPSILON
            * np.array([found[k][1].condition for k in good])
        )
        for kind in ("force", "torque"):
            self.expected[kind] = worse
            self.reasons[kind] = (
                f"rounding times the condition of the loops, {_top(found, good):.3g}"
            )

    def _path(self, forward: Forward, found: list[tuple[Instant, Forces]]) -> None:
        """Compare the motion over time, from the first instant on."""
        inverse, run, comparison = self.inverse, self.run, self.comparison
        alien = [element.name for element in inverse.others] + inverse.adopted
        if alien:
            why = f"forces of {listed(alien)} are known only along our motion"
            self.missing.append(Inexpressible("motion over time", why))
            return
        error = 0.0
        if run.energy is not None and run.energy.size:
            error = float(np.abs(run.energy.balance).max(initial=0.0)) / run.energy.size
        integrated = integrate(forward, np.array([forces.condition for _, forces in found]))
        count = len(integrated.q)
        still = np.zeros_like(integrated.q)
        poses = [
            forward.twin.at(q, v, v, np.zeros(2)).bodies
            for q, v in zip(integrated.q, still, strict=True)
        ]
        comparison.size("path", self.system.length)
        comparison.size("path angle", 1.0)
        for name in run:
            for n, key in enumerate(("x", "y")):
                theirs = np.array([pose[name].place[n] for pose in poses])
                comparison.add(
                    "path", f"{name}.{key} over time", getattr(run[name], key)[:count], theirs
                )
            theirs = np.array([pose[name].unwrapped_angle for pose in poses])
            comparison.add("path angle", f"{name}.angle over time", run[name].angle[:count], theirs)
        if integrated.why:
            self.notes.append(
                f"the motion was integrated to t = {run.t[count - 1]:.6g}, {count} of {len(run)} "
                f"instants: {integrated.why}"
            )
        both = max(error, integrated.gap, tol.COMPARISON_STEPS_PINOCCHIO)
        for kind, unit in (("path", self.system.length), ("path angle", 1.0)):
            self.expected[kind] = (
                (
                    tol.COMPARISON_LOCAL_PINOCCHIO
                    + tol.COMPARISON_MARGIN_PINOCCHIO * integrated.growth * both
                )
                * unit
                / comparison.top(kind)
            )
            self.reasons[kind] = (
                f"errors of both (energy {error:.1e}, loops {integrated.gap:.1e}), which the "
                f"motion makes {integrated.growth.max(initial=0.0):.3g} times as great"
            )

    def _forward(self, good: list[int], found: list[tuple[Instant, Forces]]) -> None:
        """Compare the accelerations by forward dynamics from loads and efforts."""
        forward, run, inverse = Forward(self.inverse), self.run, self.inverse
        poses, rounding, kept, why = [], [], [], ""
        for k in good:
            try:
                a, limit = forward.at(k)
            except Undetermined as error:
                why = str(error)
                continue
            poses.append(forward.twin.at(inverse.q[k], inverse.v[k], a, np.zeros(2)).bodies)
            rounding.append(limit)
            kept.append(k)
        if not kept:
            if why:
                self.missing.append(Inexpressible("forward dynamics", why))
            return
        if why:
            self.notes.append(
                f"accelerations by the forces at {len(kept)} of {len(good)} instants: at the "
                f"others {why}"
            )
        for name in run:
            theirs = np.array([pose[name].acceleration for pose in poses]).reshape(-1, 3)
            for n, key in enumerate(("ax", "ay", "alpha")):
                kind = "forward turning" if n == 2 else "forward"
                ours = getattr(run[name], key)[kept]
                self.comparison.add(kind, f"{name}.{key} by the forces", ours, theirs[:, n])
        length = self.system.length
        self.comparison.size("forward", self.comparison.top("acceleration"))
        self.comparison.size("forward turning", self.comparison.top("turning acceleration"))
        limits = tol.COMPARISON_OPERATIONS * np.array(rounding)
        if run.analysis == "simulate":
            self._path(forward, found)
        for kind, unit in (("forward", length), ("forward turning", 1.0)):
            self.expected[kind] = (
                tol.COMPARISON_OPERATIONS * tol.MACHINE_EPSILON
                + limits * unit / self.comparison.top(kind)
            )
            self.reasons[kind] = "rounding of loads, times the condition of masses and loops"


def _nearest(angles: Array) -> Array:
    """Angles without whole revolutions."""
    return np.array([math.remainder(angle, 2.0 * math.pi) for angle in angles])


def _top(found: list[tuple[Instant, Forces]], good: list[int]) -> float:
    """The greatest condition of the compared instants."""
    return max((found[k][1].condition for k in good), default=1.0)

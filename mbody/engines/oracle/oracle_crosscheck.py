"""Cross-check by the oracle: the same analysis with dense matrices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbody.core import tolerances as tol
from mbody.engines.balance import Comparison, CrosscheckResult, Inexpressible, follows_formula
from mbody.engines.oracle.contact_motion import (
    UNTIMED,
    OracleContacts,
    contact_crosscheck,
    own_tolerance,
)
from mbody.engines.oracle.friction import has_friction
from mbody.engines.oracle.mechanics import Reference, law_at
from mbody.model.joints import Belt, FrictionForce, PinSlot, Prismatic
from mbody.solution.histories import auxiliary_history
from mbody.solution.solution import Solution
from mbody.system.assembler import assemble
from mbody.system.system import System

# -- The cross-check by the oracle of forces of a driven motion that keeps contacts closed ---------
# Its own gaps, normals and sliding rates at our positions; then one dense system of all rows, with
# friction as a part of the normal force of what slides, and as an unknown of what rolls.

Array = np.ndarray

#: Instants that are compared, evenly over the run.
INSTANTS = 25


def closed_contact_crosscheck(system: System, run: Solution) -> CrosscheckResult:
    """Gaps, and all forces, at some instants."""
    if any(has_friction(joint) for joint in system.mechanism.joints):
        raise NotImplementedError("it has no friction of joints beside contacts")
    check = _ClosedCheck(system, run)
    count = len(run)
    instants = np.unique(np.linspace(0, count - 1, min(count, INSTANTS)).round().astype(int))
    for k in instants.tolist():
        check.at(k)
    return check.result(instants)


class _ClosedCheck:
    """Forces of the oracle, instant by instant."""

    def __init__(self, system: System, run: Solution) -> None:
        self.system, self.run, machine = system, run, system.mechanism
        self.reference = Reference(machine)
        self.closed = [one for one in machine.contacts if one.closed]
        self.contacts = OracleContacts(self.reference, self.closed)
        self.scale = np.tile([1.0, 1.0, 1.0 / system.length], len(machine.bodies))
        self.conditions: list[float] = []
        self.gaps: list[dict[str, float]] = []
        self.efforts: list[dict[str, float]] = []
        self.pressing: list[dict[str, float]] = []
        self.reactions: list[dict[str, Array]] = []
        self.loads: list[float] = []
        self.motions: list[Array] = []

    def _state(self, keys: tuple[str, ...], k: int) -> Array:
        bodies = self.system.mechanism.bodies
        return np.array([float(getattr(self.run[b.name], key)[k]) for b in bodies for key in keys])

    def at(self, k: int) -> None:
        """The forces at an instant, by our motion."""
        oracle, contacts, machine = self.reference, self.contacts, self.system.mechanism
        t, q = float(self.run.t[k]), self._state(("x", "y", "angle"), k)
        still = np.zeros_like(q)
        v = a = still
        if self.run.analysis != "statics":
            v = self._state(("vx", "vy", "omega"), k)
            a = self._state(("ax", "ay", "alpha"), k)
        oracle.own = own_values(self.run, k)
        gaps = contacts.gaps(q)
        closed = np.abs(gaps) <= tol.CONTACT_GAP_CLOSED_RESULT * self.system.length
        names = [candidate.name for candidate in contacts.candidates]
        count, W, rates = len(names), contacts.rows(q), np.real(contacts.rates(q, v))
        rolls = {one.name: one.rolls for one in self.closed}
        velocity_scale, columns, owners = float(np.abs(v).max(initial=0.0)), [], []
        for n in np.flatnonzero(closed).tolist():
            slides = (
                abs(rates[count + n]) > tol.RATE_NONE_FRICTION * velocity_scale
                and not rolls[names[n]]
            )
            mu = contacts.candidates[n].friction * math.copysign(1.0, rates[count + n]) * slides
            columns.append(W[n] - mu * W[count + n])
            owners.append(names[n])
            if rolls[names[n]]:
                columns.append(W[count + n])
                owners.append("")
        g = oracle.phi_q(q, t)
        rolling = [n for n in np.flatnonzero(closed).tolist() if rolls[names[n]]]
        self._motion(k, q, v, np.flatnonzero(closed), count + np.array(rolling, dtype=int))
        A = np.vstack([-g, *columns]).T * self.scale[:, None]
        f = oracle.applied(q, v, t)
        right = (oracle.mass_matrix() @ a - f) * self.scale
        found, _, _, sizes = np.linalg.lstsq(A, right, rcond=tol.LEAST_SQUARES_RANK_FINE)
        kept = sizes[sizes > tol.LEAST_SQUARES_RANK_FINE * sizes[0]]
        self.conditions.append(float(sizes[0] / kept[-1]))
        lam, normal = found[: len(g)], found[len(g) :]
        self.efforts.append({d.name: -float(lam[oracle.rows[d.name]][0]) for d in machine.drivers})
        self.reactions.append(oracle.reactions(q, t, lam))
        press = {one.name: 0.0 for one in self.closed}
        for name, force in zip(owners, normal, strict=True):
            if name:
                press[name] += float(force)
        self.pressing.append(press)
        least = {one.name: math.inf for one in self.closed}
        for name, gap in zip(names, gaps, strict=True):
            least[name] = min(least[name], abs(float(gap)))
        self.gaps.append(least)
        self.loads.append(float(np.abs(np.append(right, self.scale * f)).max(initial=0.0)))

    def _motion(self, k: int, q: Array, v: Array, closed: Array, rolling: Array) -> None:
        """Note (3, 3n): position, velocity and acceleration by rows of joints and contacts, those
        of ours nearest to them where the rows leave some freedom.
        """
        oracle, contacts, run, t = self.reference, self.contacts, self.run, float(self.run.t[k])
        timed = [one.name for one in self.system.drivers if not follows_formula(one)]
        given = [{name: float(run.driven(name)[order][k]) for name in timed} for order in range(3)]

        def nearest(rows: Array, right: Array, own: Array) -> Array:
            scaled = rows / self.scale
            left = right - rows @ own
            step = np.linalg.lstsq(scaled, left, rcond=tol.LEAST_SQUARES_RANK_FINE)[0]
            return np.asarray(own + step / self.scale)

        W = contacts.rows(q)
        rows = np.vstack([oracle.phi_q(q, t), W[closed]])
        phi = oracle.with_driver_values(-oracle.phi(q, t), given[0], t, 0)
        place = nearest(rows, np.append(phi, -contacts.gaps(q)[closed]) + rows @ q, q)
        if run.analysis == "statics":
            self.motions.append(np.array([place, 0.0 * q, 0.0 * q]))
            return
        rows = np.vstack([rows, W[rolling]])
        none = np.zeros(len(closed) + len(rolling))
        nu = oracle.with_driver_values(oracle.nu(q, t), given[1], t, 1)
        speed = nearest(rows, np.append(nu, none), v)
        gamma = oracle.with_driver_values(oracle.gamma(q, v, t), given[2], t, 2)
        drift = contacts.drift(q, v)[np.append(closed, rolling)]
        a = self._state(("ax", "ay", "alpha"), k)
        self.motions.append(np.array([place, speed, nearest(rows, np.append(gamma, -drift), a)]))

    def _compare_motion(self, comparison: Comparison, instants: Array) -> None:
        keys = [("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha")]
        kinds = [("place", "angle"), ("velocity", "turning"), ("acceleration", "turned")]
        table = np.array(self.motions)
        for n, body in enumerate(self.system.mechanism.bodies):
            for order in range(1 if self.run.analysis == "statics" else 3):
                for part, key in enumerate(keys[order]):
                    ours = getattr(self.run[body.name], key)[instants]
                    theirs = table[:, order, 3 * n + part]
                    comparison.add(kinds[order][part == 2], f"{body.name}.{key}", ours, theirs)
        comparison.size("angle", 1.0)
        length = self.system.length
        rates = np.abs(table[:, 1, 2::3]).max(initial=0.0)
        comparison.size("turned", rates * rates)
        for moves, rotates in (("velocity", "turning"), ("acceleration", "turned")):
            linear, angular = comparison.top(moves), comparison.top(rotates)
            comparison.size(moves, length * angular)
            comparison.size(rotates, linear / length)

    def result(self, instants: Array) -> CrosscheckResult:
        """All of it beside ours."""
        run, comparison = self.run, Comparison()
        comparison.size("place", self.system.length)
        self._compare_motion(comparison, instants)
        for one in self.closed:
            theirs = [gaps[one.name] for gaps in self.gaps]
            comparison.add("place", f"{one.name}: gap", np.zeros(len(instants)), theirs)
        for one in self.closed:
            ours = run.contact(one.name)[instants]
            theirs = [press[one.name] for press in self.pressing]
            comparison.add("force", f"{one.name}.contact", ours, theirs)
        for driver in self.system.mechanism.drivers:
            kind, theirs = driver.effort_dimension, [one[driver.name] for one in self.efforts]
            comparison.add(kind, f"{driver.name}.effort", run.effort(driver.name)[instants], theirs)
        for joint in self.system.mechanism.joints:
            own = run.reaction(joint.name)
            for n, key in enumerate(("fx", "fy", "torque")):
                theirs = [float(one[joint.name][n]) for one in self.reactions]
                kind = "torque" if n == 2 else "force"
                ours = getattr(own, key)[instants]
                if own.unique is not None and own.unique[n]:
                    comparison.add(kind, f"{joint.name}.{key}", ours, theirs)
        comparison.size("force", self.loads)
        comparison.size("torque", self.system.length * comparison.top("force"))
        limit = tol.COMPARISON_OPERATIONS * float(np.finfo(float).eps) * np.array(self.conditions)
        why = f"rounding times the condition of its equations, {max(self.conditions):.3g}"
        kinds = comparison.kinds
        rows = comparison.rows(dict.fromkeys(kinds, limit), dict.fromkeys(kinds, why))
        return CrosscheckResult("oracle", tuple(rows), (), ())


def own_values(run: Solution, k: int) -> dict[str, float]:
    """Inputs and auxiliary states of a result at an instant, by name."""
    machine = run.mechanism
    every = (*machine.inputs, *machine.states)
    return {one.name: float(auxiliary_history(run, one.name)[k]) for one in every}


def modes_of(run: Solution, k: int) -> dict[str, str]:
    """How frictional joints move at an instant, by name."""
    return {
        joint.name: run.mode(joint.name)[k] for joint in run.mechanism.joints if joint.has_friction
    }


#: Most instants, evenly over the run, and most numbers (coordinates times instants): it is slow.
MOST_INSTANTS, MOST_NUMBERS = 25, 600
#: Most spans over which auxiliary states are followed.
MOST_SPANS = 12


def crosscheck_result(system: System, run: Solution) -> CrosscheckResult:
    """Cross-check by the dense oracle of a result of kinetostatics, statics or simulate."""
    own = assemble(system.mechanism).values
    # the histories of inputs and auxiliary states are read from the result
    free = {one.name for one in (*system.mechanism.inputs, *system.mechanism.states)}
    differing = [
        name
        for name, value in own.items()
        if name.partition(".")[0] not in free and np.any(value != system.values[name])
    ]
    if differing:
        why = f"it reads the description, but the system has another {differing[0]}"
        return CrosscheckResult("oracle", (), (Inexpressible("model", why),))
    try:
        if run.mechanism.contacts and run.analysis == "simulate":
            return contact_crosscheck(system, run)
        if any(one.closed for one in run.mechanism.contacts):
            return closed_contact_crosscheck(run.system, run)
        return _OracleCheck(system, run).result()
    except NotImplementedError as error:
        return CrosscheckResult("oracle", (), (Inexpressible("model", str(error)),))


class _OracleCheck:
    """One check by the oracle."""

    def __init__(self, system: System, run: Solution) -> None:
        self.system, self.run, self.comparison = system, run, Comparison()
        self.reference = Reference(system.mechanism)
        self.unit = system.coordinate_units
        self.size = np.tile([1.0, 1.0, system.length], len(system.mechanism.bodies))
        self.frictional = any(has_friction(joint) for joint in system.mechanism.joints)
        self.notes: list[str] = []
        self.open: set[str] = set()
        #: Rates of what sticks, and its forces as parts of their limits.
        self.sticking: list[tuple[dict[str, float], dict[str, float]]] = []

    def result(self) -> CrosscheckResult:
        count, size = len(self.run), 3 * self.reference.n
        wanted = min(count, max(2, min(MOST_INSTANTS, MOST_NUMBERS // max(size, 1))))
        instants = np.unique(np.linspace(0, count - 1, wanted).round().astype(int))
        # where the result says that none are consistent, or several, it has none to compare
        several = [one.t for one in self.run.events if one.name in UNTIMED]
        instants = instants[~np.isin(self.run.t[instants], several)]
        if not len(instants):
            raise NotImplementedError("the result has no instant with accelerations of one kind")
        found = [self._oracle_instant(int(k)) for k in instants]
        found, instants = self._solved(found, instants)
        smooth = [n for n, one in enumerate(found) if not one["jumps"]]
        if len(smooth) < len(found):
            self.notes.append(
                f"at {len(found) - len(smooth)} instants the acceleration of a law jumps and "
                "has two values: not compared"
            )
        found, instants = [found[n] for n in smooth], instants[smooth]
        closed = np.array([0.0 if one["closes"] else math.nan for one in found])
        self.comparison.add(
            "closing", "loops close near our position", np.zeros(len(found)), closed
        )
        found, instants = [one for one in found if one["closes"]], instants[closed == 0.0]
        rank = max((one["rank"] for one in found), default=0)
        good = [n for n, one in enumerate(found) if one["rank"] == rank]
        good = [n for n in good if found[n]["condition"] < tol.COMPARISON_CONDITION_SINGULAR]
        if wanted < count:
            self.notes.append(f"compared at {wanted} of {count} instants, evenly over the run")
        if len(good) < len(found):
            note = f"{len(found) - len(good)} instants are singular positions: not compared"
            self.notes.append(note)
        self._compare([found[n] for n in good], instants[good])
        moving = self.run.analysis == "simulate"
        more = self._sticks() if moving else {}
        more |= self._states() if moving and self.run.mechanism.states else {}
        worst = np.array([found[n]["condition"] for n in good])
        limit = tol.COMPARISON_OPERATIONS * tol.MACHINE_EPSILON * worst
        why = f"rounding times the condition of Φ_q, {worst.max(initial=1.0):.3g}"
        kinds = self.comparison.kinds
        limits: dict[str, Any] = dict.fromkeys(kinds, limit) | {
            "closing": tol.COMPARISON_OPERATIONS * tol.MACHINE_EPSILON
        }
        reasons = dict.fromkeys(kinds, why) | dict.fromkeys(more, "errors of the integrators")
        rows = self.comparison.rows(limits | more, reasons)
        return CrosscheckResult("oracle", tuple(rows), (), tuple(self.notes))

    def _solved(
        self, found: list[dict[str, Any]], instants: Array
    ) -> tuple[list[dict[str, Any]], Array]:
        """Without the instants that the oracle does not solve, and a note with their reason."""
        failed = [one["why"] for one in found if one["why"]]
        if len(failed) == len(found):
            raise NotImplementedError(failed[0])
        if failed:
            self.notes.append(f"not compared at {len(failed)} instants: {failed[0]}")
        kept = [n for n, one in enumerate(found) if not one["why"]]
        return [found[n] for n in kept], instants[kept]

    def _state(self, keys: tuple[str, ...], k: int) -> Array:
        """Our own histories at an instant, as coordinates (3n,)."""
        run = self.run
        return np.array([float(getattr(run[b.name], key)[k]) for b in self._bodies for key in keys])

    @property
    def _bodies(self) -> Any:
        return self.system.mechanism.bodies

    def _oracle_instant(self, k: int) -> dict[str, Any]:
        """The oracle's own position, motion and forces, starting from our position; "why" where it
        does not find them.
        """
        oracle, run, t = self.reference, self.run, float(self.run.t[k])
        oracle.own = own_values(run, k)
        drivers = [driver.name for driver in self.system.drivers]
        # what others follow is a formula, which the oracle reads by itself
        timed = [one.name for one in self.system.drivers if not follows_formula(one)]
        given = [{name: float(run.driven(name)[order][k]) for name in timed} for order in range(3)]
        guess = self._state(("x", "y", "angle"), k)
        found: dict[str, Any] = {"closes": True, "jumps": False, "why": ""}
        try:
            q = oracle.close(guess, t, given[0])
        except ArithmeticError:
            return found | {"closes": False, "rank": 0, "condition": math.inf}
        rows = oracle.phi_q(q, t) * self.unit
        s = np.linalg.svd(rows, compute_uv=False) if rows.size else np.ones(1)
        kept = s[s > tol.LEAST_SQUARES_RANK * s.max(initial=0.0)]
        found |= {"q": q, "rank": len(kept)}
        found["condition"] = float(kept[0] / kept[-1]) if len(kept) else 1.0
        try:
            if run.analysis == "statics":
                v = a = np.zeros_like(q)
                forces = oracle.kinetostatics(q, v, a, t)
            elif run.analysis == "simulate":
                v = self._state(("vx", "vy", "omega"), k)
                a, forces = self._dynamics(q, v, t, drivers, modes_of(run, k))
                found["condition"] = self._saddle_condition(rows)
            else:
                v = oracle.velocities(q, t, given[1])
                a = oracle.accelerations(q, v, t, given[2])
                forces = oracle.kinetostatics(q, v, a, t)
                found["jumps"] = self._jumps(q, v, t)
            still = oracle.applied(q, v, t)
        except NotImplementedError as error:
            return found | {"why": str(error)}
        load = np.concatenate([still, still - oracle.mass_matrix() @ a]) / np.tile(self.size, 2)
        return found | {"v": v, "a": a, "forces": forces, "load": load}

    def _dynamics(
        self,
        q: Array,
        v: Array,
        t: float,
        drivers: list[str],
        modes: dict[str, str],
        *,
        only: bool = False,
    ) -> tuple[Array, dict[str, Any]]:
        """Accelerations, and (unless these `only`) forces as `kinetostatics` returns them."""
        oracle = self.reference
        if self.frictional:
            found = oracle.frictional_dynamics(q, v, t, drivers, modes)
            a, lam, unique, wrench = found.a, found.lam, found.unique, found.wrench
            self.sticking.append((found.rates, found.held))
        else:
            a, lam = oracle.dynamics(q, v, t, drivers)
            if only:
                return a, {}
            unique, wrench = oracle.kinetostatics(q, v, a, t)["unique"], {}
        reactions = oracle.reactions(q, t, lam)
        whole = {name: one + wrench.get(name, 0.0) for name, one in reactions.items()}
        efforts = {d: -float(lam[oracle.rows[d]][0]) for d in drivers}
        return a, {"reactions": whole, "efforts": efforts, "unique": unique}

    def _sticks(self) -> dict[str, Array | float]:
        """Compare the rates of joints that stick with zero, and their forces with their limits."""
        limit = tol.COMPARISON_LEAST_ORACLE + tol.COMPARISON_MARGIN_ORACLE * own_tolerance(self.run)
        v = [np.array([getattr(self.run[b.name], k) for k in ("vx", "vy")]) for b in self._bodies]
        w = [np.abs(self.run[b.name].omega).max(initial=0.0) for b in self._bodies]
        fastest = max([*(np.abs(one).max(initial=0.0) for one in v), self.system.length * max(w)])
        for joint in self.system.mechanism.joints:
            rates = [one[joint.name] for one, _ in self.sticking if joint.name in one]
            held = [one[joint.name] for _, one in self.sticking if joint.name in one]
            if rates:
                name, unit = f"{joint.name}: rate while it sticks", self.system.length
                slides = isinstance(joint, Prismatic | PinSlot | FrictionForce | Belt)
                found = np.array(rates) * (1.0 if slides else unit)
                self.comparison.add("sticks", name, found, np.zeros(len(rates)))
            if held:
                name = f"{joint.name}: part of its limit while it sticks"
                self.comparison.add("holds", name, held, np.minimum(held, 1.0))
        for event in self.run.events:
            part = self._when_it_slips(event)
            if part is not None:
                name = f"{event.contact}: part of its limit where it slips"
                self.comparison.add("holds", name, [part], [max(part, 1.0)])
        free = math.sqrt(self.comparison.top("acceleration") * self.system.length)
        self.comparison.size("sticks", max(fastest, free))
        self.comparison.size("holds", 1.0)
        return {"sticks": limit, "holds": max(limit, tol.ORACLE_EVENT_NEAR)}

    def _when_it_slips(self, event: Any) -> float | None:
        """The force that would hold a joint where it begins to slip, or turns, as a part of its
        limit: at least 1.
        """
        names = {joint.name for joint in self.system.mechanism.joints if joint.has_friction}
        if event.name != "slip" or event.contact not in names or event.state is None:
            return None
        state, oracle = event.state, self.reference
        oracle.own = own_values(state, 0)
        bodies = [state[body.name] for body in self._bodies]
        q, v = (
            np.array([float(getattr(body, key)[0]) for body in bodies for key in keys])
            for keys in (("x", "y", "angle"), ("vx", "vy", "omega"))
        )
        modes = modes_of(state, 0) | {event.contact: "stick"}
        drivers = [driver.name for driver in self.system.drivers]
        try:
            found = oracle.frictional_dynamics(q, v, float(event.t), drivers, modes)
        except NotImplementedError:
            return None
        return found.held.get(event.contact)

    # -- states, from one instant of the result to the next ------------------------------------

    def _states(self) -> dict[str, Array | float]:
        """Compare the auxiliary states after spans without events that begin at our state; what is
        expected, by kind.
        """
        run, names = self.run, [one.name for one in self.system.mechanism.states]
        spans = self._spans()
        for one in run.mechanism.inputs:
            by_law = np.array([float(law_at(one.value, float(t))) for t in run.t])
            given = auxiliary_history(run, one.name)
            off = np.abs(by_law - given).max(initial=0.0)
            if not off <= tol.COMPARISON_READING * np.abs(given).max(initial=0.0):
                self.notes.append(f"states are not compared: '{one.name}' follows a history")
                return {}
        if not spans:
            return {}
        own = max(own_tolerance(run), tol.RTOL_COMPARISON)
        ends = [
            np.array([self._after(k, rtol) for k in spans])
            for rtol in (max(0.01 * own, tol.RTOL_COMPARISON), own)
        ]
        after = np.array(spans) + 1
        expected: dict[str, Array | float] = {}
        for n, name in enumerate(names):
            history = auxiliary_history(run, name)
            kind = f"{name} over time"
            self.comparison.size(kind, history)
            self.comparison.add(kind, kind, history[after], ends[0][:, n])
            off = float(np.abs(ends[1][:, n] - ends[0][:, n]).max())
            top = self.comparison.top(kind) or 1.0
            expected[kind] = tol.COMPARISON_MARGIN_ORACLE * (10.0 * own + off / top)
        return expected

    def _spans(self) -> list[int]:
        """Instants from which nothing changes its mode up to the next, evenly over the run."""
        run, events = self.run, np.array([one.t for one in self.run.events])
        quiet = [
            k
            for k in range(len(run) - 1)
            if run.t[k + 1] > run.t[k]
            and not ((events >= run.t[k]) & (events <= run.t[k + 1])).any()
            and modes_of(run, k) == modes_of(run, k + 1)
        ]
        wanted = max(2, min(MOST_SPANS, MOST_NUMBERS // (10 * self.reference.n)))
        picked = np.unique(np.linspace(0, len(quiet) - 1, min(wanted, len(quiet))).round())
        return [quiet[int(n)] for n in picked]

    def _after(self, k: int, rtol: float) -> Array:
        """Auxiliary states at the instant after k, from our state at k."""
        from scipy.integrate import solve_ivp

        oracle, run = self.reference, self.run
        drivers, modes = [driver.name for driver in self.system.drivers], modes_of(run, k)
        names = [one.name for one in run.mechanism.states]
        start = own_values(run, k)
        q, v = self._state(("x", "y", "angle"), k), self._state(("vx", "vy", "omega"), k)
        size = len(q)

        def rates(t: float, y: Array) -> Array:
            inputs = {one.name: float(law_at(one.value, t)) for one in run.mechanism.inputs}
            oracle.own = inputs | dict(zip(names, y[2 * size :], strict=True))
            place, speed = y[:size], y[size : 2 * size]
            a = self._dynamics(place, speed, t, drivers, modes, only=True)[0]
            changes = oracle.state_rates(place, speed, t)
            return np.concatenate([speed, a, [changes[name] for name in names]])

        begin = np.concatenate([q, v, [start[name] for name in names]])
        tops = [float(np.abs(auxiliary_history(run, name)).max()) or 1.0 for name in names]
        scale = np.concatenate([np.tile(self.size, 2), tops])
        span = float(run.t[k]), float(run.t[k + 1])
        found = solve_ivp(rates, span, begin, method="DOP853", rtol=rtol, atol=rtol * scale)
        if not found.success:
            raise NotImplementedError(f"its integrator ends after t = {span[0]:.6g}")
        return np.asarray(found.y[2 * size :, -1])

    def _jumps(self, q: Array, v: Array, t: float) -> bool:
        """Whether the accelerations of the laws differ before and after the instant."""
        fastest = float(np.abs(v / self.unit).max(initial=0.0))
        if not fastest:
            return False
        step = tol.ORACLE_JUMP_AROUND / fastest
        oracle = self.reference
        before, after = (oracle.gamma(q + s * v, v, t + s) for s in (-step, step))
        top = max(float(np.abs(one).max(initial=0.0)) for one in (before, after))
        # terms of γ that cancel, as those of wheels that mesh, leave the rounding of their size
        terms = float(np.abs(oracle.phi_q(q, t) * self.unit).max(initial=0.0)) * fastest**2
        least = max(tol.ORACLE_JUMP * top, tol.COMPARISON_OPERATIONS * tol.MACHINE_EPSILON * terms)
        return bool(np.abs(after - before).max(initial=0.0) > least)

    def _saddle_condition(self, rows: Array) -> float:
        """The condition of the saddle-point matrix of masses and constraints."""
        M = self.reference.mass_matrix() * np.outer(self.unit, self.unit)
        M = M / (M.max(initial=0.0) or 1.0)
        K = np.block([[M, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        s = np.linalg.svd(K, compute_uv=False)
        return float(s[0] / s[s > tol.LEAST_SQUARES_RANK_FINE * s[0]][-1])

    def _compare(self, found: list[dict[str, Any]], instants: Array) -> None:
        comparison, run = self.comparison, self.run
        comparison.size("place", self.system.length)
        comparison.size("angle", 1.0)
        keys = [("x", "y", "angle"), ("vx", "vy", "omega"), ("ax", "ay", "alpha")]
        kinds = [("place", "angle"), ("velocity", "turning"), ("acceleration", "turned")]
        table = [
            np.array([one[key] for one in found]).reshape(len(found), self.size.size)
            for key in "qva"
        ]
        rates = np.abs(table[1][:, 2::3]).max(initial=0.0)
        comparison.size("turned", rates * rates)
        if self.frictional and run.analysis == "simulate" and found:
            # what sticks has the accelerations of rounding: relative to what loads would give it
            own = np.diag(self.reference.mass_matrix())[::3]
            loads = np.abs([one["load"][: self.size.size] for one in found]).max(axis=0)
            heavy = own > 0.0
            free = np.maximum(loads[0::3], loads[1::3])[heavy] / own[heavy]
            comparison.size("acceleration", free.max(initial=0.0))
            comparison.size("turned", free.max(initial=0.0) / self.system.length)
        orders = 1 if run.analysis == "statics" else 3
        for n, body in enumerate(self._bodies):
            for order in range(orders):
                for part, key in enumerate(keys[order]):
                    kind = kinds[order][part == 2]
                    ours = getattr(run[body.name], key)[instants]
                    comparison.add(kind, f"{body.name}.{key}", ours, table[order][:, 3 * n + part])
        if orders > 1:
            # what turns moves points of its links, though centres may stand still, and the reverse
            length = self.system.length
            for moves, rotates in (("velocity", "turning"), ("acceleration", "turned")):
                linear, angular = comparison.top(moves), comparison.top(rotates)
                comparison.size(moves, length * angular)
                comparison.size(rotates, linear / length)
        for joint in self.system.mechanism.joints:
            self._reaction(joint.name, found, instants)
        machine = self.system.mechanism
        elements: tuple[Any, ...] = (*machine.couplings, *machine.drivers)
        for element in elements:
            kind = element.effort_dimension
            theirs = np.array([one["forces"]["efforts"].get(element.name, np.nan) for one in found])
            if element in machine.couplings and run.analysis == "simulate":
                continue
            comparison.add(
                kind, f"{element.name}.effort", run.effort(element.name)[instants], theirs
            )
        comparison.size("force", [np.abs(one["load"]).max(initial=0.0) for one in found])
        comparison.size("torque", self.system.length * comparison.top("force"))
        if self.open:
            self.notes.append(f"not determined, not compared: {len(self.open)} parts of reactions")

    def _reaction(self, name: str, found: list[dict[str, Any]], instants: Array) -> None:
        ours = self.run.reaction(name)
        theirs = np.array([one["forces"]["reactions"][name] for one in found]).reshape(-1, 3)
        alone = np.array([one["forces"]["unique"][name] for one in found]).reshape(-1, 3)
        unique = ours.unique or (False, False, False)
        for n, key in enumerate(("fx", "fy", "torque")):
            if not unique[n] or not alone[:, n].all():
                self.open.add(f"{name}.{key}")
                continue
            kind = "torque" if n == 2 else "force"
            self.comparison.add(kind, f"{name}.{key}", getattr(ours, key)[instants], theirs[:, n])

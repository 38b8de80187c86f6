"""The forces on every link over a motion, as a page has them: by reference to its histories."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mbody.analysis.driven.forces_on_several import acting_on_several, coupled, rows_on
from mbody.analysis.driven.free_body import Wrench, driven
from mbody.model.loads import Force, Gravity
from mbody.sheets.names import forces_on
from mbody.solution.checks import each_load_of
from mbody.solution.places import Place, moved
from mbody.solution.solution import Solution
from mbody.views.acting import wrench_names
from mbody.views.page_data import numbers, text_runs
from mbody.views.pose import Pose

__all__ = ["LINKS", "free_bodies_data"]

Array = np.ndarray

#: With more moving bodies than this nobody looks for one in a list.
LINKS = 60
#: What differs by no more than this part of the peak is the same history.
SAME = 1e-12
#: What is left of a moment when that of its force is taken off: rounding, as in `acting`.
ROUNDING = 1e-9


def free_bodies_data(
    run: Solution, data: Mapping[str, Any], shown: Mapping[str, Any]
) -> dict[str, Any] | None:
    """What a page needs, beside its histories, for the free-body diagram of every link.

    Parameters
    ----------
    run : Solution
        The motion of the page.
    data : dict
        As of ``run.data()``, whose histories are referred to.
    shown : dict
        The scene as the page has it.

    Returns
    -------
    dict or None
        Masses and moments of inertia by body, further histories, and by body the forces on it; None
        without forces, or with more bodies than `LINKS`. A component of a force is a number, or a
        product of what it names: ``by`` a factor, ``mass`` or ``inertia`` of a body, ``of`` a
        history of the page, ``own`` a further one.
    """
    if not run.has_forces or len(run.mechanism.bodies) > LINKS:
        return None
    return _FreeBodies(run, data, shown).found()


class _FreeBodies:
    """Collects the forces of all links."""

    def __init__(self, run: Solution, data: Mapping[str, Any], shown: Mapping[str, Any]) -> None:
        self.run, self.data, self.shown = run, data, shown
        self.pose = Pose(run, 0)
        self.machine, self.system = run.mechanism, run.system
        self.histories: dict[str, Any] = {}
        self.pool: dict[str, Array] = {}
        self.loads = np.array([each_load_of(run, k) for k in range(len(run))])
        self.still = run.analysis == "statics"

    def found(self) -> dict[str, Any]:
        """All links."""
        bodies = {body.name: list(self._on(body.name)) for body in self.machine.bodies}
        masses = {}
        for name, b in self.system.bodies.items():
            mass = self.system.mass[3 * b : 3 * b + 3, 0]
            masses[name] = [float(mass[0]), float(mass[2])]
        return {"masses": masses, "histories": self.histories, "bodies": bodies}

    # -- what acts on a body ----------------------------------------------------------------------

    def _on(self, body: str) -> Iterator[dict[str, Any]]:
        """Everything that acts on a body at some instant."""
        run, machine = self.run, self.machine
        names, number = forces_on(machine, body), 2 + list(self.system.bodies).index(body)

        def entry(cause: str, kind: str, where: str, place: Any, parts: Any) -> dict[str, Any]:
            force = float(np.hypot(parts[0], parts[1]).max()) if kind != "joint" else 1.0
            wrench = Wrench(cause, kind, 0.0, 0.0, force, 0.0, 0.0)
            (gid, text), (_, twist) = wrench_names(wrench, names, number, self.pose)
            said = [self._said(cause, body, *one) for one in zip("xym", parts, strict=True)]
            return {
                **{"n": gid, "t": plain_runs(text), "T": plain_runs(twist), "k": kind},
                **{"c": cause, "w": where, **place},
                **{"fx": said[0], "fy": said[1], "m": said[2]},
            }

        drawn = [(one["of"], one.get("load")) for one in self.shown["forces"]]
        for joint in machine.joints:
            if body in (joint.i.body, joint.j.body):
                own = run.reaction(joint.name, on=body)
                place = {"f": drawn.index((joint.name, None))}
                parts = np.array([own.fx, own.fy, own.torque])
                yield entry(joint.name, "joint", f"at {joint.name}", place, parts)
        for name, place, force in self._touches(body):
            yield entry(name, "contact", f"at {name}", place, np.vstack([force, 0.0 * force[:1]]))
        for name, *row in rows_on(run, body):
            yield entry(name, "contact", "at G", self._at((body, 0.0, 0.0)), np.array(row))
        for one, bodies in acting_on_several(run):
            if body in bodies:
                each = [coupled(run, one.name, k) for k in range(len(run))]
                parts = np.array(each)[:, self.system.bodies[body]].T
                yield entry(one.name, one.role, "at G", self._at((body, 0.0, 0.0)), parts)
        for driver in self.system.leaders:
            if body in driver.bodies:
                sign = 1.0 if driver.bodies[1] == body else -1.0
                parts = sign * driven(run, driver.name).T
                site: Place = (driver.bodies[1], 0.0, 0.0)
                anchor = ""
                if "j" in driver.places():
                    site, anchor = self.pose.site(driver, "j"), f"{driver.name}.j"
                place = self._at(site, anchor) | self._pivot(driver, body, parts)
                yield entry(driver.name, "driver", driver.name, place, parts)
        for n, load in enumerate(machine.loads):
            parts = self.loads[:, n, self.system.bodies[body]].T
            if np.any(parts):
                where, place, parts = self._load(load, body, parts)
                yield entry(load.name, "load", where, place, parts)
        if any(self.system.mass[3 * self.system.bodies[body] :][:3, 0]) and not self.still:
            found = entry("inertia", "inertia", "at G", self._at((body, 0.0, 0.0)), np.ones((3, 1)))
            found |= {
                "fx": {"by": -1, "mass": body, "of": f"{body}.ax"},
                "fy": {"by": -1, "mass": body, "of": f"{body}.ay"},
                "m": {"by": -1, "inertia": body, "of": f"{body}.alpha"},
            }
            yield found

    def _touches(self, body: str) -> Iterator[tuple[str, dict[str, Any], Array]]:
        """Forces of contacts and ropes on a body, at the places of their arrows: (2, instants)."""
        for n, one in enumerate(self.shown["forces"]):
            if "own" in one:
                ends = self.machine[one["of"]].bodies  # type: ignore[attr-defined]  # a contact
                if body in ends:
                    sign = 1.0 if body == ends[1] else -1.0
                    force = sign * np.array([one["own"]["x"], one["own"]["y"]], dtype=float)
                    yield one["of"], {"f": n}, force

    def _load(self, load: Any, body: str, parts: Array) -> tuple[str, dict[str, Any], Array]:
        """A load at its place on the body, where it has one; the torque is about that place."""
        field = load.sides().get(body)
        if field is None:
            at = self._at((body, 0.0, 0.0)) | self._pivot(load, body, parts)
            return "at G" if isinstance(load, Gravity) else load.name, at, parts
        site = self.pose.site(load, field)
        place, own = moved(self.run, site), self.run[body]
        fx, fy, torque = parts
        arm = (place[:, 0] - own.x) * fy - (place[:, 1] - own.y) * fx
        left = torque - arm
        left = np.where(np.abs(left) > ROUNDING * (np.abs(arm) + np.abs(torque)), left, 0.0)
        named = isinstance(load, Force) and isinstance(load.at.point, str)
        where = f"at {load.at.point}" if named else load.name
        at = self._at(site, f"{load.name}.{field}")
        return where, at | self._pivot(load, body, parts), np.array([fx, fy, left])

    def _at(self, site: Place, anchor: str = "") -> dict[str, Any]:
        name, x, y = site
        found: dict[str, Any] = {"at": [self.shown["bodies"].index(name), x, y]}
        return found | ({"p": anchor} if anchor else {})

    def _pivot(self, element: Any, body: str, parts: Array) -> dict[str, Any]:
        """Where a torque without a force is drawn: about the pin on which the body turns."""
        if np.any(parts[:2]):
            return {}
        others = [name for name in element.bodies if name != body]
        place = self.pose.pivot(others[0] if others else "", body)
        return {"o": self._at(self.pose.fixed(body, place))["at"]}

    # -- histories by reference -------------------------------------------------------------------

    def _said(self, cause: str, body: str, key: str, values: Array) -> Any:
        """A history as a number, by those that the page has, or as a further one."""
        peak = float(np.nanmax(np.abs(values), initial=0.0))
        if not peak:
            return 0
        mass = float(self.system.mass[3 * self.system.bodies[body], 0])
        weight = cause != "inertia" and isinstance(self.machine[cause], Gravity)
        if weight and np.ptp(values) <= SAME * peak:
            return {"by": float(values[0]) / mass, "mass": body}
        known = {name: ("of", one) for name, one in self._known(cause)}
        known |= {n: ("own", one) for n, one in self.pool.items() if n.startswith(f"{cause}.")}
        for name, (how, history) in known.items():
            k = int(np.nanargmax(np.abs(values)))
            if len(history) != len(values) or not abs(history[k]) > 0.0:
                continue
            factor = float(values[k] / history[k])
            factor = round(factor) if abs(factor - round(factor)) < SAME else factor
            if factor and not np.any(np.abs(values - factor * history) > SAME * peak):
                return {"by": factor, how: name}
        if np.ptp(values) <= SAME * peak:
            return float(values[0])
        name = f"{cause}.{body}.{key}"
        self.pool[name] = values
        self.histories[name] = numbers([v if v == v else None for v in values.tolist()])
        return {"own": name}

    def _known(self, cause: str) -> Iterator[tuple[str, Array]]:
        """The histories of a cause that the page has."""
        if cause in self.data["efforts"]:
            yield f"{cause}.effort", np.array(self.data["efforts"][cause], dtype=float)
        for table in (self.data["reactions"], self.data["loads"]):
            for key, values in table.get(cause, {}).items():
                if key in ("fx", "fy", "force", "torque") and isinstance(values, list):
                    yield f"{cause}.{key}", np.array(values, dtype=float)


def plain_runs(text: str) -> list[list[str]]:
    r"""A name in the notation of books as parts (text, "" or "sub").

    >>> plain_runs("$-m_{2}\\,a_{G2}$"), plain_runs("$T_{12,\\mathrm{motor\\_2}}$")
    ([['−m', ''], ['2', 'sub'], [' a', ''], ['G2', 'sub']], [['T', ''], ['12,motor_2', 'sub']])
    """
    text = re.sub(r"\\mathrm\{([^}]*)\}", r"\1", text)
    for sign, plain in (("\\,", " "), ("\\ ", " "), ("\\alpha", "α"), ("$-", "$−")):
        text = text.replace(sign, plain)
    return [[re.sub(r"\\([_$%#&{}])", r"\1", part), how] for part, how in text_runs(text)]

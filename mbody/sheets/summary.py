"""The sheet of many instants or designs: ranges and peaks, and where they occur."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbody.model.one_sided_constraint import joined
from mbody.model.reductions import in_time, mean_weights
from mbody.sheets.contacts import contacts
from mbody.sheets.couplings import couplings
from mbody.sheets.few_instants import few_instants
from mbody.sheets.friction import friction
from mbody.sheets.measured import measures
from mbody.sheets.names import (
    ABOUT,
    ROUNDING,
    closing,
    everyday,
    force_floor,
    force_names,
    heading,
    joint_torque,
    link_names,
    remark,
    swiftness,
    torque_cells,
)
from mbody.sheets.signals import signals
from mbody.sheets.text_table import Column, angles, cut, number, numbers, paragraph, polars, table

if TYPE_CHECKING:
    from mbody.solution.solution import Solution

__all__ = ["summary"]

Array = np.ndarray


def summary(solution: Solution) -> list[str]:
    """Lines of the sheet of many instants, or of a batch of designs.

    Examples
    --------
    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=10.0), turn=True)
    >>> summary(run)[1]
    'kinematics at 361 instants, t = 0 … 0.628319 s; units SI: m, N, s, kg'
    """
    return _Summary(solution).lines()


class _Summary:
    """Arrays are (instants,), of a batch (designs, instants)."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        self.mechanism = solution.mechanism
        self.unit = self.mechanism.units.of
        self.batch = solution.record.batch
        self.names = force_names(self.mechanism)
        self.states = solution.drive_states
        self.forces = solution.has_forces
        self.moves = solution.analysis != "statics"
        self.spans = len(solution) > 1 and np.ptp(solution.t) > 0.0

    def lines(self) -> list[str]:
        parts = [few_instants(self.solution), self._links()]
        if self.forces:
            parts.append(self._joints())
        parts += [couplings(self.solution), contacts(self.solution)]
        parts += [self._drivers(turns) for turns in (True, False)]
        parts += friction(self.solution)
        parts += signals(self.solution)
        parts.append(measures(self.solution))
        lines = heading(self.solution, self._when())
        if self.batch:
            lines += paragraph("peaks and ranges over all designs; system.design(n) is one of them")
        for part in parts:
            lines += ["", *part] if part else []
        return lines + closing(self.solution, residuals=not self.batch)

    def _when(self) -> str:
        t, unit = self.solution.t, self.unit("time")
        count = len(t)
        when = f"at {count} instants" if count > 1 else "at one instant"
        if self.batch:
            when = f"of {self.solution.record.count} designs {when}"
        first, last = number(t.min()), number(t.max())
        return (
            f"{when}, t = {first} … {last} {unit}" if self.spans else f"{when}, t = {first} {unit}"
        )

    # -- where something occurs ---------------------------------------------------------------

    def _places(self, at: list[int]) -> list[Column]:
        """Columns that show at which design, time and driver position the flat indices lie."""
        instant = [k % len(self.solution) for k in at]
        columns = []
        if self.batch:
            design = [str(k // len(self.solution)) for k in at]
            columns.append(Column("design", design))
        if self.spans:
            columns.append(Column("at t", numbers(self.solution.t[instant]), self.unit("time")))
        if self.states is not None and self.states.shape[1]:
            driver = self.mechanism.drivers[0]
            value, title = self.states[instant, 0, 0], f"at {cut(driver.name, 12)}"
            if driver.angular:
                columns.append(Column(title, angles(value), "deg"))
            else:
                columns.append(Column(title, numbers(value), self.unit("length")))
        elif len(self.solution) > 1 and not self.spans:
            columns.append(Column("at instant", [str(k) for k in instant]))
        return columns

    # -- the tables ---------------------------------------------------------------------------

    def _links(self) -> list[str]:
        bodies = [self.solution[body.name] for body in self.mechanism.bodies]
        unit = self.unit
        columns = [Column("LINKS", link_names(self.mechanism)[1:], text=True)]
        ends = [(np.degrees(body.angle.min()), np.degrees(body.angle.max())) for body in bodies]
        low, high = ([f"{round(end[k], 3) + 0.0:.3f}" for end in ends] for k in (0, 1))
        columns.append(Column("angle from", low, "deg"))
        columns.append(Column("to", high, "deg"))
        if self.moves:
            omega, alpha = (
                np.array([np.abs(getattr(body, key)).max() for body in bodies])
                for key in ("omega", "alpha")
            )
            speed = np.array([np.hypot(body.vx, body.vy).max() for body in bodies])
            rate = np.array([np.hypot(body.ax, body.ay).max() for body in bodies])
            swift, length = swiftness(self.solution), self.solution.system.length
            columns += [
                Column(
                    "peak ω", numbers(omega, ROUNDING * np.sqrt(swift)), unit("angular velocity")
                ),
                Column("peak α", numbers(alpha, ROUNDING * swift), unit("angular acceleration")),
                Column("peak v_G", numbers(speed, ROUNDING * speed.max()), unit("velocity")),
                Column("peak a_G", numbers(rate, ROUNDING * swift * length), unit("acceleration")),
            ]
        return table(columns)

    def _joints(self) -> list[str]:
        found = []
        for joint in joined(self.mechanism):
            name, on = self.names[joint.name]
            found.append((name, joint.name, self.solution.reaction(joint.name, on)))
        if not found:
            return []
        at = [int(np.argmax(np.nan_to_num(r.magnitude, nan=-1.0))) for *_, r in found]
        x, y = (
            np.array([getattr(r, key).flat[k] for k, (*_, r) in zip(at, found, strict=True)])
            for key in ("fx", "fy")
        )
        floor = force_floor(self.solution)
        turning = [np.abs(joint_torque(self.mechanism, r)) for *_, r in found]
        torque = np.array([np.fmax.reduce(one, axis=None) for one in turning])
        turning = torque_cells(self.solution, torque, floor)
        lines = table(
            [
                Column("PEAK FORCES", [name for name, *_ in found], text=True),
                Column("magnitude @ dir.", polars(x, y, floor), self.unit("force")),
                *self._places(at),
                Column("peak torque", turning, self.unit("torque")),
                Column("joint", [joint for _, joint, _ in found], text=True),
                Column("i on j", [f"{r.by} on {r.on}" for *_, r in found], text=True),
                Column("", [remark(r) for *_, r in found], text=True, whole=True),
            ]
        )
        return [*lines, ABOUT] if any(turning) else lines

    def _drivers(self, turns: bool) -> list[str]:
        chosen = [d for d in self.mechanism.drivers if d.angular == turns]
        if not chosen or not self.forces:
            return []
        efforts = np.array([self.solution.effort(driver.name) for driver in chosen])
        flat = efforts.reshape(len(chosen), -1)
        weight = self._weights()
        mean = np.nansum((efforts * weight).reshape(len(chosen), -1), axis=1)
        square = np.nansum((efforts**2 * weight).reshape(len(chosen), -1), axis=1)
        kind = self.unit("torque" if turns else "force")
        floor = force_floor(self.solution) * (self.solution.system.length if turns else 1.0)
        columns = [
            Column(
                "TORQUES" if turns else "DRIVERS",
                [self.names[d.name][0] for d in chosen],
                text=True,
            ),
            Column("driver", [d.name for d in chosen], text=True),
            Column("least", numbers(np.fmin.reduce(flat, axis=1), floor), kind),
            Column("greatest", numbers(np.fmax.reduce(flat, axis=1), floor), kind),
            Column("mean", numbers(mean, floor), kind),
            Column("rms", numbers(np.sqrt(square), floor), kind),
        ]
        if self.moves and self.states is not None:
            number_of = {driver.name: n for n, driver in enumerate(self.mechanism.drivers)}
            rates = np.array([self.states[:, number_of[d.name], 1] for d in chosen])
            rates = rates[:, None, :] if self.batch else rates
            power = np.fmax.reduce(np.abs(efforts * rates).reshape(len(chosen), -1), axis=1)
            least = floor * np.abs(rates).max()
            columns.append(Column("peak power", numbers(power, least), self.unit("power")))
            columns += everyday(self.mechanism.units, "power", power, least)
        over = "time" if in_time(self.solution.t) else "the instants"
        return [*table(columns), f"mean and rms over {over}"]

    def _weights(self) -> Array:
        """Of the instants in a mean over the motion and over the designs: their sum is 1."""
        designs = self.solution.record.count if self.batch else 1
        return mean_weights(self.solution.t) / designs

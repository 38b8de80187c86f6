"""A mechanism at one instant, drawn as textbooks do: links, pins, supports, drivers, forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mbody.analysis.driven.kinematics import kinematics
from mbody.analysis.driven.kinetostatics import kinetostatics
from mbody.analysis.driven.requests import analyse_at
from mbody.analysis.initial.close_loops import close_loops
from mbody.errors import ModelError, SolveError
from mbody.model.driver import Driver
from mbody.model.mechanism import Mechanism
from mbody.sheets.names import force_floor, force_names
from mbody.solution.checks import one_design
from mbody.solution.solution import Solution
from mbody.system.system import System
from mbody.views.backend import blank, styled
from mbody.views.bounds import bounds, wheels
from mbody.views.coupling_symbols import coupling_symbol
from mbody.views.cycle import SMOOTH, times
from mbody.views.frame import framed, rounded_number
from mbody.views.joint_symbols import joint_symbol, outward
from mbody.views.labels import symbolic, together
from mbody.views.links import link, link_label, points
from mbody.views.load_symbols import driver_symbol, force_arrow, forces_shown, load_symbol
from mbody.views.pose import Pose
from mbody.views.sketch import Sketch
from mbody.views.style import FORCE, LOAD, SIZE, SOFT, Z

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

Array = np.ndarray

#: With more bodies than this only joints and loads are named.
NAMED = 24


def draw(
    model: Solution | Mechanism | System,
    instant: int = 0,
    forces: bool = False,
    *,
    paths: Sequence[str] = (),
) -> Figure:
    """A picture of a mechanism at one instant: kinematic diagram, and with its forces a free view
    of what each joint carries.

    Links are bars or plates through their places, ground is hatched, the arrow of a motor is the
    way that it turns. Applied forces are arrows to the scale of the key, torques are arcs.

    Parameters
    ----------
    model : Solution, Mechanism or System
        A result of any analysis of one design; or what is to be analysed first: driven at the
        instant that it asks for, else at t = 0, without a driver at its guess.
    instant : int
        Which instant of the result.
    forces : bool
        Whether the joint forces are drawn, as in the sheet: F_ij on link j by link i.
    paths : sequence of str
        Points such as ``"coupler.P"`` whose paths are drawn: over the instants of the result; where
        it has one only, over the times that the mechanism asks for, or a whole turn.

    Returns
    -------
    matplotlib.figure.Figure
        In the units of the mechanism, equal in x and y. Artists have names (``get_gid``) such as
        ``"pin:A"``, ``"link:crank"``, ``"force:F32"``, which are ids in an SVG file.

    Raises
    ------
    ModelError
        For a batch, an instant that there is not, forces of an analysis without forces; where
        matplotlib is not installed.
    SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody
    >>> figure = mbody.draw(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> sorted(a.get_gid() for a in figure.axes[0].patches if "pin" in (a.get_gid() or ""))
    ['pin:A', 'pin:B', 'pin:O2', 'pin:O4']
    """
    run = model if isinstance(model, Solution) else _solved(model, forces)
    one_design(run, "a picture is of one design")
    pose = Pose(run, instant)
    if isinstance(paths, str):
        paths = (paths,)
    tracks = _paths(run, paths)
    with styled():
        figure = blank()
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        sketch = Sketch(axes, pose, *_scale(pose, list(tracks.values())))
        framed(figure, sketch, _mechanism(sketch, forces, tracks))
    return figure


def _solved(model: Mechanism | System, forces: bool) -> Solution:
    """One instant of what has not been analysed."""
    mechanism = model.mechanism if isinstance(model, System) else model
    if not isinstance(mechanism, Mechanism):
        raise ModelError(
            f"a picture is of a mechanism or of what an analysis found, not of {model!r}"
        )
    if not forces and not mechanism.drivers:
        return close_loops(model)
    verb = "kinetostatics" if forces else "kinematics"
    try:
        if isinstance(model, System):
            return (kinetostatics if forces else kinematics)(model)
        return analyse_at(mechanism, verb)
    except SolveError:
        if forces or mechanism.ask is not None:
            raise
        return close_loops(model)


def _paths(run: Solution, names: Sequence[str]) -> dict[str, Array]:
    """The paths of points, of the run itself where it has many instants, else of more."""
    if not names:
        return {}
    for name in names:
        run.point(name)
    if len(run) == 1:
        requested = times(run.mechanism, run.mechanism.ask)
        if requested is None:
            run = kinematics(run.system, turn=True, instants=SMOOTH)
        else:
            run = kinematics(run.system, t=requested)
    elif len(run) < SMOOTH and run.given is None:
        run = kinematics(run.system, t=np.linspace(run.t[0], run.t[-1], SMOOTH))
    histories = {name: run.point(name) for name in names}
    return {name: np.column_stack([h.x, h.y]) for name, h in histories.items()}


def _scale(pose: Pose, tracks: list[Array]) -> tuple[float, float]:
    """Length of a point (1/72 in) in the units of the mechanism, and how much smaller symbols are
    where the links are short."""
    corners = np.vstack([bounds(pose), *tracks])
    wide, high = corners.max(axis=0) - corners.min(axis=0)
    unit = max(wide / SIZE["width"], high / SIZE["height"])
    if not unit > 1e-12 * pose.system.length:
        unit = pose.system.length / SIZE["width"]
    lengths = [1.5 * radius for joint in pose.mechanism.joints for _, radius in wheels(joint, pose)]
    for name, nodes in pose.nodes.items():
        if name != "ground" and len(nodes) > 1:
            lengths.append(float(np.max(np.ptp(np.array(nodes), axis=0))))
    lengths = [length for length in lengths if length > unit]
    typical = float(np.median(lengths)) if lengths else 60.0 * unit
    return unit, min(1.0, max(0.3, typical / (55.0 * unit)))


def _driven(pose: Pose, driver: Driver) -> str:
    """The name of a driver with its effort."""
    turns, floor = driver.angular, force_floor(pose.run)
    effort = float(pose.run.effort(driver.name)[pose.k])
    if abs(effort) <= floor * (pose.system.length if turns else 1.0):
        effort = 0.0
    unit = pose.mechanism.units.of("torque" if turns else "force")
    book = force_names(pose.mechanism)[driver.name][0]
    # where several share a pair of links their own names follow: once is enough
    between = "" if "," in book else f": {symbolic(book)}"
    return f"{symbolic(driver.name)}{between} = {rounded_number(effort)} {unit}"


def _mechanism(
    sketch: Sketch, forces: bool, tracks: dict[str, Array]
) -> tuple[float, float, str] | None:
    """Draw everything from the lowest layer to the labels; returns the scale of the arrows."""
    pose, mechanism = sketch.pose, sketch.pose.mechanism
    for name, track in tracks.items():
        dashes = (0, (5, 3))
        sketch.line(track, 0.9, SOFT, Z["path"], name=f"path:{name}", dashes=dashes, weight=0.5)
    for order, body in enumerate(mechanism.bodies):
        link(sketch, body.name, order)
    for joint in mechanism.joints:
        joint_symbol(joint, sketch)
    for coupling in mechanism.couplings:
        coupling_symbol(coupling, sketch)
    sketch.lay()
    for load in mechanism.loads:
        load_symbol(load, sketch)
    for driver in mechanism.drivers:
        driver_symbol(driver, sketch, _driven(pose, driver) if forces else symbolic(driver.name))
    for body in mechanism.bodies:
        points(sketch, body.name)
    if len(mechanism.joints) <= 2 * NAMED:
        _pin_labels(sketch)
    arrows = _arrows(sketch, forces)
    if len(mechanism.bodies) <= NAMED:
        for body in mechanism.bodies:
            link_label(sketch, body.name)
    sketch.write()
    return arrows


def _pin_labels(sketch: Sketch) -> None:
    """The names of pins, those at one place together."""
    joints = {joint.name: joint for joint in sketch.pose.mechanism.joints}
    for place, names in sketch.pins:
        if not names:
            continue
        bodies = [side.body for name in names for side in (joints[name].i, joints[name].j)]
        text = together(names)
        wanted = outward(sketch, place, *bodies)
        gap = sketch.size("pin") + 2.5 * sketch.unit
        sketch.label(text, place, wanted, gap, italic=True, name=f"name:{names[0]}")
    # pins are first: loads and drivers have more free space
    sketch.labels.sort(key=lambda label: not label.name.startswith("name:"))


def _arrows(sketch: Sketch, forces: bool) -> tuple[float, float, str] | None:
    """All forces at one scale: the length of a unit of force, the greatest one, and a colour."""
    shown = forces_shown(sketch.pose, forces)
    sizes = [float(np.hypot(*vector)) for _, _, vector, _, _ in shown]
    greatest = max(sizes, default=0.0)
    if not greatest > 0.0:
        return None
    scale = SIZE["arrow"] * sketch.unit / greatest
    unit = sketch.pose.mechanism.units.of("force")
    for (name, place, vector, color, _), size in zip(shown, sizes, strict=True):
        text = f"{symbolic(name)} = {rounded_number(size)} {unit}"
        force_arrow(sketch, name, place, vector, color, text, scale)
    return scale, greatest, FORCE if forces else LOAD

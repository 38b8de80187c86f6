"""A mechanism in motion as plain data: its shapes, and what carries them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mbody.errors import ModelError, remedy
from mbody.solution.checks import one_design
from mbody.solution.solution import Solution
from mbody.views.body_shapes import body_shapes
from mbody.views.bounds import bounds, wheels
from mbody.views.carriers import GROUND_CARRIER, Carrier
from mbody.views.coupling_symbols import coupling_symbol
from mbody.views.friction_symbols import (
    circle_scale,
    contact_symbol,
    friction_circles,
    sticking_symbol,
)
from mbody.views.joint_symbols import joint_symbol
from mbody.views.labels import symbolic
from mbody.views.links import link, points
from mbody.views.load_symbols import driver_symbol, load_symbol
from mbody.views.pose import Pose
from mbody.views.record import KeptLabel, KeptShape, SceneSketch
from mbody.views.scene_names import named
from mbody.views.style import SIZE

__all__ = ["Scene", "samples", "scene", "sketched", "thinned"]

Array = np.ndarray

#: Instants of a scene: more than a screen has columns, and four for each degree of a turn.
MOST = 1441
#: Numbers of a scene (instants by histories), as many as make a page of some 10 MB.
NUMBERS = 1_000_000
#: Fewest instants to which a motion is thinned.
FEWEST = 61
#: Instants at which the space that a motion needs is measured.
SAMPLES = 25
#: The same of a thousand bodies, of which some are always where the others will be.
FEW = 5


@dataclass
class Scene:
    """The geometry of a mechanism over time.

    Attributes
    ----------
    run : Solution
        The motion, thinned where it has more instants than a picture can show.
    shapes : list of KeptShape
        From the lowest to the highest.
    labels : list of KeptLabel
    unit : float
        Length of a point (1/72 in) in the units of the mechanism.
    low, high : arrays (2,)
        Corners of the rectangle that the whole motion needs.
    notes : list of str
        What was left out.
    enlarged : float
        By how much friction circles are drawn larger than they are.
    """

    run: Solution
    shapes: list[KeptShape]
    labels: list[KeptLabel]
    unit: float
    small: float
    low: Array
    high: Array
    notes: list[str] = field(default_factory=list)
    enlarged: float = 1.0

    @property
    def carriers(self) -> list[Carrier]:
        """All carriers, each once."""
        carried = [*(one.carrier for one in self.shapes), *(one.carrier for one in self.labels)]
        return list(dict.fromkeys(carried))


def scene(run: Solution, *, moves: bool = True) -> Scene:
    """The shapes of a mechanism in the axes of what carries them.

    Parameters
    ----------
    run : Solution
        Of one design, any analysis; free motion too.
    moves : bool
        Whether a result in which nothing moves is refused.

    Returns
    -------
    Scene

    Raises
    ------
    ModelError
        For a batch, or where nothing moves.

    Examples
    --------
    >>> import mbody
    >>> machine = mbody.makers.four_bar(1, 3, 2, 3.5)
    >>> found = scene(mbody.kinematics(machine, turn=True))
    >>> {shape.look.name for shape in found.shapes} >= {"link:crank", "link:coupler", "pin:A"}
    True
    """
    one_design(run, "a view is of one design")
    if moves:
        _check_moves(run)
    shown, notes = thinned(run)
    pose = Pose(shown, 0)
    low, high, own = _space(shown)
    unit, small = _scale(pose, low, high, own)
    sketch = sketched(pose, unit, small)
    shapes = sorted(sketch.record.shapes, key=lambda shape: shape.look.z)
    found = Scene(shown, shapes, [], unit, small, low, high, notes, sketch.enlarged)
    if sketch.enlarged != 1.0:
        notes.append(f"friction circles are drawn {sketch.enlarged:g} times as large as they are")
    found.low, found.high = _reach(found)
    found.labels = named(sketch, shapes)
    return found


def sketched(pose: Pose, unit: float, small: float) -> SceneSketch:
    """All shapes of a mechanism, in the order in which they are drawn."""
    sketch = SceneSketch(pose, unit, small)
    mechanism = pose.mechanism
    for order, body in enumerate(mechanism.bodies):
        link(sketch, body.name, order)
        body_shapes(sketch, body.name)
    body_shapes(sketch, "ground")
    for joint in pose.joints:
        joint_symbol(joint, sketch)
    for coupling in mechanism.couplings:
        coupling_symbol(coupling, sketch)
    sketch.lay()
    for load in mechanism.loads:
        load_symbol(load, sketch)
    for driver in mechanism.drivers:
        driver_symbol(driver, sketch, symbolic(driver.name))
    for contact in mechanism.contacts:
        contact_symbol(contact, sketch)
    for joint in mechanism.joints:
        sticking_symbol(joint, sketch)
    if pose.run.has_forces:
        sketch.enlarged = circle_scale(pose, unit, mechanism.joints)
        friction_circles(sketch, mechanism.joints, sketch.enlarged)
    for body in mechanism.bodies:
        points(sketch, body.name)
    return sketch


def _check_moves(run: Solution) -> None:
    """Refuse a result in which nothing moves."""
    size = run.system.length
    for body in run.mechanism.bodies:
        own = run[body.name]
        way = max(float(np.ptp(own.x)), float(np.ptp(own.y)), size * float(np.ptp(own.angle)))
        if way > 1e-9 * size:
            return
    count = "1 instant" if len(run) == 1 else f"{len(run)} instants"
    raise ModelError(
        f"nothing moves in this result of '{run.mechanism.name}' ({count}): "
        + remedy(
            python="analyse a turn (turn=True) or several times, or simulate; draw shows one "
            "position",
            command="give --over turn, --at NAME=VALUE,VALUE,… or --to TIME; mbody draw shows one "
            "position",
        )
    )


def thinned(run: Solution) -> tuple[Solution, list[str]]:
    """A run with as many instants as can be shown, and the sentences that say so.

    Events of free motion are kept, with the instants before and after them.
    """
    count = len(run)
    mechanism = run.mechanism
    width = 9 * len(mechanism.bodies) + 3 * len(mechanism.joints) + 3 * len(mechanism.loads) + 1
    most = max(FEWEST, min(MOST, NUMBERS // width))
    if count <= most:
        return run, []
    index = np.unique(np.round(np.linspace(0, count - 1, most)).astype(np.int64))
    events = np.searchsorted(run.t, [one.t for one in run.events])[: most // 4]
    near = np.clip(np.concatenate([events - 1, events, events + 1]), 0, count - 1)
    index = np.unique(np.concatenate([index, near.astype(np.int64)]))
    note = f"{len(index)} of {count} instants are shown, evenly chosen; results have them all"
    return run.take(index), [note]


def samples(run: Solution) -> list[int]:
    """Instants, evenly chosen, at which space is measured."""
    count = max(FEW, min(SAMPLES, 2000 // max(len(run.mechanism.bodies), 1)))
    return sorted({round(k) for k in np.linspace(0, len(run) - 1, count)})


def _space(run: Solution) -> tuple[Array, Array, Array]:
    """Corners of the rectangle of the whole motion, and the greatest extent of one instant."""
    corners = np.array([bounds(Pose(run, k)) for k in samples(run)])
    own = (corners[:, 1] - corners[:, 0]).max(axis=0)
    return corners[:, 0].min(axis=0), corners[:, 1].max(axis=0), own


def _scale(pose: Pose, low: Array, high: Array, own: Array) -> tuple[float, float]:
    """Length of a point (1/72 in), and how much smaller symbols are where links are short."""
    # a machine that travels far keeps symbols of its own size
    wide, tall = np.minimum(high - low, 3.0 * max(own.max(), 1e-300))
    unit = max(wide / SIZE["width"], tall / SIZE["height"])
    if not unit > 1e-12 * pose.system.length:
        unit = pose.system.length / SIZE["width"]
    lengths = [1.5 * radius for joint in pose.joints for _, radius in wheels(joint, pose)]
    for name, nodes in pose.nodes.items():
        if name != "ground" and len(nodes) > 1:
            lengths.append(float(np.max(np.ptp(np.array(nodes), axis=0))))
    lengths = [length for length in lengths if length > unit]
    typical = float(np.median(lengths)) if lengths else 60.0 * unit
    return float(unit), min(1.0, max(0.3, typical / (55.0 * unit)))


def _reach(found: Scene) -> tuple[Array, Array]:
    """Corners of the rectangle that all shapes need in the whole motion."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    axes = {carrier: carrier.axes(found.run) for carrier in found.carriers}
    for shape in found.shapes:
        carrier = shape.carrier
        for k in [0] if carrier == GROUND_CARRIER else samples(found.run):
            placed = carrier.shown(shape.points, axes[carrier], k)
            low = np.fmin(low, np.nanmin(placed, axis=0) - shape.radius)
            high = np.fmax(high, np.nanmax(placed, axis=0) + shape.radius)
    if not np.isfinite(low).all():
        return found.low, found.high
    return low, high

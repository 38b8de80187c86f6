"""A mechanism at one instant, drawn as textbooks do: links, pins, supports, drivers, forces."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbody.analysis.driven.driven import analyse_at, kinematics, kinetostatics
from mbody.analysis.dynamics.simulate import simulate
from mbody.analysis.initial.close_loops import close_loops
from mbody.errors import ModelError, SolveError
from mbody.model.mechanism import Mechanism
from mbody.solution.histories import Record, one_design
from mbody.solution.known_forces import every_force
from mbody.solution.solution import Solution
from mbody.system.system import System
from mbody.views.kinematic_picture import (
    ElementSelection,
    KinematicMarks,
    LoadedPose,
    faded,
    kinematic_picture,
    longest_force,
    sketch_mechanism,
    sketch_scale,
)
from mbody.views.labels import blank, said_below, styled
from mbody.views.shapes import SMOOTH, Pose, times
from mbody.views.sketch import Sketch, framed, in_strip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbody.analysis.assemblies.assembly_modes import AssemblyModes


# -- The position at which a picture shows a model that has not been analysed ------------------


def first_position(model: Mechanism | System, forces: bool = False) -> Solution:
    """One instant of a model: the first that it asks for, else where its simulation begins, else of
    its drivers at t = 0; without these at its guess.

    >>> import mbody
    >>> ball = mbody.gallery.load("bouncing_ball")
    >>> float(first_position(ball)["ball"].y[0])
    1.03
    """
    mechanism = model.mechanism if isinstance(model, System) else model
    if not isinstance(mechanism, Mechanism):
        raise ModelError(
            f"a picture is of a mechanism or of what an analysis found, not of {model!r}"
        )
    if mechanism.ask is None and mechanism.simulation is not None:
        return simulate(model, times=[0.0])
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


Array = np.ndarray

#: How strong the nearest of the other instants are.
FADED = 0.45
#: How large a drawing is in a strip, as a part of one alone.
CELL = 0.6


def draw(
    model: Solution | Mechanism | System,
    instant: int | Sequence[int] = 0,
    forces: bool = False,
    *,
    paths: Sequence[str] = (),
    only: Sequence[str] = (),
    strip: bool = False,
    poles: bool = False,
    polygons: bool = False,
    centrodes: Sequence[str] = (),
    inflection: Sequence[str] = (),
    curvature: Sequence[str] = (),
) -> Figure:
    """A picture of a mechanism at one instant: kinematic diagram, and with its forces a free view
    of what each joint carries; or at several, overlaid or as a strip, at one scale.

    Links are bars or plates through their places, ground is hatched, the arrow of a motor is the
    way that it turns. Applied forces are arrows to the scale of the key, torques are arcs.

    Parameters
    ----------
    model : Solution, Mechanism or System
        A result of any analysis of one design; or what is to be analysed first: driven at the
        instant that it asks for, else where its simulation begins, else at t = 0, without a driver
        at its guess.
    instant : int or list of int
        Which instant of the result; of several the first is drawn in full, the others faded.
    forces : bool
        Whether the joint forces are drawn, as in the summary: F_ij on link j by link i.
    paths : sequence of str
        Points such as ``"coupler.P"`` whose paths are drawn: over the instants of the result; where
        it has one only, over the times that the mechanism asks for, or a whole revolution; of a
        free motion over that of its `simulation`.
    only : sequence of str
        The bodies that are drawn, with the joints, drivers and loads between them and the ground;
        by default all.
    strip : bool
        Whether several instants are beside each other, each in full.
    poles : bool
        Whether all instant centres are drawn, with the lines of Aronhold and Kennedy.
    polygons : bool
        Whether the velocity and the acceleration polygon are beside the mechanism.
    centrodes, inflection : sequence of str
        Bodies whose centrodes, or inflection circles, against the ground are drawn.
    curvature : sequence of str
        Points of whose paths the circles of curvature are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        In the units of the mechanism, equal in x and y. Artists have names (``get_gid``) such as
        ``"pin:A"``, ``"link:crank"``, ``"force:F32"``, which are ids in an SVG file.

    Raises
    ------
    ModelError
        For a batch, an instant that there is not, forces of an analysis without forces, a body that
        there is not; where matplotlib is not installed.
    SolveError
        As of the analysis.

    Examples
    --------
    >>> import mbody
    >>> figure = mbody.draw(mbody.makers.four_bar(1, 3, 2, 3.5))
    >>> sorted(a.get_gid() for a in figure.axes[0].patches if "pin" in (a.get_gid() or ""))
    ['pin:A', 'pin:B', 'pin:O2', 'pin:O4']
    """
    run = model if isinstance(model, Solution) else first_position(model, forces)
    one_design(run, "a picture is of one design")
    several = isinstance(instant, (Sequence, np.ndarray)) and not isinstance(instant, str)
    instants: list[Any] = list(instant) if several else [instant]  # type: ignore[arg-type]
    poses = [_posed(run, one, forces) for one in instants]
    if not poses:
        raise ModelError(f"a picture needs an instant, 0 to {len(run) - 1}: give at least one")
    selection = ElementSelection(run.mechanism, (only,) if isinstance(only, str) else only)
    if isinstance(paths, str):
        paths = (paths,)
    marks = KinematicMarks(
        poles, polygons, _names(centrodes), _names(inflection), _names(curvature)
    )
    tracks = _paths(run, [*paths, *(name for name in marks.curvature if name not in paths)])
    if marks:
        if len(poses) > 1 or forces or only:
            raise ModelError(
                "a picture with instant centres, polygons or curvature shows one instant of all "
                "links, without forces: draw the others in a picture of their own"
            )
        return kinematic_picture(
            run, poses[0].k, marks, tracks, _over_motion(run) if marks.centrodes else run
        )
    with styled():
        figure = blank()
        shown = [every_force] if forces else []
        if strip and len(poses) > 1:
            figure = _in_cells(figure, poses, forces, selection, tracks)
            return said_below(figure, run, of=shown)
        scale = sketch_scale(poses, selection, list(tracks.values()), 1.0)
        sketch = Sketch(_axes(figure), poses[0], *scale)
        for n, pose in enumerate(poses[1:]):
            faded(sketch, pose, selection, FADED * (1.0 - 0.5 * n / len(poses)))
        framed(figure, sketch, sketch_mechanism(sketch, forces, tracks, selection))
        return said_below(figure, run, of=shown)


def draw_cells(run: Solution, texts: Sequence[str]) -> Figure:
    """All positions of a run beside each other, at one scale, each with a caption of its own."""
    poses = [_posed(run, k, False) for k in range(len(run))]
    with styled():
        return _in_cells(blank(), poses, False, ElementSelection(run.mechanism, ()), {}, texts)


def _in_cells(
    figure: Figure,
    poses: Sequence[Pose],
    forces: bool,
    selection: ElementSelection,
    tracks: dict[str, Array],
    texts: Sequence[str] = (),
) -> Figure:
    scale = sketch_scale(poses, selection, list(tracks.values()), CELL)
    sketches, longest, arrows = [], longest_force(poses, forces, selection), None
    for pose in poses:
        sketches.append(Sketch(_axes(figure), pose, *scale))
        arrows = sketch_mechanism(sketches[-1], forces, tracks, selection, longest)
    in_strip(figure, sketches, arrows, texts)
    return figure


def draw_series(
    run: Solution,
    instants: Sequence[int],
    forces: bool = False,
    *,
    paths: Sequence[str] = (),
    only: Sequence[str] = (),
) -> list[Figure]:
    """Pictures of several instants, all of one scale and one size, as of a film; see `draw`.

    >>> import mbody
    >>> run = mbody.kinematics(mbody.makers.four_bar(1, 3, 2, 3.5, speed=1.0), t=[0.0, 1.0])
    >>> first, second = draw_series(run, [0, 1])
    >>> bool((first.get_size_inches() == second.get_size_inches()).all())
    True
    """
    one_design(run, "a picture is of one design")
    poses, tracks = [_posed(run, k, forces) for k in instants], _paths(run, paths)
    selection, sketches, arrows = ElementSelection(run.mechanism, only), [], None
    with styled():
        scale = sketch_scale(poses, selection, list(tracks.values()), 1.0)
        longest, figures = longest_force(poses, forces, selection), [blank() for _ in poses]
        for pose, figure in zip(poses, figures, strict=True):
            sketches.append(Sketch(_axes(figure), pose, *scale))
            arrows = sketch_mechanism(sketches[-1], forces, tracks, selection, longest)
        low = np.min([sketch.low for sketch in sketches], axis=0)
        high = np.max([sketch.high for sketch in sketches], axis=0)
        for sketch in sketches:
            sketch.low, sketch.high = low, high
        for sketch, figure in zip(sketches, figures, strict=True):
            framed(figure, sketch, arrows)
        # titles of other instants may be wider: the limits of all are those of the widest
        right = max(axes.get_xlim()[1] for axes in (sketch.axes for sketch in sketches))
        for sketch, figure in zip(sketches, figures, strict=True):
            left, _ = sketch.axes.get_xlim()
            sketch.axes.set_xlim(left, right)
            tall = figure.get_size_inches()[1]
            figure.set_size_inches((right - left) / sketch.unit / 72.0, tall)
            said_below(figure, run, of=[every_force] if forces else [])
    return figures


def _posed(run: Solution, instant: int, forces: bool) -> Pose:
    """An instant, with its forces where they are drawn and there are any."""
    return LoadedPose(run, instant) if forces and run.has_forces else Pose(run, instant)


def _axes(figure: Figure) -> Any:
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), label=f"part {len(figure.axes)}")
    axes.set_axis_off()
    return axes


def _paths(run: Solution, names: Sequence[str]) -> dict[str, Array]:
    """The paths of points, of the run itself where it has many instants, else of more."""
    if not names:
        return {}
    for name in names:
        run.point(name)
    run = _over_motion(run)
    histories = {name: run.point(name) for name in names}
    return {name: np.column_stack([h.x, h.y]) for name, h in histories.items()}


def _names(given: Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def _over_motion(run: Solution) -> Solution:
    """The run itself where it has many instants, else more instants."""
    if run.analysis == "simulate":
        return simulate(run.system) if len(run) == 1 else run
    if len(run) == 1:
        requested = times(run.mechanism, run.mechanism.ask)
        if requested is None:
            return kinematics(run.system, turn=True, instants=SMOOTH)
        return kinematics(run.system, t=requested)
    if len(run) < SMOOTH and run.given is None:
        return kinematics(run.system, t=np.linspace(run.t[0], run.t[-1], SMOOTH))
    return run


# -- All assembly modes of a mechanism beside each other, at one scale -------------------------

#: Modes that a picture shows.
MOST = 60


def draw_assemblies(modes: AssemblyModes) -> Figure:
    """A strip of all modes, each with its number and its name.

    >>> import mbody
    >>> figure = draw_assemblies(mbody.assembly_modes(mbody.makers.four_bar(1, 3, 2, 3.5)))
    >>> len([axes for axes in figure.axes if axes.get_label() != "key"])
    2
    """
    selection = list(modes)[:MOST]
    if not selection:
        raise ModelError(
            f"'{modes.mechanism.name}' closes nowhere there: there is no assembly mode to draw"
        )
    drive = dict(modes.at) or None
    runs = [kinematics(modes.mechanism, drive=drive, guess=mode) for mode in selection]
    first = runs[0]
    rows = np.concatenate([run.record.table(slice(None))[:1] for run in runs])
    given = [run.given[:1] for run in runs if run.given is not None]
    whole = dataclasses.replace(
        first,
        t=np.repeat(first.t[:1], len(runs)),
        record=Record([np.ascontiguousarray(rows[:, :, None])], len(runs), batch=False),
        given=np.concatenate(given) if given else None,
    )
    return draw_cells(
        whole, [f"{m.number} {m.name}{' (used)' if m.used else ''}" for m in selection]
    )

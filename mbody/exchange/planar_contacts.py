"""Contacts between the shapes of a spatial model, in its plane.

A plane across it is a line, a sphere or a cylinder across it a disc, a box a polygon, a capsule in
it the discs of its ends. What else may touch is named, and refused where it touches at the
reference position.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbody.core.tolerances import FILE_PLACES_SAME
from mbody.exchange.imported import refusal, seen
from mbody.exchange.planar_space import Spatial
from mbody.model.contact import Contact
from mbody.model.element import Element
from mbody.model.touching_shapes import Disc, Line, Polygon

PLANE, SPHERE, CAPSULE, CYLINDER, BOX = 0, 2, 3, 5, 6
WELD = 1
#: Pairs that a note names.
NAMED = 8


@dataclass(frozen=True)
class GeomOutline:
    """A shape in the plane: "line", "disc", "polygon", or "ends", the discs of a capsule.

    `points`: In space. `radius`: Of discs. `direction`: Of a line, in the plane.
    `along`: Where it lies along the normal, from and to; of a sphere both are its centre.
    """

    kind: str
    points: tuple[np.ndarray, ...]
    radius: float = 0.0
    direction: float = 0.0
    along: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class GeomPair:
    """Two shapes that may touch, by their numbers in the file."""

    first: int
    second: int
    friction: float
    margin: float
    rolling: float
    adhesion: float


def outline_of(space: Spatial, geom: int) -> GeomOutline | None:
    """A shape in the plane, None of one that has no outline for contacts."""
    model, data, plane = space.model, space.data, space.plane
    at, kind = data.geom_xpos[geom].copy(), int(model.geom_type[geom])
    axes, size = data.geom_xmat[geom].reshape(3, 3).T, model.geom_size[geom]
    z = float(at @ plane.normal)
    across, lies = plane.is_across(axes[2]), plane.lies_in(axes[2])
    if kind == PLANE and lies:
        x, y = plane.flat(axes[2])
        return GeomOutline("line", (at,), direction=math.atan2(-x, y))
    if kind == SPHERE:
        return GeomOutline("disc", (at,), float(size[0]), along=(z, z))
    if kind in (CYLINDER, CAPSULE) and across:
        return GeomOutline(
            "disc", (at,), float(size[0]), along=(z - float(size[1]), z + float(size[1]))
        )
    if kind == CAPSULE and lies:
        ends = tuple(at + sign * size[1] * axes[2] for sign in (-1.0, 1.0))
        return GeomOutline("ends", ends, float(size[0]), along=(z, z))
    if (
        kind == BOX
        and (n := next((n for n in range(3) if plane.is_across(axes[n])), None)) is not None
    ):
        u, v = (n + 1) % 3, (n + 2) % 3
        sides = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        corners = tuple(at + a * size[u] * axes[u] + b * size[v] * axes[v] for a, b in sides)
        if plane.sign(axes[n]) < 0.0:
            corners = corners[::-1]
        return GeomOutline("polygon", corners, along=(z - float(size[n]), z + float(size[n])))
    return None


def contacts(space: Spatial) -> list[Element]:
    """The contacts of all pairs of shapes that may touch and have outlines."""
    if space.is_off("CONTACT"):
        return []
    found: list[Element] = []
    left: list[GeomPair] = []
    outlines = [outline_of(space, geom) for geom in range(space.model.ngeom)]
    for pair in _pairs(space):
        i, j = outlines[pair.first], outlines[pair.second]
        fits = _fit(pair, i, j)
        if fits is None:
            left.append(pair)
        elif fits:
            _check(space, pair)
            found += _contacts_of(space, pair, i, j)
    _examine_reference(space, left)
    if found:
        given = space.model.geom_solref[:, 0] < 0.0, space.model.geom_solref[:, 1] < 1.0
        if np.any(given[0] | given[1]):
            space.notes.append(
                "contacts are rigid and do not rebound here; those of the file give way, and may "
                "rebound (solref)"
            )
    return found


def _fit(pair: GeomPair, i: GeomOutline | None, j: GeomOutline | None) -> bool | None:
    """Whether two outlines can touch in the plane; None where that is no contact of outlines."""
    if i is None or j is None:
        return None
    kinds = {i.kind, j.kind}
    if kinds == {"line"}:
        return False
    if "line" in kinds:
        return True
    if "ends" in kinds or (kinds == {"polygon"} and pair.margin):
        return None
    gap = max(i.along[0] - j.along[1], j.along[0] - i.along[1])
    size = max(i.radius, j.radius, pair.margin)
    points = i.along[0] == i.along[1] and j.along[0] == j.along[1]
    if gap <= (FILE_PLACES_SAME * size if points else 0.0):
        return True
    reach = sum(one.radius for one in (i, j) if one.along[0] == one.along[1])
    return False if gap >= reach + pair.margin else None


def _check(space: Spatial, pair: GeomPair) -> None:
    """Refuse what a contact here has not."""
    names = " and ".join(seen(space.name("GEOM", one)) for one in (pair.first, pair.second))
    moving = [space.model.geom_surfacevel[one] for one in (pair.first, pair.second)]
    for value, why in (
        (np.any(moving), "a surface that moves"),
        (pair.adhesion, "adhesion"),
        (pair.rolling and pair.friction, "friction of rolling"),
    ):
        if value:
            raise refusal(f"the contact of the shapes {names}", f"it has {why}, which is not read")


def _pairs(space: Spatial) -> Iterator[GeomPair]:
    """All pairs of shapes between which MuJoCo looks for contacts, by its own rules."""
    model, root = space.model, np.asarray(space.model.body_weldid)
    body = np.asarray(model.geom_bodyid)
    given = set()
    for n in range(model.npair):
        one, other = int(model.pair_geom1[n]), int(model.pair_geom2[n])
        given.add((min(one, other), max(one, other)))
        friction = model.pair_friction[n]
        if root[body[one]] == root[body[other]]:
            continue
        rows = int(model.pair_dim[n])
        yield GeomPair(
            one,
            other,
            0.0 if rows == 1 else float(max(friction[:2])),
            float(model.pair_margin[n]),
            float(max(friction[3:])) if rows == 6 else 0.0,
            float(model.pair_adhesion[n]),
        )
    excluded = {int(n) for n in model.exclude_signature}
    above = root[np.asarray(model.body_parentid)[root]]
    types = np.asarray(model.geom_contype), np.asarray(model.geom_conaffinity)
    filtered = not space.is_off("FILTERPARENT")
    welded = set() if space.is_off("EQUALITY") else _welded(space)
    for one in range(model.ngeom):
        a = int(root[body[one]])
        for other in range(one + 1, model.ngeom):
            b = int(root[body[other]])
            if a == b or (one, other) in given:
                continue
            if not (types[0][one] & types[1][other] or types[0][other] & types[1][one]):
                continue
            if filtered and a and b and (above[a] == b or above[b] == a):
                continue
            if (min(a, b), max(a, b)) in welded:
                continue
            bodies = sorted((int(body[one]), int(body[other])))
            if (bodies[0] << 16) + bodies[1] in excluded:
                continue
            yield _of_geoms(space, one, other)


def _welded(space: Spatial) -> set[tuple[int, int]]:
    """Bodies that a constraint of the file keeps together, which do not move against each other."""
    model, found = space.model, set()
    for n in np.flatnonzero((model.eq_type == WELD) & (model.eq_active0 != 0)):
        first, second = int(model.eq_obj1id[n]), int(model.eq_obj2id[n])
        if model.eq_objtype[n] == int(space.mujoco.mjtObj.mjOBJ_SITE):
            first, second = (int(model.site_bodyid[site]) for site in (first, second))
        a, b = space.root(first), space.root(second)
        found.add((min(a, b), max(a, b)))
    return found


def _of_geoms(space: Spatial, one: int, other: int) -> GeomPair:
    """A pair with what MuJoCo makes of the numbers of its two shapes."""
    model, ranks = space.model, space.model.geom_priority
    used = (
        [one, other] if ranks[one] == ranks[other] else [max((one, other), key=ranks.__getitem__)]
    )
    friction = np.max(model.geom_friction[used], axis=0)
    margin = float(model.geom_margin[[one, other]].sum())
    if model.opt.enableflags & int(space.mujoco.mjtEnableBit.mjENBL_OVERRIDE):
        friction, margin = model.opt.o_friction[[0, 2, 3]], float(model.opt.o_margin)
    rows = int(max(model.geom_condim[used]))
    return GeomPair(
        one,
        other,
        0.0 if rows == 1 else float(friction[0]),
        margin,
        float(friction[2]) if rows == 6 else 0.0,
        float(model.geom_adhesion[used].sum()),
    )


def _contacts_of(
    space: Spatial, pair: GeomPair, i: GeomOutline | None, j: GeomOutline | None
) -> Iterator[Element]:
    """The contacts of a pair: one, of the ends of a capsule two."""
    assert i is not None and j is not None
    sides = [(pair.first, i), (pair.second, j)]
    if i.kind != "line" and (j.kind == "line" or i.kind == "polygon"):
        sides.reverse()  # a line first, and a disc before a polygon: it is grown by the margin
    (first, one), (second, other) = sides
    base = _shape(space, first, one, 0, pair.margin)
    label = f"{space.label('GEOM', first)}_{space.label('GEOM', second)}"
    for n in range(2 if other.kind == "ends" else 1):
        shape = _shape(space, second, other, n, 0.0)
        yield Contact(space.unique(label), base, shape, friction=pair.friction)


def _shape(space: Spatial, geom: int, outline: GeomOutline, n: int, margin: float) -> str:
    """The dotted name of a shape, grown by a margin; made where it is not there."""
    body = int(space.model.geom_bodyid[geom])
    root, label = space.root(body), space.label("GEOM", geom)
    radius, points, kind = outline.radius + margin, outline.points, outline.kind
    made: Any
    if kind == "line":
        heading = outline.direction
        normal = -math.sin(heading) * space.plane.x + math.cos(heading) * space.plane.y
        name = space.place(body, f"{label}_point", points[0] + margin * normal)
        made = Line(name.rpartition(".")[2], heading)
    elif kind == "polygon":
        names = [space.place(body, f"{label}_corner", at) for at in points]
        made = Polygon(tuple(name.rpartition(".")[2] for name in names))
    else:
        name = space.place(body, f"{label}_centre", points[n])
        made = Disc(name.rpartition(".")[2], radius)
    shapes, taken = space.shapes[root], space.points[root]
    for key, there in shapes.items():
        if there == made:
            return f"{space.names[root]}.{key}"
    key, count = label, 2
    while key in shapes or key in taken:
        key, count = f"{label}_{count}", count + 1
    shapes[key] = made
    return f"{space.names[root]}.{key}"


def _examine_reference(space: Spatial, left: list[GeomPair]) -> None:
    """Name the pairs that are not taken, and those that overlap at the reference position; refuse
    those that are not taken and touch there.
    """
    deepest: dict[str, float] = {}
    data, without = space.data, {(pair.first, pair.second): pair for pair in left}
    for n in range(data.ncon):
        contact = data.contact[n]
        one, other = sorted(int(geom) for geom in contact.geom)
        if contact.dist < -FILE_PLACES_SAME * float(space.model.stat.extent):
            names = f"{space.name('GEOM', one)} and {space.name('GEOM', other)}"
            deepest[names] = max(deepest.get(names, 0.0), -float(contact.dist))
        if contact.efc_address >= 0 and ((one, other) in without or (other, one) in without):
            names = " and ".join(seen(space.name("GEOM", geom)) for geom in (one, other))
            raise refusal(
                f"the shapes {names}",
                "they touch at the reference position, and the contact of such shapes is not read: "
                "planes across the plane of the motion with anything round or rectangular are, "
                "spheres, and cylinders and boxes along its normal",
            )
    space.notes += [
        f"the shapes {names} overlap by {depth:.4g} m at the reference position: begin elsewhere"
        for names, depth in deepest.items()
    ]
    if left:
        named = [
            "–".join(space.name("GEOM", geom) for geom in (pair.first, pair.second))
            for pair in left[:NAMED]
        ]
        more = f" and {len(left) - NAMED} more" if len(left) > NAMED else ""
        space.notes.append(
            f"contacts of these shapes are not taken, they pass through each other: "
            f"{', '.join(named)}{more}"
        )

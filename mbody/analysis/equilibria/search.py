"""Search for equilibria on a manifold: walks, covers, and Newton's method with damping.

One free motion is walked along all round (`curve_walk`), and every zero of the residual force
isolated there; the surface of two is covered with places (`surface_roots`). Of more free
motions a fixed spread of starts is taken; from each Levenberg–Marquardt on |r|² finds the nearest
equilibrium, and a descent along the residual force a stable one. From every position that is
found each leader is then walked round by itself, the others fixed, as a link of a chain that is
turned over where it hangs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mbody.analysis.equilibria.curve_walk import RUN_AWAY, MotionCurve, Walk, out_of_order, roots_of
from mbody.analysis.equilibria.position_surface import Cover
from mbody.analysis.equilibria.surface_roots import surface_roots
from mbody.analysis.freedom.mobility import free_motions, leading, rates_of
from mbody.analysis.position.tangent_space import Array, Manifold, ManyPositions, Place
from mbody.core import tolerances as tol

# -- Why a number of equilibria is uncertain near a place: a load jumps, or no stiffness -------


def jumping_loads(manifold: Manifold, place: Place) -> list[str]:
    """Names of the loads whose force jumps at a place, as of a spring whose ends meet there."""
    many, directions = ManyPositions(manifold), manifold.scale * place.motions
    changes = []
    for step in (tol.LOADS_COMPARED_NEAR, tol.LOADS_COMPARED_FAR):
        sides = [many.loads(place.q + sign * step * directions) for sign in (1.0, -1.0)]
        changes.append(np.abs(sides[0] - sides[1]).max(axis=(0, 2), initial=0.0))
    least = tol.LOAD_CHANGE_NONE * manifold.largest(place.q)
    jumps = (changes[0] > tol.LOAD_JUMP * changes[1]) & (changes[0] > least)
    loads = manifold.system.mechanism.loads
    return [load.name for load, own in zip(loads, jumps, strict=True) if own]


def directionless_loads(manifold: Manifold, place: Place) -> list[str]:
    """Names of the loads that are left out at this very place, and are there beside it: where the
    ends of a spring meet, its force has no direction.
    """
    many, directions = ManyPositions(manifold), manifold.scale * place.motions
    inner, outer = (
        np.abs(
            many.loads(np.concatenate([place.q + step * directions, place.q - step * directions]))
        )
        .max(axis=2, initial=0.0)
        .max(axis=0, initial=0.0)
        for step in (tol.LOADS_BESIDE, tol.LOADS_BESIDE_FURTHER)
    )
    here = np.abs(many.loads(place.q[None]))[0].max(axis=1, initial=0.0)
    # a load that vanishes smoothly is as much smaller as it is nearer
    gone = (here < tol.LOAD_JUMP * inner) & (inner > tol.LOAD_JUMP * outer)
    loads = manifold.system.mechanism.loads
    return [load.name for load, own in zip(loads, gone, strict=True) if own]


def without_stiffness(manifold: Manifold, place: Place) -> bool:
    """Whether nothing drives it back to first order along some free motion."""
    K = manifold.stiffness(place)
    if not (K.size and np.isfinite(K).all()):
        return False
    sizes = np.linalg.svd(K, compute_uv=False)
    return bool(sizes[-1] <= tol.STIFFNESS_SOFT * max(float(sizes[0]), manifold.scale_of(place)))


#: How many steps a walk makes each way.
STRIDES = 80
#: Distances of the starts along each of several free motions.
DISTANCES = (0.8, 1.8, 3.0)
#: Random directions for each of several free motions, starts in all by free motion, and directions
#: at least: a start costs the square of the free motions and more.
RANDOM, MOST, LEAST = 3, 120, 2
#: Walks of single leaders, by free motion: those of four links of a chain, from all 16 positions.
WALKS = 256
#: Iterations of a search and of a descent.
ITERATIONS, DESCENT = 100, 60


def unit(direction: Array) -> Array:
    """A direction with the rate one of its fastest coordinate."""
    return np.asarray(direction / np.abs(direction).max())


@dataclass(frozen=True, eq=False)
class EquilibriumPosition:
    """An equilibrium.

    `stiffness` (free, free): In the free directions of the place.
    `top`: What its forces are measured by, as a torque; see `Manifold.scale_of`.
    `row`: Whether it is one of a row without end, along which no force arises.
    `singular`: Whether more is free here, to first order, than nearby: branches of the motion meet.
    """

    place: Place
    stiffness: Array
    top: float
    row: bool
    singular: bool = False


@dataclass
class EquilibriumSearch:
    """Equilibria and doubtful positions found from all starts.

    `found`: Equilibria, no two the same, in the order in which they were met.
    `least`: Where the residual force was least, as a part of the greatest load.
    `ran_away`: Where a descent left all bounds.
    `lifts`: Where a load jumps, as a spring whose ends meet, and drives away.
    `jumps`, `unsure`, `odd`: Of single free motions: where loads drive from both sides and nothing
      balances, where no number of equilibria is certain, and beside which stable and unstable
      ones do not alternate.
    `ends`: Why and where a walk along a single free motion ended that does not close; "wound" where
      further revolutions may have equilibria too.
    `walks`: Along single free motions.
    """

    manifold: Manifold
    found: list[EquilibriumPosition] = field(default_factory=list)
    least: Place | None = None
    ran_away: Place | None = None
    jumps: list[Place] = field(default_factory=list)
    unsure: list[Place] = field(default_factory=list)
    odd: list[Place] = field(default_factory=list)
    lifts: list[Place] = field(default_factory=list)
    ends: list[tuple[str, Place]] = field(default_factory=list)
    walks: list[tuple[MotionCurve, Walk]] = field(default_factory=list)
    origin: Array = field(default_factory=lambda: np.zeros(0))
    _ratio: float = np.inf

    def nearest(self, here: Place) -> None:
        """The equilibrium that is nearest to one place."""
        self.origin = here.q
        self._settle(here)

    def around(self, here: Place) -> None:
        """Search from one place along its free motions."""
        self.origin = here.q
        single = [here] if len(here.motions) == 1 else self._places_around(here)
        for place in single:
            if not any(curve.passes(walk, place) for curve, walk in self.walks):
                self._walk(place)
        if single:
            return
        self._try(here)
        if any(position.row and not position.stiffness.any() for position in self.found):
            return  # nothing drives it anywhere
        if len(here.motions) == 2:
            self._cover(here)
            return
        for start in self._spread(here):
            self._try(start)
        self._each_leader(len(here.motions))

    def _cover(self, here: Place) -> None:
        """All equilibria of two free motions, on the surface of their positions."""
        pose = np.append(here.q, np.zeros(3))
        system = self.manifold.system
        rates = rates_of(system, free_motions(system, pose, here.motions)).reshape(2, -1)
        # leaders have a sign of their own, a null space has not
        frame = np.linalg.qr((rates / self.manifold.scale).T)[0].T
        cover = Cover(self.manifold, here, frame)
        roots = surface_roots(cover, self._polished)
        before = len(self.found)
        # those equally far in the order in which they were met, whatever rounding says
        for place in sorted(
            roots.equilibria, key=lambda one: round(self.manifold.distance(one.q, here.q), 6)
        ):
            self._keep(place)
        self.jumps += roots.jumps
        self.unsure += roots.unsure
        new = [
            r
            for r in self.found
            if cover.distances(cover.name(r.place.q)).min() < tol.SURFACE_SPACING
        ]
        row = any(position.row for position in self.found[before:])
        # each border that loads drive away from takes one from the Euler characteristic
        inward = not (cover.full or cover.driven_out())
        odd = inward and not roots.creased and (len(new) + roots.index + cover.borders) % 2
        if odd and not roots.unsure and not row:
            self.ends.append(("odd", here))
        if cover.full:
            self.ends.append(("wide", cover.nodes[-1].place))
        elif not inward:
            self.ends.append(("wide", cover.rim[0].place))
        elif cover.distinguishes_revolutions():
            self.ends.append(("turns", here))
        self._relax(here)

    def _polished(self, nearby: Place) -> Place | None:
        """The equilibrium that a place is close to."""
        place = self._solved(nearby)
        return (
            place
            if place.size <= tol.EQUILIBRIUM_BALANCED * self.manifold.scale_of(place)
            else None
        )

    def _places_around(self, here: Place) -> list[Place]:
        """Places around a singular one that have a single free motion; none where others have not.

        There branches of the motion meet, so that more is free to first order than nearby.
        """
        directions = [sign * direction for direction in here.motions for sign in (1.0, -1.0)]
        found = [
            self.manifold.moved(here, 0.5 * tol.EQUILIBRIUM_STRIDE * unit(direction))
            for direction in directions
        ]
        return [place for place in found if place is not None and len(place.motions) == 1]

    def _spread(self, here: Place) -> list[Place]:
        """Starts along every free motion, both ways, and along random mixtures of them."""
        free = len(here.motions)
        random = np.random.default_rng(0)
        mixed = random.normal(size=(RANDOM * free, free))
        directions = [*np.eye(free), *-np.eye(free), *mixed, *-mixed]
        found: list[Place] = []
        few = max(MOST // free // len(DISTANCES), LEAST)
        for direction in directions[:few]:
            place: Place | None = here
            along = unit(direction @ here.motions)
            arclength = 0.0
            for distance in DISTANCES:
                while place is not None and arclength < distance:
                    place, along = self._step(place, along, tol.EQUILIBRIUM_STRIDE)
                    arclength += tol.EQUILIBRIUM_STRIDE
                if place is not None:
                    found.append(place)
        return found

    def _step(self, here: Place, along: Array, length: float) -> tuple[Place | None, Array]:
        """The next place of a walk and the direction there; a shorter step where it does not close,
        None at an end. Directions are those of the fastest coordinate, whose rate is one: so is a
        step of many bodies as long as one of few.
        """
        for _ in range(4):
            there = self.manifold.moved(here, length * along)
            if there is not None and len(there.motions):
                onward = along @ there.motions.T @ there.motions
                if np.linalg.norm(onward) > 0.5 * np.linalg.norm(along):
                    return there, unit(onward)
            length *= 0.5
        return None, along

    def _walk(self, here: Place) -> None:
        """All equilibria along a single free motion: both ways from a place, or all round."""
        curve = MotionCurve(self.manifold, here)
        if max(abs(curve.start.residual), abs(curve.start.derivative)) == 0.0:
            self._keep(here)
            return
        onward = curve.walk(1.0)
        again = onward.nodes[-1].place
        # turns of a torsion spring are different positions
        alike = float(np.abs(again.force - here.force).max())
        round_ = onward.closed and alike <= tol.EQUILIBRIA_ALIKE * self.manifold.scale_of(here)
        walks = [onward]
        if onward.closed and not round_:
            walks.append(curve.walk(-1.0, 0.5 * float(curve.arclengths(onward)[-1])))
            if curve.balanced_beyond(onward):
                self.ends.append(("wound", again))
        elif not round_:
            walks.append(curve.walk(-1.0))
        self.walks += [(curve, walk) for walk in walks]
        met_behind = self._met_behind(curve, walks)
        met: list[tuple[float, Place]] = []
        for walk in walks:
            roots = roots_of(curve, walk, start=walk is onward and not round_)
            whole = float(curve.arclengths(walk)[-1]) if round_ else np.inf
            for position in roots.equilibria:
                arclength = curve.arclength_of(position, walk)
                place = position.place
                if whole - arclength < arclength:  # nearer the other way round
                    back = self.manifold.place(place.q - (again.q - here.q))
                    arclength, place = whole - arclength, back or place
                met.append((arclength, place))
            self.jumps += [node.place for node in roots.jumps]
            odd = out_of_order(curve, walk, roots)
            # a walk that comes to the very place where a load jumps does not see the jump
            if odd and not any(
                directionless_loads(self.manifold, r.place) for r in roots.equilibria
            ):
                self.odd += [node.place for node in odd]
            self.unsure += [node.place for node in roots.unsure]
            if walk.end not in ("", "far", "longest") and not met_behind:
                self.ends.append((walk.end, walk.nodes[-1].place))
        known = list(self.found)
        # what is met first comes first, whichever way; one that is met twice is one
        for _, place in sorted(met, key=lambda pair: round(pair[0], 6)):
            self._keep(place, known)
        if not met:
            nodes = [node for walk in walks for node in walk.nodes]
            self._settle(min(nodes, key=lambda node: abs(node.residual)).place)
        if not round_:
            self._try(here)

    def _met_behind(self, curve: MotionCurve, walks: Sequence[Walk]) -> bool:
        """Whether two walks that were given up meet each other, whole revolutions left out, so that
        together they have all of a closed curve: as of a wheel that rolls round in a ring.
        """
        if [walk.end for walk in walks] != ["long", "long"]:
            return False
        onward, back = walks
        last = back.nodes[-1].place
        if not curve.passes(onward, last):
            return False
        nearest = min(onward.nodes, key=lambda node: self.manifold.distance(node.place.q, last.q))
        revolutions = np.zeros(len(last.q))
        revolutions[2::3] = 2.0 * np.pi * np.round((nearest.place.q - last.q)[2::3] / (2.0 * np.pi))
        there = self.manifold.place(last.q + revolutions)
        if there is None:
            return False
        alike = float(np.abs(there.force - last.force).max())
        return alike <= tol.EQUILIBRIA_ALIKE * self.manifold.scale_of(last)

    def _each_leader(self, free: int) -> None:
        """Walk every leader by itself from every equilibrium, those included that it leads to."""
        walks = WALKS // free
        for position in self.found:  # grows on the way
            if position.singular or len(position.place.motions) != free:
                continue
            system, pose = self.manifold.system, np.append(position.place.q, np.zeros(3))
            motions = free_motions(system, pose, position.place.motions)
            directions = rates_of(system, motions).reshape(free, -1) / self.manifold.scale
            parts = leading(system, motions, directions)
            for n, direction in enumerate(directions):
                if not walks:
                    return
                walks -= 1
                self._lead(position.place, direction, np.delete(parts, n, axis=0))

    def _lead(self, start: Place, direction: Array, fixed: Array) -> None:
        """Equilibria from where the residual force along a direction changes its sign; the
        other leaders do not move, fixed (free − 1, coordinates) being what they do.
        """
        none = tol.EQUILIBRIUM_BALANCED * self.manifold.largest(start.q)
        for sign in (1.0, -1.0):
            here, along, last = start, sign * unit(direction), 0.0
            for n in range(STRIDES):
                there = self.manifold.moved(here, tol.EQUILIBRIUM_STEP_LONGEST * along)
                if there is None or there.motions.shape != start.motions.shape:
                    break
                sizes, vt = np.linalg.svd(fixed @ there.motions.T)[1:]
                if not sizes[-1] > tol.EQUILIBRIUM_INDEPENDENT * sizes[0] or self._is_away(there):
                    break
                onward = vt[-1] @ there.motions
                along = unit(onward) * np.sign(onward @ along)
                residual = float(there.push @ along)
                if abs(residual) > none:
                    if last * residual < 0.0:
                        self._settle(there if abs(residual) < abs(last) else here)
                    last = residual
                here = there
                if (
                    n > 2
                    and self.manifold.distance(here.q, start.q) < 0.6 * tol.EQUILIBRIUM_STEP_LONGEST
                ):
                    return  # once round

    def _try(self, start: Place) -> None:
        """The nearest equilibrium, and a stable one."""
        self._settle(start)
        relaxed = self._relax(start)
        if relaxed is not None:
            self._settle(relaxed)

    def _settle(self, here: Place) -> None:
        """Keep the equilibrium that is nearest, or what is left where there is none."""
        self._keep(self._solved(here))

    def _solved(self, here: Place) -> Place:
        """Levenberg–Marquardt on the residual force: the place where it ends."""
        damping = tol.EQUILIBRIUM_DAMPING_FIRST
        for _ in range(ITERATIONS):
            if here.size == 0.0 or not len(here.motions):
                break
            K = self.manifold.stiffness(here)
            if not np.isfinite(K).all():
                break
            size = max(float(np.abs(K).max()), tol.TINY)
            A = np.vstack([K, np.sqrt(damping) * size * np.eye(len(K))])
            step = np.linalg.lstsq(
                A,
                np.append(here.residual, 0.0 * here.residual),
                rcond=tol.LEAST_SQUARES_RANK_SEARCH,
            )[0]
            step *= min(
                1.0, tol.EQUILIBRIUM_STEP_LONGEST / max(float(np.linalg.norm(step)), tol.TINY)
            )
            there = self.manifold.moved(here, step @ here.motions)
            length = float(np.linalg.norm(step))
            if there is not None and there.size < here.size:
                stalled = there.size > 0.5 * here.size
                here, damping = there, max(0.1 * damping, tol.EQUILIBRIUM_DAMPING_LEAST)
                if length < tol.EQUILIBRIUM_STEP_ROUNDING or (
                    length < tol.EQUILIBRIUM_STEP_STALLED and stalled
                ):
                    break
            else:
                damping = max(10.0 * damping, tol.EQUILIBRIUM_DAMPING_FAILED)
                if length < tol.EQUILIBRIUM_STEP_STALLED or damping > tol.EQUILIBRIUM_DAMPING_LOST:
                    break
        return here

    def _relax(self, here: Place) -> Place | None:
        """Along the residual force to where it ends: a stable equilibrium, as far as there is
        one.
        """
        step_limit = tol.EQUILIBRIUM_STEP_LONGEST
        for _ in range(DESCENT):
            if self._is_away(here):
                self.ran_away = here
                return None
            K = self.manifold.stiffness(here)
            if not (len(here.motions) and np.isfinite(K).all()):
                return None
            values, vectors = np.linalg.eigh(0.5 * (K + K.T))
            stiff = np.maximum(
                np.abs(values), tol.EQUILIBRIUM_DESCENT_SOFT * max(np.abs(values).max(), here.size)
            )
            if not stiff.all():
                return here
            step = vectors @ ((vectors.T @ here.residual) / stiff)
            length = float(np.linalg.norm(step))
            if length < tol.EQUILIBRIUM_DESCENT_STEP:
                return here
            step *= min(1.0, step_limit / length)
            along = step @ here.motions
            there = self.manifold.moved(here, along)
            # not so far that the residual force turns round: the loads would take work back
            if there is None or there.push @ along < -0.5 * (here.push @ along):
                step_limit = 0.5 * min(step_limit, length)
                if step_limit < tol.EQUILIBRIUM_DESCENT_LEAST:
                    return here
                continue
            here, step_limit = (
                there,
                min(
                    2.0 * step_limit,
                    max(tol.EQUILIBRIUM_STEP_LONGEST, 0.5 * self._displacement(there)),
                ),
            )
        return here

    def _displacement(self, here: Place) -> float:
        """Greatest displacement of a mass centre from where the search began, in model lengths."""
        displacement = (here.q - self.origin) / self.manifold.scale
        return float(np.abs(displacement.reshape(-1, 3)[:, :2]).max(initial=0.0))

    def _is_away(self, here: Place) -> bool:
        return self._displacement(here) > RUN_AWAY

    def _keep(self, here: Place, known: Sequence[EquilibriumPosition] | None = None) -> None:
        """Keep an equilibrium that is new among `known`, by default all that are found, and not
        another one after whole revolutions; of places that do not rest the one with the least
        residual force.
        """
        top = self.manifold.scale_of(here)
        if here.size > tol.EQUILIBRIUM_BALANCED * top or self._is_away(here):
            ratio = here.size / top
            if ratio < self._ratio and not self._is_away(here):
                self.least, self._ratio = here, ratio
            return
        for other in self.found:
            revolved = np.abs(other.place.q - here.q)[2::3].max(initial=0.0) > np.pi
            if not (known is None or revolved or any(other is one for one in known)):
                continue  # the walk distinguishes neighbours along it
            alike = np.abs(other.place.force - here.force).max() <= tol.EQUILIBRIA_ALIKE * top
            if alike and self.manifold.distance(other.place.q, here.q) < tol.POSITION_SAME_LOOSE:
                return
        if self._at_jump(here):
            return
        position = self._position(here, top)
        if not (position.row and any(self._same_row(position, other) for other in self.found)):
            self.found.append(position)

    def _at_jump(self, here: Place) -> bool:
        """Whether a load has no direction at this very place, as a spring whose ends meet, and is
        left out: what is left balances there, and the forces do not.
        """
        if not directionless_loads(self.manifold, here):
            return False
        directions = [sign * direction for direction in here.motions for sign in (1.0, -1.0)]
        adjacent = [
            (direction, self.manifold.moved(here, tol.POSITION_SAME_LOOSE * direction))
            for direction in directions
        ]
        back = all(
            there is not None and there.push @ direction < 0.0 for direction, there in adjacent
        )
        (self.jumps if back else self.lifts).append(here)
        self.least = self.least or here
        return True

    def _position(self, here: Place, top: float) -> EquilibriumPosition:
        """Stiffness, stability and isolation of an equilibrium."""
        K = self.manifold.stiffness(here)
        sizes, vt = np.linalg.svd(K)[1:]
        none = sizes <= tol.STIFFNESS_ZERO * max(top, float(np.abs(K).max(initial=0.0)))
        row = False
        for direction in vt[none]:
            there = self.manifold.moved(here, tol.EQUILIBRIUM_STRIDE * direction @ here.motions)
            if there is not None:
                there = self._solved(there)
                distance = self.manifold.distance(there.q, here.q)
                row |= (
                    there.size <= tol.EQUILIBRIUM_BALANCED * top
                    and distance > 0.1 * tol.EQUILIBRIUM_STRIDE
                )
        adjacent = [
            self.manifold.moved(here, 0.1 * tol.EQUILIBRIUM_STRIDE * direction)
            for direction in here.motions
        ]
        singular = any(p is not None and len(p.motions) < len(here.motions) for p in adjacent)
        return EquilibriumPosition(here, K, top, row, singular)

    def _same_row(self, one: EquilibriumPosition, other: EquilibriumPosition) -> bool:
        """Whether two positions without restoring force look alike but for where they are."""
        if not (other.row and len(one.stiffness) == len(other.stiffness)):
            return False
        sizes = [np.linalg.eigvals(position.stiffness) for position in (one, other)]
        forces = [
            np.linalg.norm(position.place.force.reshape(-1, 3)[:, :2]) for position in (one, other)
        ]
        difference = float(np.abs(np.sort_complex(sizes[0]) - np.sort_complex(sizes[1])).max())
        scale = max(one.top, float(np.abs(sizes[0]).max()))
        return max(difference, float(abs(forces[0] - forces[1]))) <= tol.EQUILIBRIA_ALIKE * scale

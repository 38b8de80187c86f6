"""Exudyn: planar rigid bodies in redundant coordinates, pins as constraints, implicit steps.

The trapezoidal rule on the constraints of velocities ("index 2") was its most exact integrator of
those tried, with Newton to 1e-8 and 1e-10; all steps are made in one call, in its build without
checks of ranges. Discs and small round ends touch a wall by springs, dampers and regularised
friction (`GeneralContact`): it has no rigid contact with friction of planar bodies.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.frame import Engine
from benchmarks.planar import GROUND, Planar

__all__ = ["Made", "engine", "made_of", "settings_of", "solve", "touch"]

#: Half the width of a wall [m]; sliding from which on friction is full [m/s].
WIDE, SLIP = 20.0, 1e-3
#: Stiffness of a wall by that of the stiffest round end.
RIGID = 1e9


def module() -> Any:
    """Exudyn's fast build, which is chosen before its first import."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    import exudyn

    return exudyn


@dataclass
class Made:
    """A model that is not assembled yet; the last body is the ground."""

    system: Any
    bodies: list[int]
    nodes: list[int]
    #: Kept, as the model is part of it.
    container: Any

    def marker(self, body: int, place: tuple[float, float], kind: str = "Position") -> int:
        """A marker on a body, -1 the ground; the place is from its mass centre in its axes."""
        from exudyn import itemInterface as items

        maker = getattr(items, f"MarkerBody{kind}")
        found = maker(bodyNumber=self.bodies[body], localPosition=[*place, 0.0])
        return int(self.system.AddMarker(found))

    def coordinate(self, body: int, number: int) -> int:
        """A marker on x, y or the angle of a body."""
        from exudyn import itemInterface as items

        found = items.MarkerNodeCoordinate(nodeNumber=self.nodes[body], coordinate=number)
        return int(self.system.AddMarker(found))

    def coordinates(self, velocities: bool = False) -> np.ndarray:
        """x, y and angle of every body, or their rates."""
        kinds = module().OutputVariableType
        kind = kinds.Coordinates_t if velocities else kinds.Coordinates
        return np.array([self.system.GetNodeOutput(node, kind) for node in self.nodes])


def made_of(machine: Planar) -> Made:
    """Bodies, pins, springs, torques and gravity at the start."""
    from exudyn import itemInterface as items

    container = module().SystemContainer()
    system = container.AddSystem()
    made = Made(system, [], [], container)
    for mass, inertia, pose, rate in zip(
        machine.mass, machine.inertia, machine.pose, machine.rate, strict=True
    ):
        # angles are coordinates, so that they come out as those of the other engines
        start = items.NodeRigidBody2D(
            initialCoordinates=pose.tolist(), initialVelocities=rate.tolist()
        )
        node = system.AddNode(start)
        body = items.ObjectRigidBody2D(mass=float(mass), inertia=float(inertia), nodeNumber=node)
        made.nodes.append(node)
        made.bodies.append(system.AddObject(body))
        heavy = system.AddMarker(items.MarkerBodyMass(bodyNumber=made.bodies[-1]))
        pull = items.LoadMassProportional(
            markerNumber=heavy, loadVector=[0.0, machine.gravity, 0.0]
        )
        system.AddLoad(pull)
    assert GROUND == -1
    made.bodies.append(system.AddObject(items.ObjectGround()))
    for i, j, on_i, on_j in machine.pins:
        ends = [made.marker(i, on_i), made.marker(j, on_j)]
        system.AddObject(items.ObjectJointRevolute2D(markerNumbers=ends))
    for i, j, on_i, on_j, stiffness, free in machine.springs:
        ends = [made.marker(i, on_i), made.marker(j, on_j)]
        spring = items.ObjectConnectorSpringDamper(
            markerNumbers=ends, stiffness=stiffness, referenceLength=free
        )
        system.AddObject(spring)
    for body, torque in machine.torques:
        turned = made.marker(body, (0.0, 0.0), "Rigid")
        load = items.LoadTorqueVector(markerNumber=turned, loadVector=[0.0, 0.0, torque])
        system.AddLoad(load)
    for i, j, stiffness in machine.twists:
        turned = [made.coordinate(i, 2), made.coordinate(j, 2)]
        twist = items.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=turned, stiffness=stiffness
        )
        system.AddObject(twist)
    for body, number in machine.held:
        fixed = system.AddNode(items.NodePointGround())
        ground = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
        ends = [ground, made.coordinate(body, number)]
        system.AddObject(items.ObjectConnectorCoordinate(markerNumbers=ends))
    return made


def touch(
    made: Made, machine: Planar, law: Callable[[float], tuple[float, float]], radius: float
) -> None:
    """Rims touch the wall, those that are points as balls of this radius; `law`: stiffness and
    damping for a restitution, by a unit of the mass that a push on the rim has to move.
    """
    contact = made.system.AddGeneralContact()
    contact.verboseMode = 0
    contact.frictionProportionalZone = SLIP
    coefficients = [rim.friction for rim in machine.rims]
    assert len(set(coefficients)) == 1
    contact.SetFrictionPairings(np.array([coefficients[:1]]))
    low = 0.0 if machine.rims[0].radius else radius
    stiffest = 0.0
    for rim in machine.rims:
        k, b = (machine.mass_at(rim) * one for one in law(rim.restitution))
        stiffest = max(k, stiffest)
        contact.AddSphereWithMarker(
            made.marker(rim.body, rim.place, "Rigid"),
            radius=rim.radius or radius,
            contactStiffness=k,
            contactDamping=b,
            frictionMaterialIndex=0,
        )
    (x, y), (nx, ny) = machine.wall
    corners = [(-WIDE, -WIDE), (WIDE, -WIDE), (WIDE, WIDE), (-WIDE, WIDE)]
    # springs of both are in series, dampers add: those of the round ends are to be the contact's
    contact.AddTrianglesRigidBodyBased(
        rigidBodyMarkerIndex=made.marker(GROUND, (0.0, 0.0), "Rigid"),
        contactStiffness=RIGID * stiffest,
        contactDamping=0.0,
        frictionMaterialIndex=0,
        pointList=[[x - low * nx + u * ny, y - low * ny - u * nx, z] for u, z in corners],
        triangleList=[[0, 2, 1], [0, 3, 2]],
    )
    contact.SetSearchTreeCellSize([1, 1, 1])
    contact.SetSearchTreeBox([-WIDE] * 3, [WIDE] * 3)


def settings_of(until: float, count: int) -> Any:
    """So many steps of equal length, nothing written."""
    found = module().SimulationSettings()
    found.timeIntegration.numberOfSteps = count
    found.timeIntegration.endTime = until
    found.timeIntegration.verboseMode = 0
    found.timeIntegration.newton.relativeTolerance = 1e-8
    found.timeIntegration.newton.absoluteTolerance = 1e-10
    found.solution.file.write = False
    found.show.globalTimers = False
    return found


def solve(made: Made, settings: Any, solver: str = "TrapezoidalIndex2") -> Made:
    """The model at the end; what it cannot pass raises."""
    kind = getattr(module().DynamicSolverType, solver)
    made.system.SolveDynamic(settings, solverType=kind, updateInitialValues=True)
    return made


def engine(machine: Planar, until: float, counts: Sequence[int]) -> Engine:
    """So many steps of equal length of a mechanism of pins."""

    def prepare(count: int) -> Callable[[], Made]:
        made = made_of(machine)
        made.system.Assemble()
        settings = settings_of(until, count)
        return lambda: solve(made, settings)

    def state(made: Made) -> tuple[np.ndarray, np.ndarray]:
        return made.coordinates()[:, 2], made.coordinates(velocities=True)[:, 2]

    return Engine("Exudyn TrapezoidalIndex2", list(counts), prepare, state)

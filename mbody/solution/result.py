"""What functions of results rely on: the protocol that `Solution` fulfils."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

import numpy as np

from mbody.model.element import Marker
from mbody.model.mechanism import Mechanism
from mbody.model.study import Measure
from mbody.solution.doubts import Doubt
from mbody.solution.energy import Energy
from mbody.solution.histories import (
    BodyHistory,
    BranchDistance,
    LoadHistory,
    PointHistory,
    Reaction,
    Record,
)
from mbody.solution.stepped_contacts import SteppedContacts
from mbody.system.system import System

__all__ = ["Result"]

Array = np.ndarray


class Result(Protocol):
    """Histories by name over the instants of an analysis; see `mbody.Solution`."""

    @property
    def system(self) -> System:
        """What was analysed."""

    @property
    def mechanism(self) -> Mechanism:
        """The description of it."""

    @property
    def analysis(self) -> str:
        """Name of the analysis, such as ``"kinetostatics"``."""

    def contact(self, joint: str) -> Array:
        """Force with which the bodies of a contact press on each other."""

    @property
    def has_forces(self) -> bool:
        """Whether the analysis found reactions and efforts."""

    @property
    def t(self) -> Array:
        """Instants (instants,)."""

    @property
    def record(self) -> Record:
        """All numbers of all instants, by place."""

    @property
    def given(self) -> Array | None:
        """Value, rate and acceleration of the drivers (instants, drivers, 3), where given."""

    @property
    def regularization(self) -> float:
        """Regularisation of redundant constraints; 0 where there are none."""

    @property
    def drive_states(self) -> Array | None:
        """Value, rate and acceleration of the drivers (instants, drivers, 3)."""

    @property
    def released(self) -> Mapping[str, float]:
        """Times at which drivers were released."""

    @property
    def energy(self) -> Energy | None:
        """Account of energy of a free motion."""

    @property
    def branch(self) -> BranchDistance | None:
        """How near the motion came to another branch."""

    @property
    def stepped(self) -> SteppedContacts | None:
        """What touches, of a motion by steps with impulses."""

    @property
    def residuals(self) -> Array:
        """See `mbody.kernels.residuals`: (designs, instants, 5)."""

    @property
    def status(self) -> str:
        """How the analysis ended, or that it is doubtful."""

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """What the evidence of the result does not support."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Facts, and the messages of the doubts."""

    @property
    def losses(self) -> Mapping[str, Array]:
        """Power that friction takes in each rough joint."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[str]: ...

    def __getitem__(self, body: str) -> BodyHistory: ...

    def point(self, place: Marker | str) -> PointHistory:
        """Motion of a place on a body."""

    def reaction(self, joint: str, on: str | None = None) -> Reaction:
        """Force and torque of a joint on one of its bodies."""

    def effort(self, driver: str) -> Array:
        """Effort of a driver or a coupling."""

    def load(self, name: str, on: str | None = None) -> LoadHistory:
        """What a load does."""

    def driven(self, driver: str) -> tuple[Array, Array, Array]:
        """Value, rate and acceleration of what a driver drives."""

    def measure(self, of: str | Measure) -> Array:
        """History of a measured quantity."""

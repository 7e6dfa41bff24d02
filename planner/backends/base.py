"""The protocol of a back end, which computes the time scaling of a joint path and states its guarantees."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Protocol, TypeGuard

from planner.guarantees import QUANTITIES, Capabilities, Guarantee
from planner.paths import JointPath
from planner.trajectories.trajectory import Trajectory


class BackEnd(Protocol):
    """A back end computes the time scaling of a joint path. It is a frozen dataclass whose fields are its options.

    Each field carries `metadata` with a `description` and, if it is bounded, the bounds `gt`, `ge`, `le`.

    Attributes:
        kind: Its name.
        summary: Its purpose, in one sentence.
        guarantees: Its promise about each of `QUANTITIES`.
        capabilities: Its abilities beyond motions from rest to rest; they may depend on options.
    """

    kind: ClassVar[str]
    summary: ClassVar[str]
    guarantees: ClassVar[Mapping[str, Guarantee]]
    capabilities: ClassVar[Capabilities]

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put time on a path.

        Raises:
            InfeasibleDuration: A segment's duration is shorter than its limits allow.
            LimitsUnsatisfiable: No duration keeps the limits.
        """
        ...


class Searching(BackEnd, Protocol):
    """A back end that begins with a motion within all limits, where it finds one at once, and searches for a better."""

    def without_search(self) -> BackEnd:
        """Return the back end without its search: it plans the first motion of the search."""
        ...

    def held_nearer(self, share: float) -> BackEnd:
        """Return the back end with its deviation from the first motion limited to this share."""
        ...


def searches(backend: BackEnd) -> TypeGuard[Searching]:
    """Tell whether a back end searches for a better motion than the one that it begins with."""
    return backend.capabilities.searches


def without_search(backend: BackEnd) -> BackEnd:
    """Return a back end without its search; a back end that does not search stays as it is."""
    return backend.without_search() if searches(backend) else backend


def enforced(backend: BackEnd) -> frozenset[str]:
    """Return the quantities whose limits the back end keeps."""
    return frozenset(quantity for quantity in QUANTITIES if backend.guarantees[quantity] is Guarantee.HARD)

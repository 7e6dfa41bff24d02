"""The protocol of a back end, which puts time on a joint path and says what it guarantees."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol, TypeGuard

from planner.guarantees import QUANTITIES, Capabilities, Guarantee

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.paths import JointPath
    from planner.trajectories.trajectory import Trajectory


class BackEnd(Protocol):
    """A back end puts time on a joint path: it is a frozen dataclass whose fields are its options.

    Each field carries `metadata` with a `description` and, where they apply, the bounds `gt`, `ge`, `le`.

    Attributes:
        kind: Its name.
        summary: What it does, in one sentence.
        guarantees: What it promises about each of `QUANTITIES`.
        capabilities: What it can do besides motions from rest to rest; an option may change it.
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
        """Return the back end that returns the motion to begin with: what it plans, the searching one plans, too."""
        ...

    def held_nearer(self, share: float) -> BackEnd:
        """Return the back end that may go only that share of the way as far from the motion to begin with."""
        ...


def searches(backend: BackEnd) -> TypeGuard[Searching]:
    """Tell whether a back end searches for a better motion than the one that it begins with."""
    return backend.capabilities.searches


def without_search(backend: BackEnd) -> BackEnd:
    """Return the back end that returns the motion with which a search begins; one that does not search as it is."""
    return backend.without_search() if searches(backend) else backend


def enforced(backend: BackEnd) -> frozenset[str]:
    """Return the quantities whose limits the back end keeps."""
    return frozenset(quantity for quantity in QUANTITIES if backend.guarantees[quantity] is Guarantee.HARD)

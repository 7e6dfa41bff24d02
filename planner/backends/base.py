"""The protocol of a back end, which puts time on a joint path and says what it guarantees."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol, runtime_checkable

from planner.guarantees import QUANTITIES, Guarantee

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
    """

    kind: ClassVar[str]
    summary: ClassVar[str]
    guarantees: ClassVar[Mapping[str, Guarantee]]

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put time on a path.

        Raises:
            InfeasibleDuration: A segment's duration is shorter than its limits allow.
            LimitsUnsatisfiable: No duration keeps the limits.
        """
        ...


@runtime_checkable
class Searching(BackEnd, Protocol):
    """A back end that begins with a motion within all limits, where it finds one at once, and searches for a better."""

    def without_search(self) -> BackEnd:
        """Return the back end that returns the motion to begin with: what it plans, the searching one plans, too."""
        ...

    def held_nearer(self, share: float) -> BackEnd:
        """Return the back end that may go only that share of the way as far from the motion to begin with."""
        ...


def shaped_by_duration(backend: BackEnd) -> bool:
    """Tell whether the back end makes another motion where more time is asked, and not the same one slower."""
    return bool(getattr(backend, "is_shaped_by_duration", False))


def enforced(backend: BackEnd) -> frozenset[str]:
    """Return the quantities whose limits the back end keeps."""
    return frozenset(quantity for quantity in QUANTITIES if backend.guarantees[quantity] is Guarantee.HARD)

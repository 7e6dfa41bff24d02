"""What a back end is: something that puts time on a joint path, and says what it guarantees."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

from planner.guarantees import QUANTITIES, Guarantee

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.paths import JointPath
    from planner.trajectory import Trajectory


class BackEnd(Protocol):
    """Puts time on a joint path. Implementations are frozen dataclasses whose fields are the options.

    Each field carries `metadata` with a `description` and, where they apply, the bounds `gt`, `ge`, `le`.

    Attributes:
        kind: Its name in requests.
        summary: One sentence for a person.
        guarantees: For each of `QUANTITIES`.
    """

    kind: ClassVar[str]
    summary: ClassVar[str]
    guarantees: ClassVar[Mapping[str, Guarantee]]

    def parametrize(self, path: JointPath) -> Trajectory:
        """The trajectory along `path`.

        Raises:
            InfeasibleDuration: A segment's duration is shorter than its limits allow.
            LimitsUnsatisfiable: No duration keeps the limits.
        """
        ...


def enforced(backend: BackEnd) -> frozenset[str]:
    """The quantities whose limits the back end keeps."""
    return frozenset(quantity for quantity in QUANTITIES if backend.guarantees[quantity] is Guarantee.HARD)

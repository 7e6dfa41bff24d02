"""What is asked of motions around what is in the way."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from planner.problems.problem import JointMotion, JointWaypoint

if TYPE_CHECKING:
    from planner.problems.problem import AnyWaypoint

MOST_CHECKS = 20_000
"""The most motions that the search for a way around looks at, unless told otherwise: 5 to 20 s, and twenty times what
cells with shelves and boxes take. A number of motions and no time, so that equal requests have equal answers."""

Objective = Literal["duration", "effort", "path_length"]
"""What a way around is made better by, all of the whole trajectory.

`duration`: s. `effort`: the integral over time of the sum over joints of (torque / limit)^2, s; of (acceleration /
limit)^2 where torques or their limits are unknown. `path_length`: the length of its path in the space of the joints,
rad; a metre counts as a radian."""

OPTIMISE_CHECKS = 5_000
"""The most motions that are looked at to make a way better, unless told otherwise: 1 to 5 s."""


@dataclass(frozen=True)
class FreeMotion(JointMotion):
    """A motion of the joints around what is in the way: straight if that is free, and else by a way that is found.

    To a pose any of its configurations will do that has room, unless a motion of the tool follows it.

    Attributes:
        most_checks: The most motions that the search looks at.
        optimise: What the way is made better by once one is found and certified; None: one change is
            tried, and taken where the trajectory is quicker with it.
        time_budget: How long that may take, s, the search for the first way included; the best until then is the
            answer, so that equal requests may have unequal ones. None: as long as the motions last that are looked at.
        optimise_checks: The most motions that are looked at for it, each trajectory that is made counting as
            `planner.planning.better_ways.CHECKS_OF_A_PLAN`; None: `OPTIMISE_CHECKS`, and any number within a
            `time_budget`.
    """

    most_checks: int = MOST_CHECKS
    optimise: Objective | None = None
    time_budget: float | None = None
    optimise_checks: int | None = None


@dataclass(frozen=True)
class FixedWaypoint(JointWaypoint):
    """A requested waypoint at the joint position that was found for it, where a way begins or ends.

    Attributes:
        requested: The waypoint as the request has it.
    """

    requested: AnyWaypoint = field(kw_only=True)


def as_requested(waypoint: AnyWaypoint) -> AnyWaypoint:
    """Return a waypoint as the request has it, whatever was fixed since."""
    return waypoint.requested if isinstance(waypoint, FixedWaypoint) else waypoint

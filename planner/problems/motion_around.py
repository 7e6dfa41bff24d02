"""Free motions: joint motions around obstacles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from planner.constraints.pose_constraints import PoseConstraint
from planner.problems.problem import AnyWaypoint, JointMotion, JointWaypoint

MOST_CHECKS = 20_000
"""The largest number of motions that the search for a collision-free path checks by default.

20,000 checks take 5 to 20 s, twenty times as many as cells with shelves and boxes need. A number of motions instead of
a time gives equal requests equal answers.
"""

Objective = Literal["duration", "effort", "path_length"]
"""The objectives by which a free motion improves the whole trajectory.

`duration`: s. `effort`: the integral over time of the sum over joints of (torque / limit)^2, s; of (acceleration /
limit)^2 where torques or their limits are unknown. `path_length`: the length of its path in joint space, rad; a metre
counts as a radian.
"""

OPTIMISE_CHECKS = 5_000
"""The largest number of motions that improving a path checks by default: 1 to 5 s."""


@dataclass(frozen=True)
class KeptMotion(JointMotion):
    """A joint motion that keeps constraints on the tool at all times.

    Attributes:
        keep: The constraints, checked by the certificate.
    """

    keep: tuple[PoseConstraint, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class FreeMotion(KeptMotion):
    """A joint motion around obstacles: straight if that is collision-free, otherwise a detour.

    Where it would meet a moving object, it goes around the space that the object takes up meanwhile, or begins later.

    A goal pose may be reached in any collision-free configuration, unless a tool motion follows. The whole motion keeps
    the constraints `keep`, and so must its start and its end.

    Attributes:
        most_checks: The largest number of motions that the search checks.
        optimise: The objective for improving the first certified path; None: the planner tries one change, and keeps it
            if the trajectory gets faster.
        time_budget: Longest time of the optimisation, s, the search for the first path included. The best path so far
            is the answer, so equal requests may have different answers. None: no limit of time.
        optimise_checks: The largest number of motions that the optimisation checks. Each trajectory computed counts as
            `planner.planning.candidate_detours.CHECKS_OF_A_PLAN`. None: `OPTIMISE_CHECKS`, or any number with a
            `time_budget`.
    """

    most_checks: int = MOST_CHECKS
    optimise: Objective | None = None
    time_budget: float | None = None
    optimise_checks: int | None = None


@dataclass(frozen=True)
class FixedWaypoint(JointWaypoint):
    """A requested waypoint at its solved joint position, where a detour begins or ends.

    Attributes:
        requested: The waypoint as the request has it.
    """

    requested: AnyWaypoint = field(kw_only=True)


def as_requested(waypoint: AnyWaypoint) -> AnyWaypoint:
    """Return a waypoint as requested, without later changes."""
    return waypoint.requested if isinstance(waypoint, FixedWaypoint) else waypoint

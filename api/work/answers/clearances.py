"""How near a motion comes to itself and to a scene, in the form of answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.certificate import certify_clearance, certify_speed_zones
from planner.errors import ClearanceUnproved, Collision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.certificate import ClearanceReport
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.speed_zones import SpeedZone
    from planner.trajectories.trajectory import Trajectory


def proved_clearance(
    checker: CollisionChecker, motion: Trajectory, tolerance: float
) -> tuple[ClearanceReport | None, dict[str, Any] | None]:
    """Prove that a motion is free.

    Returns:
        The clearance within a tolerance, m; None: nothing is checked, or the motion is not free. The `collision` of an
        answer; None: the motion is free.
    """
    try:
        return certify_clearance(checker, motion, tolerance), None
    except (Collision, ClearanceUnproved) as refusal:
        depth, point = (refusal.depth, refusal.point) if isinstance(refusal, Collision) else (None, None)
        found = {"code": refusal.code, "pair": refusal.pair, "time": refusal.time, "depth": depth, "point": point}
        return None, found | {"detail": refusal.message}


def clearance_answer(checker: CollisionChecker, motion: Trajectory, tolerance: float) -> dict[str, Any]:
    """Prove that a motion is free: `free`, the `clearance` within a tolerance, m, or the `collision`."""
    report, collision = proved_clearance(checker, motion, tolerance)
    clearance = None if report is None else report.as_dict()
    return {"free": collision is None, "clearance": clearance, "collision": collision}


def speed_zones_answer(
    zones: Sequence[SpeedZone], checker: CollisionChecker, robot: Robot, motion: Trajectory
) -> list[dict[str, Any]]:
    """Bound the speed of a robot, with its tool and attached objects, in each of its speed zones."""
    return [check.as_dict() for check in certify_speed_zones(zones, [checker], [robot], motion)]

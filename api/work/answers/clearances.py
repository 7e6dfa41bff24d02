"""How near a motion comes to itself and to a scene, in the form of answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.certificate import certify_clearance, certify_speed_zones
from planner.errors import ClearanceUnproved, Collision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.speed_zones import SpeedZone
    from planner.trajectories.trajectory import Trajectory


def clearance_answer(checker: CollisionChecker, motion: Trajectory, tolerance: float) -> dict[str, Any]:
    """Prove that a motion is free: `free`, the `clearance` within a tolerance, m, or the `collision`."""
    try:
        report = certify_clearance(checker, motion, tolerance)
    except (Collision, ClearanceUnproved) as refusal:
        depth, point = (refusal.depth, refusal.point) if isinstance(refusal, Collision) else (None, None)
        found = {"code": refusal.code, "pair": refusal.pair, "time": refusal.time, "depth": depth, "point": point}
        found["detail"] = refusal.message
        return {"free": False, "clearance": None, "collision": found}
    return {"free": True, "clearance": None if report is None else report.as_dict(), "collision": None}


def speed_zones_answer(
    zones: Sequence[SpeedZone], checker: CollisionChecker, robot: Robot, motion: Trajectory
) -> list[dict[str, Any]]:
    """Bound the speed of a robot, with its tool and attached objects, in each of its speed zones."""
    return [check.as_dict() for check in certify_speed_zones(zones, [checker], [robot], motion)]

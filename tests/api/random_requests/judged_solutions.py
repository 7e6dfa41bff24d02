"""The judge of solutions in a scene: free ones come first and are free, and reported obstacles collide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tests.api.random_requests.judged_scenes import at_rest, collides, is_free

if TYPE_CHECKING:
    from planner.robots import Robot


def solutions_hold(robot: Robot, request: dict[str, Any], answer: dict[str, Any]) -> None:
    """Check reported inverse kinematics solutions against distances by closed forms."""
    assert len(answer["results"]) == len(request["poses"])
    for result in answer["results"]:
        found = result["solutions"]
        for one in [*found, *([result["nearest"]] if "nearest" in result else [])]:
            assert ("collision" in one) == _is_held(request)
            if "collision" in one:
                _joint_position_is_right(robot, request, one["position"], one["collision"])
        free = [one.get("collision") is None for one in found]
        assert free == sorted(free, reverse=True)


def reachability_holds(robot: Robot, request: dict[str, Any], answer: dict[str, Any]) -> None:
    """Check statements on waypoints for consistency, and on joint positions against closed-form distances."""
    assert ("free" in answer) == _is_held(request)
    if "free" not in answer:
        return
    assert answer["free"] == all(found["free"] for found in answer["waypoints"])
    for asked, found in zip(request["waypoints"], answer["waypoints"], strict=True):
        reached = found["status"] == "reachable"
        assert bool(found["hindered_by"]) == (reached and not found["free"])
        assert (found["free_solutions"] is None) == (found["solutions"] is None)
        if found["solutions"] is not None:
            assert 0 <= found["free_solutions"] <= found["solutions"]
            assert (found["free_solutions"] > 0) == found["free"]
        depths = [collision["depth"] for collision in found["hindered_by"]]
        assert depths == sorted(depths) and all(depth > 0.0 for depth in depths)
        if asked["kind"] == "joint" and reached:
            (collision,) = found["hindered_by"] or [None]
            _joint_position_is_right(robot, request, asked["position"], collision)


def _is_held(request: dict[str, Any]) -> bool:
    return "scene" in request or bool(request.get("self_collision"))


def _joint_position_is_right(robot: Robot, request: dict[str, Any], position: list[float], collision: Any) -> None:
    if collision is None:
        is_free(robot, request, {"polynomials": at_rest(robot, position)}, None)
    else:
        collides(robot, request, collision | {"code": "collision", "detail": "of a joint position"}, np.array(position))

"""The judge of refusals: they name the fault and its place in words, and their remedies work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.base.json_pointers import changed

if TYPE_CHECKING:
    from planner.robots import Robot

CODES = {
    "invalid_request",
    "unreachable_waypoint",
    "joint_position_limit",
    "configuration_change",
    "singular_path",
    "missing_dynamics",
    "payload_exceeded",
    "infeasible_duration",
    "limits_unsatisfiable",
    "clearance_unproved",
    "collision",
    "start_in_collision",
    "no_path_found",
}
"""Codes of refusals that requests of these kinds may get."""


def is_precise(robot: Robot, request: dict[str, Any], problem: dict[str, Any]) -> None:
    """Fail where a refusal does not name the fault and its place."""
    assert problem["code"] in CODES
    assert problem["detail"]
    assert problem["title"]
    if problem["code"] == "invalid_request":
        assert problem["errors"]
        for fault in problem["errors"]:
            assert fault["message"]
            if fault["pointer"]:
                changed(request, fault["pointer"], None)
    count = len(request.get("waypoints", []))
    if count:
        assert problem.get("waypoint") is None or 0 <= problem["waypoint"] < count
        assert problem.get("segment") is None or 0 <= problem["segment"] < count - 1
    assert problem.get("joint") is None or problem["joint"] in robot.joint_names
    assert problem.get("time") is None or problem["time"] >= 0.0
    if problem["code"] in ("collision", "start_in_collision"):
        assert problem["depth"] > 0.0
        assert len(problem["pair"]) == 2
    for remedy in [*(problem.get("remedies") or []), *(problem.get("hints") or [])]:
        assert remedy["explanation"]
        changed(request, remedy["change"], remedy["value"])


def with_remedies(request: dict[str, Any], remedies: list[dict[str, Any]], chosen: int) -> dict[str, Any]:
    """Return the request with one remedy and its companions: all remedies of durations, limits or payloads."""

    def group(remedy: dict[str, Any]) -> str | None:
        return next((name for name in ("/duration", "/limits", "/payload") if name in remedy["change"]), None)

    for remedy in remedies:
        if remedy is remedies[chosen] or group(remedy) == group(remedies[chosen]) is not None:
            request = changed(request, remedy["change"], remedy["value"])
    return request

"""Waypoints of path files, as in a request."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import (
    BlendTransition,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PolylineMotion,
    PoseWaypoint,
    ThroughTransition,
    quaternion,
)

if TYPE_CHECKING:
    from planner import Motion, Pose, Transition


def to_request_waypoint(waypoint: PoseWaypoint | JointWaypoint, frame: str | None) -> dict[str, Any]:
    """Return a waypoint as in a request, in a frame of the request; None: the base frame."""
    written: dict[str, Any] = {"transition": _transition(waypoint.transition)}
    if isinstance(waypoint, JointWaypoint):
        return {"kind": "joint", "position": waypoint.position} | written
    if waypoint.limits is not None:
        written["limits"] = {"tcp_linear_velocity": waypoint.limits.tcp_linear_velocity}
    if frame is not None:
        written["frame"] = frame
    return {"kind": "pose", "pose": _pose(waypoint.pose), "motion": _motion(waypoint.motion)} | written


def _motion(motion: Motion) -> dict[str, Any]:
    match motion:
        case LinearMotion():
            return {"kind": "linear"}
        case CircularMotion(via=via):
            return {"kind": "circular", "via": _pose(via)}
        case PolylineMotion(poses=poses, blend=blend):
            return {"kind": "polyline", "poses": list(map(_pose, poses)), "blend": blend}
    return {"kind": "joint"}


def _transition(transition: Transition) -> dict[str, Any]:
    match transition:
        case BlendTransition(radius=radius):
            return {"kind": "blend", "radius": radius}
        case ThroughTransition():
            return {"kind": "through"}
    return {"kind": "stop"}


def _pose(pose: Pose) -> dict[str, Any]:
    written: dict[str, Any] = {"position": pose.position.tolist()}
    if pose.rotation is not None:
        written["orientation"] = {"kind": "quaternion", "xyzw": quaternion(pose.rotation).tolist()}
    return written

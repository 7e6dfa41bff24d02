"""Paths in files as requests: the work of `planner import`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import orjson
import typer

from cli.work.local_plan import read_request
from cli.work.shared import refusals, robot_named, write
from cli.work.terminal import terminal
from planner import (
    BlendTransition,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PolylineMotion,
    PoseWaypoint,
    ThroughTransition,
    quaternion,
    read_path,
)

if TYPE_CHECKING:
    from pathlib import Path

    from planner import Motion, Pose, Transition

DOWN = "down"
"""The word for a tool axis that points down."""


@dataclass(frozen=True)
class ImportOptions:
    """Options of `planner import`, as written.

    Attributes:
        units: Unit of lengths; None: the file's.
        angle: Unit of angles.
        frame: Name of the file's frame.
        position: Position of that frame in the world, m.
        rpy: Roll, pitch and yaw of that frame, rad.
        tool_axis: `down`, or three numbers with commas.
        blend: Distance from a corner at which the tool leaves its path, m; None: stops.
        lift: Distance of moves between shapes, m.
        speed: Limit on the speed of the tool, m/s; None: none.
    """

    units: str | None
    angle: str
    frame: str
    position: tuple[float, float, float]
    rpy: tuple[float, float, float]
    tool_axis: str
    blend: float | None
    lift: float
    speed: float | None


def import_path(file: Path, output: Path, robot: str, options: ImportOptions) -> None:
    """Write the path in a file as a request; see `planner import`."""
    console = terminal()
    given: dict[str, Any] = {"units": options.units, "angle": options.angle}
    if options.tool_axis != DOWN:
        given["tool_axis"] = _axis(options.tool_axis)
    with refusals():
        named = robot_named(robot)
        read = read_path(file, robot=named.load(), blend=options.blend, lift=options.lift, **given)
        waypoints = [_waypoint(waypoint, options.frame) for waypoint in read.waypoints]
        request: dict[str, Any] = {"robot": named.id, "waypoints": waypoints, "backend": {"kind": "toppra"}}
        if any(waypoint["kind"] == "pose" for waypoint in waypoints):
            orientation = {"kind": "rpy", "rpy": options.rpy}
            request["frames"] = {options.frame: {"position": options.position, "orientation": orientation}}
        if options.speed is not None:
            request["limits"] = {"tcp_linear_velocity": options.speed}
        text = orjson.dumps(request, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
        read_request(text)
    for note in read.notes:
        console.print(f"note: {note}", markup=False, highlight=False)
    console.print(f"{len(waypoints)} waypoints")
    write(output, text, console)


def _axis(text: str) -> tuple[float, ...]:
    """Parse the numbers of a tool axis."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"must be down or three numbers X,Y,Z; got {text}", param_hint="--tool-axis") from None


def _waypoint(waypoint: PoseWaypoint | JointWaypoint, frame: str) -> dict[str, Any]:
    """Return a waypoint as in a request."""
    written: dict[str, Any] = {"transition": _transition(waypoint.transition)}
    if isinstance(waypoint, JointWaypoint):
        return {"kind": "joint", "position": waypoint.position} | written
    if waypoint.limits is not None:
        written["limits"] = {"tcp_linear_velocity": waypoint.limits.tcp_linear_velocity}
    return {"kind": "pose", "frame": frame, "pose": _pose(waypoint.pose), "motion": _motion(waypoint.motion)} | written


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

"""Paths in files as requests: the work of `planner import`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import orjson
import typer

from api.work.conversion.path_files import to_request_waypoint
from cli.work.local_plan import read_request
from cli.work.shared import refusals, robot_named, write
from cli.work.terminal import terminal
from planner import read_path

if TYPE_CHECKING:
    from pathlib import Path

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
        waypoints = [to_request_waypoint(waypoint, options.frame) for waypoint in read.waypoints]
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

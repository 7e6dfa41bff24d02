"""Bodies and answers of path files."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from api.contract.parts.common import Answer, FrameName, NamedRobot, Schema, Vector3


class PathFileRequest(Schema):
    """A path in a CSV, G-code or DXF file."""

    robot: NamedRobot
    name: Annotated[str, Field(max_length=200, pattern=r"\.(csv|nc|ngc|gcode|gc|tap|cnc|dxf)$")]
    """The name of the file. Its suffix says the format: `.csv`; `.nc`, `.ngc`, `.gcode`, `.gc`, `.tap` and `.cnc` for
    G-code; `.dxf` for a drawing. In lower case."""
    text: Annotated[str, Field(max_length=16 * 2**20)]
    """The content of the file."""
    units: Literal["mm", "m", "inch"] | None = None
    """The unit of lengths. In G-code it holds until a G20 or G21; it replaces the unit of a drawing. Null or omitted:
    the unit that the file names, otherwise mm, and m in a CSV file."""
    angle: Literal["rad", "deg"] = "rad"
    """The unit of angles in a CSV file."""
    frame: FrameName | None = None
    """The name of the frame of the waypoints, one of the plan request's `frames`; null or omitted: the base frame."""
    tool_axis: Vector3 = Field(default=[0.0, 0.0, -1.0])
    """The direction of the tool's z axis in that frame where the file has no orientations, without unit; its length
    does not count. Omitted: down."""
    blend: Annotated[float, Field(gt=0.0, le=10.0)] | None = None
    """The distance from a corner at which the tool leaves its path, m; null or omitted: it stops at corners."""
    lift: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    """The distance of moves between the shapes of a drawing, m, against the tool axis."""


class PathFileAnswer(Answer):
    """The path as waypoints."""

    waypoints: list[dict[str, Any]]
    """The waypoints for a body of POST /v1/trajectories. Feeds are limits on the speed of the tool."""
    notes: list[str]
    """Remarks on omissions and assumptions, for a person."""

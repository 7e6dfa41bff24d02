"""The command line of path files: `planner import`."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer evaluates the annotations
from typing import Annotated

import typer


def import_(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="CSV, G-code (.nc, .ngc, .gcode, ...) or DXF file.", exists=True, dir_okay=False
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Write the request here, for planner plan.")
    ],
    robot: Annotated[str, typer.Option("--robot", metavar="ROBOT", help="Robot of the catalogue, or a robot file.")],
    units: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="Unit of lengths: mm, m or inch.", show_default="the file's; m for CSV"),
    ] = None,
    angle: Annotated[str, typer.Option(metavar="UNIT", help="Unit of angles in CSV: rad or deg.")] = "rad",
    frame: Annotated[str, typer.Option(metavar="NAME", help="Name of the file's frame in the request.")] = "path",
    position: Annotated[
        tuple[float, float, float],
        typer.Option(metavar="X Y Z", help="Position of that frame in the world, m."),
    ] = (0.0, 0.0, 0.0),
    rpy: Annotated[
        tuple[float, float, float],
        typer.Option(metavar="R P Y", help="Its orientation: roll, pitch and yaw, rad."),
    ] = (0.0, 0.0, 0.0),
    tool_axis: Annotated[
        str,
        typer.Option(
            "--tool-axis", metavar="AXIS", help="Direction of the tool's z axis in that frame: down or X,Y,Z."
        ),
    ] = "down",
    blend: Annotated[
        float | None,
        typer.Option(metavar="M", help="Distance from corners at which the tool leaves its path.", show_default="stop"),
    ] = None,
    lift: Annotated[
        float, typer.Option(metavar="M", help="Distance of moves between shapes of a drawing, against the tool axis.")
    ] = 0.0,
    speed: Annotated[
        float | None,
        typer.Option(metavar="M/S", help="Limit on the speed of the tool on the whole path.", show_default="none"),
    ] = None,
) -> None:
    """Write the path in a file as a request of POST /v1/trajectories."""
    from cli.work.path_files import ImportOptions, import_path

    options = ImportOptions(units, angle, frame, position, rpy, tool_axis, blend, lift, speed)
    import_path(file, output, robot, options)

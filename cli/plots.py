"""The command line of pictures: `planner plot`."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer evaluates the annotations
from typing import Annotated

import typer


def plot(
    drawn: Annotated[
        str,
        typer.Argument(
            metavar="REQUEST|ROBOT",
            help="JSON file with a request of POST /v1/trajectories (- reads stdin), a robot of the catalogue, or a "
            "URDF file.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="The .svg or .png file to write.")],
    show: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="What is drawn of a plan, several times if you like: position, velocity, acceleration, jerk, torque, "
            "tcp_position, tcp_orientation, tcp_velocity, tcp_speed, ..., path, robot; of a robot: robot, workspace.",
            show_default="the request's picture, or position, velocity and acceleration; robot",
        ),
    ] = None,
    joint: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Joint whose graphs are drawn.", show_default="all")
    ] = None,
    axis: Annotated[
        list[str] | None, typer.Option(metavar="x|y|z", help="Axis along which the tool is drawn.", show_default="all")
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Where space is looked at from: isometric, xy, xz or yz.", show_default="isometric"
        ),
    ] = None,
    title: Annotated[str | None, typer.Option(metavar="TEXT", help="The title.", show_default="the robot's id")] = None,
) -> None:
    """Draw the plan of a request, or a robot, into a picture."""
    from cli.work.pictures import draw_file

    draw_file(drawn, output, show, joint, axis, view, title)

"""The command line of pictures: `planner plot` and `planner view`."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer evaluates the annotations
from typing import Annotated

import typer

from cli.options import BackEndOption, RobotOption, SrdfOption, TipOption  # noqa: TC001 - typer evaluates the annotations


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


def view(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="JSON file with a request of POST /v1/trajectories (- reads stdin), or a plan that `plan.save` wrote.",
        ),
    ],
    port: Annotated[int, typer.Option(metavar="NUMBER", help="Port, or the next free one.", min=1, max=65535)] = 8080,
    backend: BackEndOption = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Show a plan in a browser on this machine: the robot moves in its scene (extra view)."""
    from cli.work.pictures import view_file
    from cli.work.robots.files import FileOptions

    view_file(file, port, backend, robot, FileOptions(srdf, tip))

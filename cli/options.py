"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def robot_ids(incomplete: str) -> list[str]:
    """List the robots of the catalogue that a word may become."""
    from planner.robots import catalogue_ids

    return [robot_id for robot_id in catalogue_ids() if robot_id.startswith(incomplete)]


def back_end_kinds(incomplete: str) -> list[str]:
    """List the back ends that a word may become."""
    from planner.backends import BACKENDS

    return [kind for kind in BACKENDS if kind.startswith(incomplete)]


def format_names(incomplete: str) -> list[str]:
    """List the formats of trajectories that a word may become."""
    from api.work.answers.formats import FORMATS

    return [name for name in FORMATS if name.startswith(incomplete)]


RequestArgument = Annotated[
    str, typer.Argument(metavar="REQUEST", help="File with a request of POST /v1/trajectories; - reads stdin.")
]
BackEndOption = Annotated[
    str | None,
    typer.Option(
        "--backend",
        metavar="KIND",
        help="Back end in place of the request's, with its default options.",
        autocompletion=back_end_kinds,
    ),
]
FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help="Format of the trajectory.",
        show_default="by the suffix, else json",
        autocompletion=format_names,
    ),
]
RobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="ROBOT",
        help="Robot in place of the request's: one of the catalogue, a URDF, xacro or MJCF file, or a JSON file for "
        "POST /v1/robots.",
        autocompletion=robot_ids,
    ),
]
SrdfOption = Annotated[
    Path | None,
    typer.Option("--srdf", metavar="FILE", help="SRDF file that goes with a URDF file.", exists=True, dir_okay=False),
]
TipOption = Annotated[
    str | None,
    typer.Option("--tip", metavar="LINK", help="Link of a URDF file that poses are about.", show_default="its end"),
]

"""Robots on the terminal: the work of `planner robots`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cli.work.robots.files import FileOptions, robot_request
from cli.work.shared import refusals, robot_named, write
from cli.work.terminal import robot_summary, robots_table, terminal
from planner.robots import catalogue_ids, load_robot

if TYPE_CHECKING:
    from collections.abc import Sequence


def show_robots(robot: str | None, options: FileOptions, output: Path | None) -> None:
    """List the robots of the catalogue, or show one and write it as a request; see `planner robots`."""
    console = terminal()
    with refusals():
        if robot is None:
            console.print(robots_table([load_robot(robot_id) for robot_id in catalogue_ids()]))
            return
        console.print(robot_summary(robot_named(robot, options).load()))
        if output is None:
            return
        path = Path(robot)
        if not path.is_file() or path.suffix == ".json":
            raise typer.BadParameter(f"must be a URDF, xacro or MJCF file; got {robot}", param_hint="ROBOT")
        write(output, robot_request(path, options).model_dump_json(exclude_unset=True, indent=2).encode(), console)


def xacro_arguments(words: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the names and values of arguments that are written NAME:=VALUE."""
    pairs = [word.partition(":=") for word in words]
    for word, (name, separator, _) in zip(words, pairs, strict=True):
        if not (name and separator):
            raise typer.BadParameter(f"must have the form NAME:=VALUE; got {word}", param_hint="--argument")
    return tuple((name, value) for name, _, value in pairs)

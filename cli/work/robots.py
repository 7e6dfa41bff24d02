"""Robots on the terminal: the work of `planner robots`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.work.shared import refusals, robot_named
from cli.work.terminal import robot_summary, robots_table, terminal
from planner.robots import catalogue_ids, load_robot

if TYPE_CHECKING:
    from pathlib import Path


def show_robots(robot: str | None, srdf: Path | None, tip: str | None) -> None:
    """List the robots of the catalogue, or show one; see `planner robots`."""
    with refusals():
        shown = (
            robots_table([load_robot(robot_id) for robot_id in catalogue_ids()])
            if robot is None
            else robot_summary(robot_named(robot, srdf, tip).load())
        )
    terminal().print(shown)

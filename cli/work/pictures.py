"""Pictures of the command line: of the plan of a request, of a robot, or of the points that it reaches."""

from __future__ import annotations

from contextlib import suppress
from html import escape
from io import StringIO
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from cli.work.local_plan import plan_request, read_request
from cli.work.saved_plans import SAVED_PLAN, read_saved_plan
from cli.work.shared import read, refusals, robot_named, write
from cli.work.terminal import FILE_WIDTH, plan_summary, terminal
from planner.kinematics import workspace
from planner.plots.picture import draw_plan, draw_robot_at, draw_workspace

if TYPE_CHECKING:
    from pathlib import Path

    from api.contract.requests import PlanRequest
    from cli.work.robots.files import FileOptions
    from planner.plans.result import Plan
    from planner.plots.picture import Picture
    from planner.robots import Robot

SUFFIXES = (".png", ".svg", ".html")
"""The suffixes of the files that `planner plan --plot` can draw into."""

WORKSPACE = "workspace"
"""The value of `--show` that draws the workspace of a robot."""

WORKSPACE_POINTS = 20_000
"""The number of points of a drawn workspace: as many as a picture can tell apart."""

PAGE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>body {{ margin: 2rem auto; max-width: 82rem; font-family: sans-serif }} svg {{ width: 100%; height: auto }}
pre {{ font-size: 0.8rem; line-height: 1.3 }}</style>
{picture}
{tables}
</html>
"""
"""The page; it asks for no other file."""


def draw_file(
    drawn: str,
    output: Path,
    show: list[str] | None,
    joint: list[str] | None,
    axis: list[str] | None,
    view: str | None,
    title: str | None,
) -> None:
    """Draw the plan of a request, or a robot, into a file; see `planner plot`."""
    if output.suffix not in (".svg", ".png"):
        raise typer.BadParameter("must end with .svg or .png", param_hint="--output")
    is_request = drawn == "-" or drawn.endswith(".json")
    text = read(drawn) if is_request else b""
    with refusals():
        try:
            if is_request:
                asked = read_request(text)
                own = {} if asked.picture is None else asked.picture.model_dump(exclude_none=True)
                given = {"show": show, "joints": joint, "axes": axis, "view": view, "title": title}
                wanted = own | {name: value for name, value in given.items() if value is not None}
                picture = draw_plan(plan_request(asked), **wanted)
            else:
                picture = _picture_of_robot(robot_named(drawn).load(), show, view or "isometric", title)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
    write(output, picture.svg() if output.suffix == ".svg" else picture.png(), terminal())


def view_file(file: str, port: int, backend: str | None, robot: str | None, options: FileOptions) -> None:
    """Show the plan of a request, or a saved plan, in a browser until Ctrl-C; see `planner view`."""
    text = read(file, "FILE")
    with refusals():
        if text.startswith(SAVED_PLAN):
            plan = read_saved_plan(file)
        else:
            named = None if robot is None else robot_named(robot, options)
            asked = read_request(text, backend, None if named is None else named.id)
            plan = plan_request(asked, None if named is None else named.load())
    try:
        viewer = plan.view(port=port)
    except ModuleNotFoundError as error:
        raise typer.BadParameter(str(error)) from None
    with viewer, suppress(KeyboardInterrupt):
        terminal().print(f"{viewer.url} shows the plan. Ctrl-C ends it.")
        viewer.wait()


def _picture_of_robot(robot: Robot, show: list[str] | None, view: str, title: str | None) -> Picture:
    if (show or ["robot"]) == ["robot"]:
        return draw_robot_at(robot, view=view, title=title)
    if show != [WORKSPACE]:
        raise typer.BadParameter("must be robot or workspace for a robot", param_hint="--show")
    return draw_workspace(robot, workspace(robot, WORKSPACE_POINTS), view=view, title=title)


def draw(solved: Plan, request: PlanRequest, title: str, suffix: str, seconds: float) -> bytes:
    """Draw the joints' positions, velocities and accelerations with their limits, or the picture of the request.

    Args:
        solved: The plan.
        request: The request.
        title: The title of the picture, unless the request has one.
        suffix: One of `SUFFIXES`; a page has the tables of the command line, too.
        seconds: What planning took, s.

    Returns:
        The content of the file.
    """
    asked = {} if request.picture is None else request.picture.model_dump(exclude_none=True)
    picture = draw_plan(solved, **{"title": title} | asked)
    if suffix != ".html":
        return picture.png() if suffix == ".png" else picture.svg()
    record = Console(record=True, file=StringIO(), width=FILE_WIDTH, highlight=False)
    record.print(plan_summary(solved, seconds))
    tables = record.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
    svg = picture.svg().decode().partition("<svg")
    return PAGE.format(title=escape(title), picture=svg[1] + svg[2], tables=tables).encode()

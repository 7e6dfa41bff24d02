"""A plan as a picture, or as a page that holds the picture and the tables of the command line."""

from __future__ import annotations

from html import escape
from io import StringIO
from typing import TYPE_CHECKING

import orjson
from rich.console import Console

from api.cli.terminal import FILE_WIDTH, plan_summary
from api.pictures import picture
from planner.export import FORMATS, ExportOptions
from planner.robots import describe

if TYPE_CHECKING:
    from api.schemas.requests import PlanRequest
    from planner.result import Plan

SUFFIXES = (".png", ".svg", ".html")
"""The suffixes of the files that a plan can be drawn into."""

DRAWN_SAMPLES = 800
"""The number of samples that curves are drawn with."""

PAGE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>body {{ margin: 2rem auto; max-width: 82rem; font-family: sans-serif }} svg {{ width: 100%; height: auto }}
pre {{ font-size: 0.8rem; line-height: 1.3 }}</style>
{picture}
{tables}
</html>
"""
"""The page; it asks for no other file."""


def draw(solved: Plan, request: PlanRequest, title: str, suffix: str, seconds: float) -> bytes:
    """Draw the joints' positions, velocities and accelerations with their limits.

    Args:
        solved: The plan.
        request: What was asked.
        title: The title of the picture.
        suffix: One of `SUFFIXES`.
        seconds: What planning took, s.

    Returns:
        The content of the file.
    """
    period = max(solved.trajectory.duration / DRAWN_SAMPLES, 1e-6)
    answer = orjson.loads(FORMATS["json"].render(solved, ExportOptions(period, frozenset(), "")))
    form = "png" if suffix == ".png" else "svg"
    drawn = picture(title, request.model_dump(), answer, describe(solved.path.robot), form)
    if suffix != ".html":
        return drawn
    record = Console(record=True, file=StringIO(), width=FILE_WIDTH, highlight=False)
    record.print(plan_summary(solved, seconds))
    tables = record.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
    svg = drawn.decode().partition("<svg")
    return PAGE.format(title=escape(title), picture=svg[1] + svg[2], tables=tables).encode()

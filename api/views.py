"""Forms of a plan for people: a report that is one file, and pictures."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from api.errors import NotAcceptable
from api.version import service_version
from planner.errors import MissingDynamics
from planner.export import ExportOptions
from planner.robots import describe
from planner.robots.collision.describe import describe_drawn_links

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.plots.picture import Picture
    from planner.result import Plan

DRAWN_SAMPLES = 2000
"""The number of samples that a view is drawn with: more than a screen has columns."""

SHORTEST_PERIOD = 1e-6
"""The least time between two of them, s, for motions that take no time."""

PARTS = frozenset({"jerk", "tcp_pose", "tcp_velocity"})
"""The parts of an answer that a report shows besides positions, velocities and accelerations."""

REPORT = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; \
style-src 'unsafe-inline'; img-src data: blob:">
<title>Report of a plan</title>
<style>{style}</style>
</head>
<body>
<div id="app"></div>
<script type="application/json" id="plan">{plan}</script>
<script type="module">{program}</script>
</body>
</html>
"""
"""The report; it asks for no other file, and its policy forbids it."""


@dataclass(frozen=True)
class View:
    """One form of a plan for people.

    Attributes:
        name: The form's name.
        media_type: The media type of a file of this form.
        suffix: How the name of such a file ends, with the dot.
        draw: What makes the file of a plan, of the request as plain values, its hash, and a title.
    """

    name: str
    media_type: str
    suffix: str
    draw: Callable[[Plan, dict[str, Any], str | None, str], bytes]


def report(plan: Plan, request: dict[str, Any], request_hash: str | None, title: str) -> bytes:
    """Make a report: plots, limit bands, certificate, waypoints, playback, request and version in one file.

    The playback shows the links of the robot, the scene and what the robot carries.

    Raises:
        NotAcceptable: The program of reports was not built with this installation.
    """
    folder = files("api").joinpath("built_page", "report")
    if not folder.joinpath("report.js").is_file():
        raise NotAcceptable("reports need the page, which was not built when the package was installed")
    shown = {
        "title": title,
        "request": request,
        "answer": _answer(plan, request_hash),
        "robot": describe(plan.path.robot) | {"content": None},
        "links": _links(plan),
        "version": service_version(),
    }
    # An end tag within a text would end the element that holds it.
    text = orjson.dumps(shown, option=orjson.OPT_SERIALIZE_NUMPY).decode().replace("</", "<\\/")
    program = folder.joinpath("report.js").read_text("utf-8").replace("</script", "<\\/script")
    style = folder.joinpath("report.css").read_text("utf-8")
    return REPORT.format(style=style, plan=text, program=program).encode()


def _links(plan: Plan) -> list[dict[str, Any]]:
    """Return the shapes of links that can collide, where the robot is drawn by them or its clearance is shown."""
    robot = plan.path.robot
    if robot.geometry and plan.certificate.clearance is None:
        return []
    return describe_drawn_links(robot)


def svg(plan: Plan, request: dict[str, Any], request_hash: str | None, title: str) -> bytes:
    """Draw what the request's `picture` asks for as SVG."""
    return _picture(plan, request, title).svg()


def png(plan: Plan, request: dict[str, Any], request_hash: str | None, title: str) -> bytes:
    """Draw what the request's `picture` asks for as PNG."""
    return _picture(plan, request, title).png()


def _picture(plan: Plan, request: dict[str, Any], title: str) -> Picture:
    from planner.plots.picture import draw_plan

    return draw_plan(plan, **{"title": title} | (request.get("picture") or {}))


def _answer(plan: Plan, request_hash: str | None) -> dict[str, Any]:
    """Return the answer as plain values, its samples with the digits that a screen can show."""
    from planner.export.json import as_dict

    try:
        answer = as_dict(plan, ExportOptions(_period(plan), PARTS | {"torque"}, request_hash))
    except MissingDynamics:
        answer = as_dict(plan, ExportOptions(_period(plan), PARTS, request_hash))
    answer["samples"] = _shortened(answer["samples"])
    answer["warnings"] = list(map(vars, plan.warnings))  # without those about the samples of this very view
    return answer


def _shortened(rows: Any) -> Any:
    if isinstance(rows, dict):
        return {name: _shortened(values) for name, values in rows.items()}
    return rows.astype(np.float32) if isinstance(rows, np.ndarray) and rows.dtype == np.float64 else rows


def _period(plan: Plan) -> float:
    return max(plan.trajectory.duration / DRAWN_SAMPLES, SHORTEST_PERIOD)


VIEWS: dict[str, View] = {
    view.name: view
    for view in (
        View("html", "text/html", ".html", report),
        View("svg", "image/svg+xml", ".svg", svg),
        View("png", "image/png", ".png", png),
    )
}
"""Every view by its name."""

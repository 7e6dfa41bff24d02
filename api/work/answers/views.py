"""Forms for people: reports of plans and batches that are one file, and pictures of plans."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from api.base import content_policies as policies
from api.base.errors import NotAcceptable
from api.base.version import service_version
from api.work.answers.plans import AnswerOptions, as_dict
from api.work.answers.robots import describe, describe_drawn_links
from planner.errors import MissingDynamics

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.plans.result import Plan
    from planner.plots.picture import Picture

DRAWN_SAMPLES = 2000
"""The number of samples that a view is drawn with: more than a screen has columns."""

SHORTEST_PERIOD = 1e-6
"""The least time between two of them, s, for motions that take no time."""

PARTS = frozenset({"jerk", "tcp_pose", "tcp_velocity", "limits"})
"""The parts of an answer that a report shows besides positions, velocities and accelerations."""

REPORT = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>Report of a {kind}</title>
<style>{style}</style>
</head>
<body>
<div id="app"></div>
<script type="application/json" id="{kind}">{shown}</script>
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

    The playback shows the links of the robot, the scene and attached objects.

    Raises:
        NotAcceptable: The program of reports was not built with this installation.
    """
    shown = {
        "title": title,
        **shown_plan(plan, request, request_hash),
        **shown_robot(plan),
        "version": service_version(),
    }
    return written_report("plan", shown)


def written_report(kind: str, shown: dict[str, Any]) -> bytes:
    """Write a report: the shown values, and the program that shows them.

    Args:
        kind: Its subject, `plan` or `batch`.
        shown: The shown values, plain ones and numpy arrays.

    Raises:
        NotAcceptable: The program of reports was not built with this installation.
    """
    folder = files("api").joinpath("built_page", "report")
    if not folder.joinpath("report.js").is_file():
        raise NotAcceptable("Reports need the page, which was not built when the package was installed.")
    # A tag or a comment within a text would end the element that holds it, or keep it from ending.
    text = orjson.dumps(shown, option=orjson.OPT_SERIALIZE_NUMPY).decode().replace("<", "\\u003c")
    program = folder.joinpath("report.js").read_text("utf-8").replace("</script", "<\\/script")
    style = folder.joinpath("report.css").read_text("utf-8")
    return REPORT.format(kind=kind, policy=policies.REPORT, style=style, shown=text, program=program).encode()


def shown_plan(
    plan: Plan, request: dict[str, Any], request_hash: str | None, samples: int = DRAWN_SAMPLES
) -> dict[str, Any]:
    """Return the part of a report about a plan, with about so many samples, without its robot."""
    return {"request": request, "answer": _answer(plan, request_hash, samples)}


def shown_robot(plan: Plan) -> dict[str, Any]:
    """Return the part of a report about the robot of a plan.

    It has the shapes of links that can collide where the robot is drawn by them or its clearance is shown.
    """
    robot = plan.path.robot
    is_enough = robot.geometry and plan.certificate.clearance is None
    return {
        "robot": describe(robot) | {"content": None},
        "links": [] if is_enough else describe_drawn_links(robot),
    }


def svg(plan: Plan, request: dict[str, Any], request_hash: str | None, title: str) -> bytes:
    """Draw the request's `picture` as SVG."""
    return _picture(plan, request, title).svg()


def png(plan: Plan, request: dict[str, Any], request_hash: str | None, title: str) -> bytes:
    """Draw the request's `picture` as PNG."""
    return _picture(plan, request, title).png()


def _picture(plan: Plan, request: dict[str, Any], title: str) -> Picture:
    from planner.plots.picture import draw_plan

    return draw_plan(plan, **{"title": title} | (request.get("picture") or {}))


def _answer(plan: Plan, request_hash: str | None, samples: int) -> dict[str, Any]:
    """Return the answer as plain values, its samples with the digits that a screen can show."""
    period = max(plan.trajectory.duration / samples, SHORTEST_PERIOD)
    try:
        answer = as_dict(plan, AnswerOptions(period, PARTS | {"torque"}, request_hash=request_hash))
    except MissingDynamics:
        answer = as_dict(plan, AnswerOptions(period, PARTS, request_hash=request_hash))
    answer["samples"] = _shortened(answer["samples"])
    answer["warnings"] = list(map(vars, plan.warnings))  # without those about the samples of this very view
    return answer


def _shortened(rows: Any) -> Any:
    if isinstance(rows, dict):
        return {name: _shortened(values) for name, values in rows.items()}
    return rows.astype(np.float32) if isinstance(rows, np.ndarray) and rows.dtype == np.float64 else rows


VIEWS: dict[str, View] = {
    view.name: view
    for view in (
        View("html", "text/html", ".html", report),
        View("svg", "image/svg+xml", ".svg", svg),
        View("png", "image/png", ".png", png),
    )
}
"""Every view by its name."""

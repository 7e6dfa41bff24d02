"""A plan at a glance, as a piece of HTML that notebooks show: picture, waypoints, certificate, warnings."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from html import escape

from planner.certificate.checks import Check
from planner.plots.picture import draw_plan
from planner.plots.quantities import Planned, kept_limits, stops_of

GLANCE = ("position", "velocity")
"""The rows of the picture of a summary."""

BAR = (
    '<div style="width: 8em; background: #88888833"><div style="width: {percent:.1f}%; height: 0.7em; '
    'background: {colour}"></div></div>'
)
"""The bar for the used share of a limit."""

FREE = "#009E73"
"""The colour of a limit with room left."""

USED_UP = "#D55E00"
"""The colour of a limit that is used up to 1 %."""

USED_UP_PERCENT = 99.0
"""The share of a limit, in percent, from which it is shown as used up."""


def summary(plan: Planned) -> str:
    """Return a plan at a glance as HTML, which needs no other file."""
    robot, kept = plan.path.robot, kept_limits(plan)
    facts = f"{plan.backend.kind}, {plan.trajectory.duration:.4g} s, {kept}, {plan.certificate.continuity}"
    picture = b64encode(draw_plan(plan, GLANCE).svg()).decode()
    stops = ((escape(stop.name), f"{stop.arrival:.3f}", f"{stop.departure:.3f}") for stop in stops_of(plan))
    warnings = "".join(f"<li>{escape(warning.message)}</li>" for warning in plan.warnings)
    return (
        f"<div><p><strong>{escape(robot.id)}</strong>: {facts}</p>"
        f'<img alt="Joint positions and velocities" style="width: 100%" src="data:image/svg+xml;base64,{picture}">'
        + _table(("waypoint", "arrival (s)", "departure (s)"), stops)
        + _table(("limit", "joint", "used", "", "at (s)"), map(_row, plan.certificate.checks))
        + (f"<ul>{warnings}</ul>" if warnings else "")
        + "</div>"
    )


def _row(check: Check) -> tuple[str, ...]:
    name = check.quantity.replace("tcp_", "tool ").replace("_", " ") + ("" if check.enforced else " (reported)")
    if check.ratio is None or not check.bounded:
        return name, escape(check.joint or ""), "no limit" if check.bounded else "impulse", "", f"{check.time:.3f}"
    percent = 100.0 * check.ratio
    bar = BAR.format(percent=min(percent, 100.0), colour=FREE if percent < USED_UP_PERCENT else USED_UP)
    return name, escape(check.joint or ""), f"{percent:.1f} %", bar, f"{check.time:.3f}"


def _table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = "".join(f"<th>{name}</th>" for name in header)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

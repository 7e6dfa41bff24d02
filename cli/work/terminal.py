"""Plans, problem documents and robots as tables of the terminal."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
from rich import box
from rich.console import Console, Group
from rich.padding import Padding
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from planner.certificate import MEASURES
from planner.kinematics import configurations
from planner.robots import LIMITED_QUANTITIES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import RenderableType

    from planner.certificate.checks import Certificate, Check
    from planner.certificate.clearance import Clearance
    from planner.certificate.speed_zones import SpeedZoneCheck
    from planner.choices import Choice
    from planner.errors import Finding
    from planner.kinematics import FloatArray
    from planner.plans.optimisation import Optimisation
    from planner.plans.result import Plan
    from planner.plans.ride import RideReport
    from planner.robots import Joint, Robot
    from planner.trajectories.trajectory import PlanWarning

NUMBERS = ("peak", "of limit", "share", "at (s)")
"""The columns of the certificate's table that hold numbers."""

BAR_WIDTH = 12
"""The width of the bar of a share of a limit, characters."""

FILE_WIDTH = 100
"""The width of the lines that go into a file or a pipe, characters."""

CLOSE_TO_LIMIT = 0.9
"""The share of a limit above which it is shown in yellow."""


def terminal(*, stderr: bool = False) -> Console:
    """Make the terminal; a file or a pipe instead gets lines of a fixed width."""
    console = Console(stderr=stderr, highlight=False)
    if not console.is_terminal:
        console.width = FILE_WIDTH
    return console


def plain_table(*columns: str, right: Sequence[str] = (), title: str | None = None) -> Table:
    """Make a table without frame, its header underlined; the first column wraps, `right` ones are aligned right."""
    table = Table(
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
        title=title,
        title_justify="left",
        title_style="bold",
    )
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if column in right else "left", no_wrap=i > 0, overflow="fold")
    return table


def share_text(ratio: float | None) -> Text:
    """Write a share of a limit in percent, green, yellow near the limit, red above it."""
    if ratio is None:
        return Text("-", style="dim")
    return Text(f"{100.0 * ratio:.1f} %", style=_share_style(ratio))


def plan_summary(plan: Plan, seconds: float) -> Group:
    """Show a plan as a person reads it; `seconds` is the time that planning took."""
    robot, trajectory = plan.path.robot, plan.trajectory
    head = Text.assemble(
        (robot.id, "bold"),
        f"   {plan.backend.kind}   ",
        (f"{trajectory.duration:.6g} s", "bold"),
        (f"   planned in {seconds * 1e3:.1f} ms", "dim"),
    )
    return Group(
        Text(),
        head,
        *map(warning_line, plan.warnings),
        *map(_choice_line, plan.choices),
        *([] if plan.optimisation is None else [_optimisation_line(plan.optimisation)]),
        *map(_ride_line, plan.rides),
        Text(),
        _waypoint_table(plan),
        Text(),
        certificate_table(plan.certificate, plan.path.robot),
        Text(),
    )


def problem_panel(document: Mapping[str, Any]) -> Panel:
    """Show a problem document (RFC 9457) as a person reads it, with its remedies."""
    parts: list[RenderableType] = []
    errors = document.get("errors")
    if errors:
        faults = Table.grid(padding=(0, 2))
        for error in errors:
            faults.add_row(Text(error["pointer"] or "/", style="cyan"), Text(error["message"]))
        parts.append(faults)
    else:
        parts.append(Text(document["detail"]))
    parts += [
        Text.assemble((f"{finding['severity']}  ", "yellow"), finding["message"])
        for finding in document.get("findings", ())
    ]
    remedies = document.get("remedies")
    if remedies:
        parts += [Text(), Text("What would make it feasible", style="bold")]
        for remedy in remedies:
            value = orjson.dumps(remedy["value"]).decode()
            parts.append(Text.assemble((remedy["change"], "cyan"), " → ", (value, "green")))
            parts.append(Padding(Text(remedy["explanation"], style="dim"), (0, 0, 0, 2)))
    return Panel(
        Group(*parts),
        title=Text(f" {document['title']} ", style="bold red"),
        title_align="left",
        subtitle=Text(f" {document['code']} ", style="dim"),
        subtitle_align="right",
        border_style="red",
        padding=(1, 2),
    )


def solutions_table(robot: Robot, solutions: Sequence[FloatArray]) -> Table:
    """List joint positions that reach a pose, with the configurations that they are."""
    units = " or ".join(sorted({"rad" if joint.is_angle else "m" for joint in robot.joints}, reverse=True))
    table = plain_table("", *robot.joint_names, "configuration", right=robot.joint_names, title=f"Solutions ({units})")
    for i, (position, named) in enumerate(zip(solutions, configurations(robot, np.array(solutions)), strict=True), 1):
        names = ", ".join(name for name in asdict(named).values() if name is not None)
        table.add_row(str(i), *(f"{value:z.5f}" for value in position), names or "-")
    return table


def robots_table(robots: Sequence[Robot]) -> Table:
    """List the robots of the catalogue, one a line."""
    table = plain_table("id", "joints", "tip frame", right=["joints"])
    table.add_column("where it comes from", ratio=1)
    for robot in robots:
        table.add_row(Text(robot.id, style="cyan"), str(robot.dof), robot.tip_frame, Text(robot.source))
    return table


def robot_summary(robot: Robot) -> Group:
    """Show one robot: joints, and where each limit comes from."""
    mass = f"{robot.mass:.4g} kg" if robot.has_dynamics else "no masses known: no torques"
    head = Text.assemble((robot.id, "bold"), f"   {robot.dof} joints   tip frame {robot.tip_frame}   {mass}")
    limits = plain_table("joint", "kind", "position", "velocity", "acceleration", "jerk", "torque", title="Limits")
    for column in limits.columns[2:]:
        column.justify = "right"
    origins = plain_table("joint", *LIMITED_QUANTITIES, title="Where the limits come from")
    for joint in robot.joints:
        limits.add_row(
            joint.name, joint.kind, _position_range(joint), *(_limit(joint, q) for q in LIMITED_QUANTITIES[1:])
        )
        origins.add_row(joint.name, *(_origin(joint.provenance.get(quantity)) for quantity in LIMITED_QUANTITIES))
    notes = [Padding(Text(f"- {note}"), (0, 0, 0, 2)) for note in (*robot.notes, *_remarks(robot))]
    return Group(Text(), head, Text(robot.source, style="dim"), *notes, Text(), limits, Text(), origins, Text())


def _remarks(robot: Robot) -> list[str]:
    """Return the findings of the reader of a file; findings that differ only in the joint or link become one."""
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in (*robot.findings, *robot.collision_findings):
        text = finding.message.replace(finding.subject or "", "", 1)
        kinds.setdefault((finding.severity, text), []).append(finding)
    remarks = []
    for (severity, _), alike in kinds.items():
        others = ", ".join(str(finding.subject) for finding in alike[1:])
        remarks.append(f"{severity}: {alike[0].message}" + (f" (likewise {others})" if others else ""))
    return remarks


def _choice_line(choice: Choice) -> Text:
    """Show the option that was chosen at a goal set, and the number of the others by their outcome."""
    others = Counter(outcome.code or outcome.status for outcome in choice.options if outcome.status != "chosen")
    counts = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in others.items()) or "no other option"
    chosen = f"waypoint {choice.waypoint}: option {choice.option} of {len(choice.options)} "
    return Text.assemble(("chosen  ", "green"), chosen, (f"({counts})", "dim"))


def _optimisation_line(report: Optimisation) -> Text:
    """Show the duration without and with the optimisation, and the number of trajectories that it tried."""
    tried = f"{report.iterates} tried"
    if report.last == report.first:
        return Text.assemble(("optimised  ", "green"), "no shorter trajectory found ", (f"({tried})", "dim"))
    percent = 100.0 * (1.0 - report.last / report.first)
    shorter = f"{report.first:.4g} s before, {report.last:.4g} s now: {percent:.1f} % shorter "
    moved = f"{_counted(len(report.moved), 'waypoint')} moved" if report.moved else ""
    shrunk = f"{_counted(len(report.radii), 'blend')} changed" if report.radii else ""
    details = ", ".join(filter(None, (tried, moved, shrunk)))
    return Text.assemble(("optimised  ", "green"), shorter, (f"({details})", "dim"))


def _ride_line(report: RideReport) -> Text:
    """Show the time of arrival on a moving object, and the latest start."""
    start = f"latest start at {report.latest_start:.4g} s" if report.latest_start else "no later start found"
    return Text.assemble((f"on {report.object}  ", "green"), f"from {report.arrival:.4g} s on ", (f"({start})", "dim"))


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _waypoint_table(plan: Plan) -> Table:
    robot = plan.path.robot
    units = sorted({"rad" if joint.is_angle else "m" for joint in robot.joints}, reverse=True)
    numbers = ["arrives", *robot.joint_names]
    table = plain_table("waypoint", *numbers, right=numbers, title=f"Waypoints (s; joints in {', '.join(units)})")
    for i, waypoint in enumerate(plan.path.waypoints):
        arrival, departure = plan.trajectory.arrivals[i], plan.trajectory.departures[i]
        dwell = f" +{departure - arrival:g}" if departure > arrival else ""
        table.add_row(
            Text(waypoint.name or str(i)), f"{arrival:.3f}{dwell}", *(f"{value:z.4f}" for value in waypoint.position)
        )
    return table


def certificate_table(certificate: Certificate, robot: Robot) -> Table:
    """Show the largest share of each limit, with its joint and time."""
    title = Text.assemble(
        "Certificate: ",
        ("every enforced limit is kept", "green") if certificate.satisfied else ("violated", "red"),
        f"   {certificate.continuity}   waypoints met to {certificate.waypoint_error:.1g}",
    )
    table = plain_table("quantity", "worst joint", "peak", "of limit", "share", "", "at (s)", "check", right=NUMBERS)
    table.title = title
    for check in certificate.checks:
        limit = "none" if check.limit is None else f"{check.limit:.4g} {check.unit(robot)}"
        table.add_row(
            check.measure.title.lower(),
            check.joint or "",
            f"{check.peak:.4g}",
            limit,
            share_text(check.ratio) if check.bounded else Text("impulse", style="dim"),
            _bar(check),
            f"{check.time:.3f}",
            check.method if check.enforced else Text("not enforced", style="dim"),
        )
    parts = [_speed_zone(check) for check in certificate.speed_zones]
    if (found := certificate.clearance) is not None:
        if found.contacts is not None:
            parts.insert(0, f"where it takes things and puts them down {_clearance(found.contacts)}")
        parts = [*(_clearance(part) for part in (found.scene, found.itself) if part is not None), *parts]
    table.caption = "\n".join(parts) or None
    table.caption_justify = "left"
    return table


def warning_line(warning: PlanWarning) -> Text:
    """Show a warning."""
    return Text.assemble(("warning  ", "yellow"), warning.message)


def _clearance(clearance: Clearance) -> str:
    nearest = "" if clearance.time is None else f", nearest at {clearance.time:.3f} s"
    pair = "" if clearance.pair is None else " between {} and {}".format(*clearance.pair)
    least = math.floor(clearance.lower * 1e4) / 10.0  # mm; no more than is proved
    return f"clear by {least} mm at all times{pair}{nearest}{_estimate(clearance)}"


def _estimate(clearance: Clearance) -> str:
    """Describe the distance that the machine may stick out; empty where no shape is an estimate."""
    if clearance.shapes == "model":
        return ""
    margin = math.ceil(clearance.uncertainty * 1e4 - 1e-6) / 10.0  # mm; no less than covers it
    if clearance.lower >= clearance.uncertainty:
        return f"; estimate: this covers the {margin} mm by which the machine may stick out of its estimated shapes"
    advice = f"plan with a margin of at least {margin} mm"
    return f"; estimate: the machine may stick out of its estimated shapes by {margin} mm, {advice}"


def _speed_zone(check: SpeedZoneCheck) -> str:
    objects = "objects" if check.objects is None else " or ".join(check.objects)
    zone = f"nearer than {check.clearance:g} m to {objects}"
    if check.time is None:
        return f"never {zone}"
    peak = math.ceil(check.peak * 1e3) / 1e3  # m/s; no less than is proved
    return f"{zone} no faster than {peak} of {check.limit:g} m/s, at {check.time:.3f} s"


def _bar(check: Check) -> Text:
    if check.ratio is None:
        return Text(" " * BAR_WIDTH)
    full = min(BAR_WIDTH, round(check.ratio * BAR_WIDTH))
    return Text("━" * full, style=_share_style(check.ratio)) + Text("─" * (BAR_WIDTH - full), style="dim")


def _share_style(ratio: float) -> str:
    if ratio > 1.0 + 1e-9:
        return "red"
    return "yellow" if ratio > CLOSE_TO_LIMIT else "green"


def _position_range(joint: Joint) -> str:
    if joint.lower == -float("inf") and joint.upper == float("inf"):
        return "none"
    return f"{joint.lower:.4g} .. {joint.upper:.4g} {MEASURES['position'].unit_at(joint.is_angle)}"


def _limit(joint: Joint, quantity: str) -> str:
    value: float = getattr(joint, quantity)
    if value == float("inf"):
        return "none"
    return f"{value:.4g} {MEASURES[quantity].unit_at(joint.is_angle)}"


def _origin(provenance: str | None) -> Text:
    if provenance is None:
        return Text("-", style="dim")
    return Text(provenance, style="" if provenance in {"published", "datasheet"} else "yellow")

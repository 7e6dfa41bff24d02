"""Simulated runs of plans: the work of `planner simulate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import typer

from cli.work.local_plan import plan_request, read_request
from cli.work.runs.joint_columns import joint_columns, joint_value
from cli.work.shared import read, refusals, robot_named, write
from cli.work.terminal import plain_table, terminal
from planner.simulation import FeedForward, Servo, Simulation, simulate

if TYPE_CHECKING:
    from pathlib import Path

    from rich.table import Table

    from cli.work.robots.files import FileOptions


def simulate_file(
    request: str,
    servo: dict[str, Any],
    output: Path | None,
    plot: Path | None,
    backend: str | None,
    robot: str | None,
    options: FileOptions,
) -> None:
    """Plan the request in a file and run the plan in MuJoCo; see `planner simulate`."""
    if servo["feed_forward"] not in get_args(FeedForward):
        raise typer.BadParameter(f"must be one of {', '.join(get_args(FeedForward))}", param_hint="--feed-forward")
    for file, suffixes, hint in ((output, (".csv",), "--output"), (plot, (".png", ".svg"), "--plot")):
        if file is not None and file.suffix not in suffixes:
            raise typer.BadParameter(f"the file's suffix must be {' or '.join(suffixes)}", param_hint=hint)
    text = read(request)
    with refusals():
        named = None if robot is None else robot_named(robot, options)
        asked = read_request(text, backend, None if named is None else named.id)
        solved = plan_request(asked, None if named is None else named.load())
        try:
            run = simulate(solved, Servo(**servo))
        except ModuleNotFoundError:
            raise typer.BadParameter('needs MuJoCo: pip install "trajectory-planner[models]"') from None
    console = terminal()
    console.print(simulation_table(run))
    for line in contact_lines(run):
        console.print(line, markup=False)
    if output is not None:
        columns = {
            "position": run.position,
            "planned_position": run.planned,
            "torque": run.torque,
            "planned_torque": run.planned_torque,
        }
        write(output, joint_columns(run.time, run.plan.path.robot.joint_names, columns), console)
    if plot is not None:
        picture = run.plot()
        write(plot, picture.png() if plot.suffix == ".png" else picture.svg(), console)


def contact_lines(run: Simulation) -> list[str]:
    """Say what touches in a run, when first, and how deep."""
    if not run.contacts:
        return ["no contacts"]
    return [
        f"contact of {' and '.join(contact.pair)} from {contact.time:.4g} s, "
        f"at most {contact.depth * 1e3:.3g} mm deep at {contact.depth_time:.4g} s"
        for contact in run.contacts
    ]


def simulation_table(run: Simulation) -> Table:
    """Show for each joint how well it follows, and its torques beside the planned ones and the limit."""
    robot = run.plan.path.robot
    limits = np.abs(robot.bounds("torque")).min(axis=0)
    columns = ("following error", "at the end", "planned", "simulated", "ratio", "limit", "cut")
    title = f"{robot.id}   {run.plan.backend.kind}   {run.plan.trajectory.duration:.4g} s   simulated in MuJoCo"
    table = plain_table("joint", *columns, right=columns, title=title)
    peaks = (np.abs(torque).max(axis=0) for torque in (run.planned_torque, run.torque))
    rows = zip(run.following_error, run.end_error, *peaks, run.torque_ratio, run.limited.mean(axis=0), strict=True)
    for joint, (error, at_end, planned, simulated, ratio, cut) in enumerate(rows):
        torque_unit = "N m" if robot.is_angle[joint] else "N"
        table.add_row(
            robot.joint_names[joint],
            joint_value(robot, joint, error),
            joint_value(robot, joint, at_end),
            f"{planned:.4g} {torque_unit}",
            f"{simulated:.4g} {torque_unit}",
            "-" if np.isnan(ratio) else f"{ratio:.3f}",
            f"{limits[joint]:.4g} {torque_unit}" if np.isfinite(limits[joint]) else "none",
            f"{cut:.1%}",
        )
    return table

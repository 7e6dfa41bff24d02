"""Commands that run a plan: in a simulator, and on a robot of ROS 2."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer evaluates the annotations
from typing import Annotated

import typer

from cli.options import (  # noqa: TC001 - typer evaluates the annotations
    BackEndOption,
    RequestArgument,
    RobotOption,
    SrdfOption,
    TipOption,
)

app = typer.Typer()


@app.command()
def simulate(
    request: RequestArgument,
    feed_forward: Annotated[
        str,
        typer.Option(
            "--feed-forward",
            metavar="KIND",
            help="Torques that the controller adds: torque (of the planned motion), gravity or none.",
        ),
    ] = "torque",
    frequency: Annotated[float, typer.Option("--frequency", metavar="HZ", help="Frequency of the servo.")] = 10.0,
    cycle: Annotated[float, typer.Option("--cycle", metavar="SECONDS", help="Cycle of the controller.")] = 0.001,
    mass_error: Annotated[
        float,
        typer.Option(
            "--mass-error", metavar="SHARE", help="Share by which the arm is heavier than the controller knows."
        ),
    ] = 0.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write positions and torques as .csv.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw errors, torques and contacts into a .png or .svg file.")
    ] = None,
    backend: BackEndOption = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Plan a request here and run the plan in MuJoCo: following errors, torques and contacts (extra models)."""
    from cli.work.robots.files import FileOptions
    from cli.work.runs.simulated import simulate_file

    servo = {"cycle": cycle, "frequency": frequency, "feed_forward": feed_forward, "mass_error": mass_error}
    simulate_file(request, servo, output, plot, backend, robot, FileOptions(srdf, tip))


@app.command()
def ros(
    request: RequestArgument,
    bridge: Annotated[
        str, typer.Option("--bridge", metavar="HOST:PORT", help="WebSocket server of rosbridge.")
    ] = "127.0.0.1:9090",
    action: Annotated[
        str, typer.Option("--action", metavar="NAME", help="Action FollowJointTrajectory of the controller.")
    ] = "/joint_trajectory_controller/follow_joint_trajectory",
    states: Annotated[
        str, typer.Option("--states", metavar="TOPIC", help="Topic of the joint states.")
    ] = "/joint_states",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write recorded and planned positions as .csv."),
    ] = None,
    backend: BackEndOption = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Plan a request here, let a robot of ROS 2 run it, and compare its motion with the plan.

    This moves a robot, through rosbridge. The plan is sent only when the arm stands at its start; Ctrl-C cancels the
    motion. Needs the extra `ros`, but no ROS installation.
    """
    from cli.work.robots.files import FileOptions
    from cli.work.runs.executed import run_file

    host, _, port = bridge.rpartition(":")
    if not host or not port.isdigit():
        raise typer.BadParameter("must be HOST:PORT, as in 127.0.0.1:9090", param_hint="--bridge")
    run_file(request, (host, int(port)), action, states, output, backend, robot, FileOptions(srdf, tip))

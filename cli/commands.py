"""The command line. Each command imports its work from `cli/work/` when it runs: `planner --help` is quick."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from cli import batches, database, keys, paths, plots, runs
from cli.options import (
    BackEndOption,
    FormatOption,
    RequestArgument,
    RobotOption,
    SrdfOption,
    TipOption,
    format_names,
    robot_ids,
)

app = typer.Typer(
    name="planner",
    help="Waypoints in, certified joint trajectory out.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


app.add_typer(database.app)
app.add_typer(keys.app)
app.add_typer(runs.app)
app.command()(batches.batch)
app.command()(batches.sweep)
app.command()(plots.plot)
app.command()(plots.view)
app.command("import")(paths.import_)


def _version(asked: bool) -> None:
    if asked:
        from api.base.version import service_version

        print(service_version())  # noqa: T201 - what was asked for
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Plan joint trajectories that keep all limits, with a certificate."""


@app.command()
def serve(
    host: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Address to listen on.", show_default="127.0.0.1")
    ] = None,
    port: Annotated[
        int | None, typer.Option(metavar="NUMBER", help="Port to listen on.", show_default="8000", min=0, max=65535)
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Worker processes.", show_default="one a core", min=1, max=256)
    ] = None,
) -> None:
    """Run the HTTP service until SIGINT or SIGTERM.

    Other settings come from the environment: PLANNER_HOST, PLANNER_PORT, PLANNER_WORKERS, ...
    """
    from pydantic import ValidationError

    from api.base.settings import Settings, faults_of
    from api.pool.left_out import leave_out

    given = {"host": host, "port": port, "workers": workers}
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        faults = faults_of(error)
        raise typer.BadParameter("; ".join(faults), param_hint="environment") from None
    if sys.stderr.isatty():
        from cli.local_service import announce_when_ready

        announce_when_ready(settings.host, settings.port)
    leave_out()
    from api.process import serve as run

    run(settings)


@app.command()
def worker(
    scheduler: Annotated[str, typer.Argument(metavar="ADDRESS", help="The scheduler, as in tcp://10.0.0.1:8786.")],
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Planning processes.", show_default="one a core", min=1, max=256)
    ] = None,
) -> None:
    """Join this machine to the cluster that plans a service's batches, until SIGINT or SIGTERM.

    The rest comes from the environment, as for the service: PLANNER_WORKER_MEMORY_MIB, PLANNER_MAX_DEADLINE, ...
    """
    from cli.work.cluster import join_cluster

    join_cluster(scheduler, workers)


@app.command()
def plan(
    request: RequestArgument,
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write the trajectory here; - writes it to stdout. The suffix chooses the format.",
        ),
    ] = None,
    format_: FormatOption = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the plan into a .png, .svg or .html file.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a report: one .html file that anyone can open.")
    ] = None,
    proof: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the proof of the certificate, for planner check.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Save the plan, for planner convert and planner view.")
    ] = None,
    backend: BackEndOption = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Plan a request here, without a service, and show what came out."""
    from cli.work.planned_files import plan_file

    plan_file(request, output, format_, plot, report, proof, save, backend, robot, srdf, tip)


@app.command()
def convert(
    file: Annotated[str, typer.Argument(metavar="FILE", help="A plan that planner plan --save or plan.save wrote.")],
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write here; - writes to stdout. The suffix chooses the format."
        ),
    ],
    format_: FormatOption = None,
    period: Annotated[float, typer.Option(metavar="SECONDS", help="Sample period.", min=1e-6, max=1e6)] = 0.01,
    repeat: Annotated[
        int, typer.Option(metavar="N", help="Runs of a robot program; 0: until an operator stops it.", min=0)
    ] = 1,
) -> None:
    """Write a saved plan in another format, without planning it again."""
    from cli.work.saved_plans import convert_file

    convert_file(file, output, format_, period, repeat)


@app.command()
def order(
    request: Annotated[
        str, typer.Argument(metavar="REQUEST", help="File with a request of POST /v1/tasks/order; - reads stdin.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the tasks in order as a request for planner plan."),
    ] = None,
    time_budget: Annotated[
        float | None,
        typer.Option(
            "--time-budget",
            metavar="SECONDS",
            help="Time after which the search ends with the best order so far.",
            show_default="the request's",
            min=0.001,
        ),
    ] = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Choose the order of tasks, plan them in this order, and show both."""
    from cli.work.robots.files import FileOptions
    from cli.work.several.ordered_tasks import order_file

    order_file(request, output, time_budget, robot, FileOptions(srdf, tip))


@app.command()
def cell(
    request: Annotated[
        str, typer.Argument(metavar="REQUEST", help="File with a request of POST /v1/cells/plan; - reads stdin.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Write the trajectory of each robot into this folder."),
    ] = None,
    format_: Annotated[
        str, typer.Option("--format", metavar="NAME", help="Format of the trajectories.", autocompletion=format_names)
    ] = "json",
) -> None:
    """Plan several robots of one cell on one clock; they wait at stops so that they never touch."""
    from cli.work.several.cells import cell_file

    cell_file(request, output, format_)


@app.command()
def ik(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot of the catalogue, or a URDF file.", autocompletion=robot_ids)
    ],
    position: Annotated[
        tuple[float, float, float], typer.Option(metavar="X Y Z", help="Position of the tool in the base frame, m.")
    ],
    rpy: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="R P Y", help="Orientation: roll, pitch and yaw, rad.", show_default="any"),
    ] = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """List the joint positions that bring the tool to a pose."""
    from cli.work.local_kinematics import list_solutions

    list_solutions(robot, position, rpy, srdf, tip)


@app.command()
def validate(
    trajectory: Annotated[
        str,
        typer.Argument(
            metavar="TRAJECTORY",
            help="CSV, an answer of planner plan, or a request of POST /v1/trajectories/validate; - reads stdin.",
        ),
    ],
    interpolation: Annotated[
        str | None,
        typer.Option(
            metavar="LAW",
            help="What the controller runs: linear, cubic, quintic or polynomials.",
            show_default="what the columns allow",
        ),
    ] = None,
    robot: RobotOption = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
) -> None:
    """Check a trajectory of any origin against the limits of its robot; end with 1 if it exceeds one."""
    from cli.work.trajectory_files import validate_file

    validate_file(trajectory, interpolation, robot, srdf, tip)


@app.command()
def check(
    proof: Annotated[
        str, typer.Argument(metavar="PROOF", help="Proof file, or an answer that includes `proof`; - reads stdin.")
    ],
    statement: Annotated[
        str | None, typer.Option(metavar="DIGEST", help="Digest that the statement must have.", show_default="any")
    ] = None,
    trajectory: Annotated[
        str | None, typer.Option(metavar="DIGEST", help="Digest that the trajectory must have.", show_default="any")
    ] = None,
) -> None:
    """Check a proof file without trust in the planner; end with 1 if a claim is not proved."""
    from cli.work.planned_files import check_proof_file

    check_proof_file(proof, statement, trajectory)


@app.command()
def robots(
    robot: Annotated[
        str | None,
        typer.Argument(
            metavar="[ROBOT]",
            help="Show the joints and limits of this one, of the catalogue or in a URDF, xacro or MJCF file.",
            autocompletion=robot_ids,
        ),
    ] = None,
    srdf: SrdfOption = None,
    tip: TipOption = None,
    argument: Annotated[
        list[str] | None, typer.Option("--argument", metavar="NAME:=VALUE", help="Argument of a xacro file.")
    ] = None,
    packages: Annotated[
        list[Path] | None,
        typer.Option(
            "--packages",
            metavar="FOLDER",
            help="Folder that has the folders of ROS packages.",
            show_default="folders above the file",
            exists=True,
            file_okay=False,
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            metavar="FILE",
            help="Calibration file of an arm of Universal Robots.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    joint_limits: Annotated[
        Path | None,
        typer.Option(
            "--joint-limits",
            metavar="FILE",
            help="joint_limits.yaml of MoveIt or of a driver; its limits replace the limits in the file.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write the robot of a file as a request of POST /v1/robots, for a service or for --robot.",
        ),
    ] = None,
) -> None:
    """List the robots of the catalogue, or show one with its limits and where they come from.

    A xacro file is a program: open only files that you trust.
    """
    from cli.work.robots.files import FileOptions
    from cli.work.robots.shown import show_robots, xacro_arguments

    arguments = xacro_arguments(argument or ())
    options = FileOptions(srdf, tip, arguments, tuple(packages or ()), calibration, joint_limits)
    show_robots(robot, options, output)


@app.command()
def demo(
    output: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder for the pictures and the service's log.")
    ] = Path("demo-output"),
) -> None:
    """Start the service, plan the cases of four published works over HTTP, and draw them."""
    from cli.demo import run_demo

    raise typer.Exit(run_demo(output))


@app.command()
def mcp(
    url: Annotated[
        str | None,
        typer.Option(
            "--url",
            metavar="URL",
            help="Service that plans; its key is in the environment variable PLANNER_KEY.",
            show_default="a service of its own",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(metavar="NUMBER", help="Serve HTTP at /mcp on this port.", show_default="stdio", min=1, max=65535),
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on, with --port.")] = "127.0.0.1",
) -> None:
    """Offer the service to AI agents as tools of the Model Context Protocol. Nothing here moves a robot."""
    from cli.work.agents import serve_agents

    serve_agents(url, host, port)


def main() -> None:
    """Run the command line; a fault of its own ends with status 70 (sysexits) and one line, without values."""
    from api.base.logs import where_from

    try:
        app()
    except Exception as error:  # noqa: BLE001 - nobody is shown a traceback
        print(f"Internal error at {where_from(error)}: please report it.", file=sys.stderr)  # noqa: T201
        sys.exit(70)

"""The command line. What is heavy is imported only by the command that needs it: `planner --help` is quick."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

if TYPE_CHECKING:
    from api.errors import ServiceError
    from planner.errors import PlanningError

app = typer.Typer(
    name="planner",
    help="Waypoints in, certified joint trajectory out.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


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
    """Run the HTTP service until it is told to stop.

    What is left out comes from the environment: PLANNER_HOST, PLANNER_PORT, PLANNER_WORKERS, ...
    """
    from pydantic import ValidationError

    from api.server.process import serve as run
    from api.settings import Settings

    given = {"host": host, "port": port, "workers": workers}
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        faults = (f"PLANNER_{str(fault['loc'][0]).upper()}: {fault['msg']}" for fault in error.errors())
        raise typer.BadParameter("; ".join(faults), param_hint="environment") from None
    if sys.stderr.isatty():
        from api.cli.local_service import announce_when_ready

        announce_when_ready(settings.host, settings.port)
    run(settings)


@app.command()
def plan(
    request: Annotated[
        str, typer.Argument(metavar="REQUEST", help="File with a request of POST /v1/trajectories; - reads stdin.")
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write the trajectory here; the suffix chooses the format."
        ),
    ] = None,
    backend: Annotated[
        str | None, typer.Option(metavar="KIND", help="Back end in place of the request's, with its default options.")
    ] = None,
) -> None:
    """Plan a request here, without a service, and show what came out."""
    from api.cli.local_plan import format_of, plan_request, read_request, render
    from api.cli.terminal import plan_summary, terminal
    from api.errors import ServiceError
    from planner.backends import BACKENDS
    from planner.errors import PlanningError
    from planner.export import FORMATS

    form = None if output is None else format_of(output.name)
    if output is not None and form is None:
        suffixes = ", ".join(known.suffix for known in FORMATS.values())
        raise typer.BadParameter(f"the file's suffix must be one of {suffixes}", param_hint="--output")
    if backend is not None and backend not in BACKENDS:
        raise typer.BadParameter(f"the back ends are {', '.join(BACKENDS)}", param_hint="--backend")
    text = _read(request)
    try:
        asked = read_request(text, backend)
        start = time.perf_counter()
        solved = plan_request(asked)
        seconds = time.perf_counter() - start
        written = None if form is None else render(solved, asked, form)
    except (PlanningError, ServiceError) as error:
        _refuse(error)
    console = terminal()
    console.print(plan_summary(solved, seconds))
    if output is not None and written is not None:
        output.write_bytes(written)
        console.print(f"wrote {output} ({len(written) / 1e3:.0f} kB)")


@app.command()
def robots(
    robot: Annotated[str | None, typer.Argument(metavar="[ID]", help="Show the joints and limits of this one.")] = None,
) -> None:
    """List the robots of the catalogue, or show one with its limits and where they come from."""
    from api.cli.terminal import robot_summary, robots_table, terminal
    from planner.errors import PlanningError
    from planner.robots import catalogue_ids, load_robot

    try:
        shown = (
            robots_table([load_robot(robot_id) for robot_id in catalogue_ids()])
            if robot is None
            else robot_summary(load_robot(robot))
        )
    except PlanningError as error:
        _refuse(error)
    terminal().print(shown)


@app.command()
def demo(
    output: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder for the pictures and the service's log.")
    ] = Path("demo-output"),
) -> None:
    """Start the service, plan the cases of four published works over HTTP, and draw them."""
    from api.cli.terminal import terminal
    from api.demo import run_demo

    raise typer.Exit(run_demo(output, terminal()))


def _read(name: str) -> bytes:
    if name == "-":
        return sys.stdin.buffer.read()
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise typer.BadParameter(f"{name}: {error.strerror}", param_hint="REQUEST") from None


def _refuse(error: PlanningError | ServiceError) -> NoReturn:
    """Show the problem and end with status 1."""
    import orjson

    from api.cli.terminal import problem_panel, terminal
    from api.errors import problem_document

    _, document = problem_document(error, instance="")
    terminal(stderr=True).print(problem_panel(orjson.loads(document)))
    raise typer.Exit(1)

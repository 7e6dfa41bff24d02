"""Command line of the benchmarks."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchmarks.checkouts import BEFORE

if TYPE_CHECKING:
    from collections.abc import Callable

app = typer.Typer(
    help="Measure the service and the library on this machine.", add_completion=False, no_args_is_help=True
)


@app.callback()
def benchmarks() -> None:
    """Measure service and library on this machine."""


def _show(figures: dict[str, Any], as_json: bool, print_table: Callable[[dict[str, Any]], None]) -> None:
    """Print figures for a person or for a program."""
    import orjson

    print(orjson.dumps(figures, option=orjson.OPT_INDENT_2).decode()) if as_json else print_table(figures)


@app.command()
def http(
    other: Annotated[str, typer.Argument(help="The other version: the folder of a checkout, or a commit.")] = BEFORE,
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    seconds: Annotated[float, typer.Option(help="Length of each load, s.", min=0.5)] = 5.0,
    requests: Annotated[int, typer.Option(help="Requests of the latency measurement.", min=10)] = 1000,
    starts: Annotated[int, typer.Option(help="Starts of the service.", min=1)] = 5,
) -> None:
    """Measure the service beside another version: latency, its parts, requests a second, start, memory."""
    from benchmarks.service.http import measure
    from benchmarks.service.http_report import print_json, print_table

    figures = measure(other, seconds, requests, starts)
    print_json(figures) if json else print_table(figures)


@app.command()
def agents(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    requests: Annotated[int, typer.Option(help="Infeasible requests.", min=6)] = 500,
) -> None:
    """Count the infeasible requests that an agent turns into plans by remedies alone, within three calls."""
    from benchmarks.service.agents import measure, print_table

    _show(measure(requests), json, print_table)


@app.command()
def order(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    part: Annotated[str, typer.Option(help="The part with the holes: plate or block.")] = "block",
    holes: Annotated[int, typer.Option(help="Holes.", min=1)] = 245,
    seed: Annotated[int, typer.Option(help="Seed of their positions.", min=0)] = 0,
    backend: Annotated[str, typer.Option(help="Back end of all plans.")] = "trapezoidal",
) -> None:
    """Compare drill holes in any order with the nearest hole first and 2-opt in Cartesian space."""
    from benchmarks.tasks.holes import measure, print_table

    _show(measure(part, holes, seed, backend), json, print_table)


@app.command()
def load(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    seconds: Annotated[float, typer.Option(help="Length of each load, s.", min=1.0)] = 30.0,
) -> None:
    """Overload: up to ten times as many requests as the service can answer; goodput, refusals, cheap requests."""
    from benchmarks.service.load import measure
    from benchmarks.service.load_report import print_json, print_table

    figures = measure(seconds)
    print_json(figures) if json else print_table(figures)


@app.command()
def restarts(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    times: Annotated[int, typer.Option(help="Restarts.", min=1)] = 100,
) -> None:
    """Count accepted requests lost by restarts (SIGTERM) under load. A quarter of an hour with all 100."""
    from benchmarks.service.restarts import measure, print_table

    _show(measure(times), json, print_table)


@app.command()
def soak(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    seconds: Annotated[float, typer.Option(help="Length, s.", min=5.0)] = 1800.0,
) -> None:
    """Run all operations for long: memory, open files and temporary files must not grow."""
    from benchmarks.service.soak import measure, print_table

    _show(measure(seconds), json, print_table)


@app.command()
def batches(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    items: Annotated[int, typer.Option(help="Requests of each batch.", min=10)] = 10_000,
    only: Annotated[list[str] | None, typer.Option(help="Only places whose name has all these words.")] = None,
) -> None:
    """Measure batches: plans a second on own workers and on a Dask cluster, against the bare library loop."""
    from benchmarks.service.batches import measure, print_table

    _show(measure(items, only or ()), json, print_table)


@app.command()
def ik(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    poses: Annotated[int, typer.Option(help="Random reachable poses of each arm.", min=10)] = 2000,
    checks: Annotated[int, typer.Option(help="Random requests, half of them hard, checked for wrong answers.")] = 3000,
) -> None:
    """Measure inverse kinematics: rate, time and residual on six arms, beside the peers that are installed."""
    from benchmarks.kinematics.ik import measure
    from benchmarks.kinematics.report import print_json, print_table

    figures = measure(poses, checks)
    print_json(figures) if json else print_table(figures)


@app.command()
def trajectories(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    lists: Annotated[int, typer.Option(help="Fixed lists of waypoints, the first ones of 200.", min=2, max=200)] = 200,
    plot: Annotated[Path | None, typer.Option(help="File to draw the durations and the use of the limits in.")] = None,
) -> None:
    """Plan waypoint lists by every back end, beside the peers that are installed; takes many minutes with all 200."""
    from benchmarks.trajectories.report import draw, print_json, print_table
    from benchmarks.trajectories.trajectories import measure

    figures = measure(lists)
    print_json(figures) if json else print_table(figures)
    if plot is not None:
        draw(figures, plot)


@app.command()
def collisions(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    problems: Annotated[int, typer.Option(help="Problems of each of the seven kinds of scenes.", min=1)] = 20,
    arm: Annotated[list[str] | None, typer.Option(help="Only these robots.")] = None,
    kind: Annotated[list[str] | None, typer.Option(help="Only these kinds of scenes.")] = None,
    seconds: Annotated[float, typer.Option(help="Time in which a problem is to be solved, s.", min=0.1)] = 5.0,
) -> None:
    """Plan detours, beside the peers that are installed; takes half an hour with all 20."""
    from benchmarks.collisions.measure import ARMS, measure
    from benchmarks.collisions.report import print_json, print_table
    from benchmarks.collisions.scenes import KINDS

    figures = measure(problems, arm or ARMS, kind or tuple(KINDS), seconds)
    print_json(figures) if json else print_table(figures)


@app.command()
def roadmap(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    arm: Annotated[list[str] | None, typer.Option(help="Robots; ur5 and panda if omitted.")] = None,
    queries: Annotated[int, typer.Option(help="Motions in each of the seven kinds of scenes.", min=1)] = 10,
    over_http: Annotated[bool, typer.Option("--http", help="Plan them over HTTP in stored scenes instead.")] = False,
) -> None:
    """Search free motions with a roadmap and without, before and after a change of the scene."""
    from benchmarks.collisions import roadmaps, stored_roadmaps

    of = stored_roadmaps if over_http else roadmaps
    _show(of.measure(arm or ("ur5", "panda"), queries), json, of.print_table)


@app.command()
def keep(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    problems: Annotated[int, typer.Option(help="Problems of each of the seven kinds of scenes.", min=1)] = 20,
    arm: Annotated[list[str] | None, typer.Option(help="Robots; ur5e and fr3 if omitted.")] = None,
    seconds: Annotated[float, typer.Option(help="Processor time for each problem, s.", min=0.1)] = 30.0,
) -> None:
    """Carry upright cups among obstacles, beside OMPL's projected planner if it is installed; takes an hour."""
    from benchmarks.collisions.upright import measure, print_table

    _show(measure(problems, arm or ("ur5e", "fr3"), seconds), json, print_table)


@app.command()
def jobs(
    json: Annotated[bool, typer.Option("--json", help="Print the records as JSON.")] = False,
    every: Annotated[int, typer.Option(help="Every so many of the jobs.", min=1)] = 1,
    family: Annotated[str | None, typer.Option(help="Only this kind of work.")] = None,
    job: Annotated[str | None, typer.Option(help="Only this job.")] = None,
    backend: Annotated[list[str] | None, typer.Option(help="Only these back ends.")] = None,
    like: Annotated[Path | None, typer.Option(help="Only the jobs and back ends of these saved results.")] = None,
    save: Annotated[Path | None, typer.Option(help="File to save the results in, for docs/corpus.md.")] = None,
) -> None:
    """Plan jobs as robot programmers send them by every back end; takes hours with all of them."""
    from benchmarks.corpus.corpus import back_ends_of, names
    from benchmarks.jobs import results
    from benchmarks.jobs.jobs import measure
    from benchmarks.jobs.report import print_json, print_table
    from benchmarks.jobs.verdicts import judge

    chosen = {name: tuple(backend or back_ends_of(name)) for name in ([job] if job else names(family)[::every])}
    if like is not None:
        chosen = {name: tuple(own) for name, own in results.load(like).items()}
    records = judge(measure(chosen))
    print_json(records) if json else print_table(records)
    if save is not None:
        results.save(records, save)


@app.command()
def versions(
    other: Annotated[str, typer.Argument(help="The other version: the folder of a checkout, or a commit.")],
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    seconds: Annotated[float, typer.Option(help="Repetition of each kind of request, s.", min=0.0)] = 1.0,
    only: Annotated[list[str] | None, typer.Option(help="Only kinds whose name has all these words.")] = None,
) -> None:
    """Compare another version with this one: times by kind of request, and changes of answers."""
    from benchmarks.versions.report import print_json, print_table
    from benchmarks.versions.versions import measure

    figures = measure(other, seconds, only or ())
    print_json(figures) if json else print_table(figures)


@app.command()
def proofs(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    plans: Annotated[int, typer.Option(help="Random plans, over all back ends.", min=1)] = 20,
    files: Annotated[int, typer.Option(help="Honest files, and as many tampered ones.", min=0)] = 300,
    seconds: Annotated[float, typer.Option(help="Longest time for these files, s.", min=0.0)] = 600.0,
    results: Annotated[Path | None, typer.Option(help="File of the verdicts, where a later run goes on.")] = None,
) -> None:
    """Measure proof files: sizes, times of writing and checking; try honest and tampered files with both checkers."""
    from benchmarks.proofs.measure import measure, print_table

    _show(measure(plans, files, seconds, results), json, print_table)


@app.command()
def goal_sets(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    options: Annotated[int, typer.Option(help="Options of the goal set.", min=1)] = 100,
    repeats: Annotated[int, typer.Option(help="Plans of each case.", min=1)] = 7,
    backend: Annotated[str, typer.Option(help="Kind of the back end.")] = "ruckig",
) -> None:
    """Plan goal sets of many grasps, and the chosen grasp alone."""
    from benchmarks.trajectories.goal_sets import measure, print_table

    _show(measure(options, repeats, backend), json, print_table)


@app.command()
def off_path(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    problems: Annotated[int, typer.Option(help="Problems with tolerance regions.", min=1)] = 6,
    starts: Annotated[int, typer.Option(help="Multi-start searches of each.", min=1)] = 4,
    seconds: Annotated[float, typer.Option(help="Processor time of each search, s.", min=0.1)] = 20.0,
    budget: Annotated[float, typer.Option(help="Time budget of each plan, s.", min=0.1)] = 1.0,
) -> None:
    """Optimise durations within tolerance regions, beside multi-start searches with the closed form."""
    from benchmarks.trajectories.off_path import measure, print_table

    _show(measure(problems, starts, seconds, budget), json, print_table)


@app.command()
def simulation(
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
    plans: Annotated[int, typer.Option(help="Random plans, over all back ends.", min=1)] = 500,
) -> None:
    """Run plans in MuJoCo: following errors and torques by back end and controller (extra models)."""
    from benchmarks.simulation.measure import measure, print_table

    _show(measure(plans), json, print_table)


app()

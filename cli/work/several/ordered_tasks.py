"""Orders of tasks without a service: `planner order`."""

from __future__ import annotations

import time
from math import inf
from typing import TYPE_CHECKING

import orjson
from rich.table import Table

from api.contract.tasks import OrderRequest
from api.work.conversion.problems import to_backend, to_motion
from api.work.conversion.task_orders import at_field, in_request, to_plan_request, to_task_problem
from cli.work.local_plan import read_document
from cli.work.shared import read, refusals, robot_named, write
from cli.work.terminal import plan_summary, terminal
from planner.robots import load_robot
from planner.tasks import order_tasks

if TYPE_CHECKING:
    from pathlib import Path

    import planner
    from cli.work.robots.files import FileOptions


def order_file(
    request: str, output: Path | None, time_budget: float | None, robot: str | None, files: FileOptions
) -> None:
    """Order the tasks in a file, show the order with its plan, and write it as a plan request."""
    text = read(request)
    with refusals():
        named = None if robot is None else robot_named(robot, files)
        asked, document = read_document(OrderRequest, text, {} if named is None else {"robot": named.id})
        start = time.perf_counter()
        seconds = min(inf if own is None else own for own in (time_budget, asked.time_budget))
        with at_field(in_request):
            problem, tasks, tools = to_task_problem(asked, load_robot(asked.robot) if named is None else named.load())
            travel = None if asked.travel is None else to_motion(asked.travel, None)
            ordered = order_tasks(
                problem,
                tasks,
                to_backend(asked.backend),
                travel=travel,
                seconds=None if seconds == inf else seconds,
                tools=tools,
                mounted=asked.mounted,
            )
        taken = time.perf_counter() - start
    console = terminal(stderr=False)
    console.print(plan_summary(ordered.plan, taken), _order_table(tasks, ordered))
    bound = f"no order takes less than {ordered.bound:.4g} s by its estimate: a gap of {100.0 * ordered.gap:.1f} %"
    console.print(f"{ordered.planned_orders} planned; {bound}")
    if output is not None:
        write(output, orjson.dumps(to_plan_request(document, ordered), option=orjson.OPT_INDENT_2), console)


def _order_table(tasks: tuple[planner.Task, ...], ordered: planner.OrderedTasks) -> Table:
    """Return the tasks in order, with their tools and options if they have any."""
    has_tools, has_options = any(task.tool is not None for task in tasks), any(ordered.options)
    further = ["tool"] * has_tools + ["options"] * has_options
    columns = ["Order", "task", "name", "direction", "first waypoint", *further]
    table = Table(*columns, box=None, title_justify="left")
    visits = zip(ordered.order, ordered.reversed, ordered.first, ordered.options, strict=True)
    for place, (index, is_reversed, first, options) in enumerate(visits):
        direction = "reversed" if is_reversed else "as given"
        own = [tasks[index].tool or "own"] * has_tools + [", ".join(map(str, options))] * has_options
        table.add_row(str(place), str(index), tasks[index].name or "", direction, str(first), *own)
    return table

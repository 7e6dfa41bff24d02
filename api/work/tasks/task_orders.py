"""Tasks in any order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from api.base.errors import invalid_at
from api.contract import requests
from api.contract.tasks import OrderRequest
from api.work.answers.plans import as_dict
from api.work.conversion.problems import to_backend, to_motion
from api.work.conversion.task_orders import at_field, in_request, most_waypoints, to_plan_request, to_task_problem
from api.work.conversion.time_budgets import attempts_until
from api.work.tasks.context import in_scene, task, validated
from api.work.tasks.trajectories import figures_of, options_of, refuse_too_many_rows, with_roadmap
from planner.tasks import order_tasks

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext


@task("order_tasks")
def order(context: TaskContext) -> Reply:
    """Answer POST /v1/tasks/order."""
    with context.stage("validate"):
        request = context.request(OrderRequest)
        count = sum(most_waypoints(waypoint) for one in request.tasks for waypoint in one.waypoints)
        if count > context.caps.max_waypoints:
            most = context.caps.max_waypoints
            raise invalid_at("/tasks", f"must have at most {most} waypoints in all; got {count}")
        robot = context.robot(request)
        with at_field(in_request):
            problem, tasks, tools = to_task_problem(request, robot)
            problem = with_roadmap(problem, context.arguments.get("roadmap"))
        travel = None if request.travel is None else to_motion(request.travel, None)
    with context.stage("plan"), at_field(in_request):
        left = attempts_until(context.task.deadline).seconds
        seconds = min(left or 0.0, request.time_budget or float("inf"))
        ordered = order_tasks(
            problem,
            tasks,
            to_backend(request.backend),
            travel=travel,
            seconds=seconds,
            tools=tools,
            mounted=request.mounted,
        )
    plan = ordered.plan
    refuse_too_many_rows(plan.trajectory.duration, request.sample_period, plan.path.robot.dof, context)
    planned = to_plan_request(context.document, ordered)
    ordinary = in_scene(validated(requests.PlanRequest, planned, context.caps), context.arguments.get("scene"))
    options = options_of(ordinary, problem, context)
    visits = zip(ordered.order, ordered.reversed, ordered.first, ordered.options, strict=True)
    answer = {
        "order": [
            {
                "task": index,
                "name": tasks[index].name,
                "tool": tasks[index].tool,
                "reversed": is_reversed,
                "first": first,
                "options": chosen,
            }
            for index, is_reversed, first, chosen in visits
        ],
        "bound": ordered.bound,
        "gap": ordered.gap,
        "planned_orders": ordered.planned_orders,
        "request": planned,
        "plan": as_dict(plan, options),
    }
    return context.reply(answer, plan=figures_of(plan))

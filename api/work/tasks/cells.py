"""Cells of several robots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from api.base.errors import invalid_at
from api.contract.cells import CellRequest
from api.work.answers.cells import cell_as_dict, options_of_plans
from api.work.conversion.cells import in_request, rules_of, to_cell
from api.work.conversion.task_orders import at_field
from api.work.conversion.time_budgets import attempts_until, within_shares
from api.work.tasks.context import robot_of, task
from api.work.tasks.remedies import acceptable_remedies
from api.work.tasks.trajectories import refuse_too_many_rows
from planner.cells import plan_cell
from planner.errors import UnknownRobot

if TYPE_CHECKING:
    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext
    from planner.robots import Robot


@task("plan_cell")
def cell(context: TaskContext) -> Reply:
    """Answer POST /v1/cells/plan."""
    with context.stage("validate"), at_field(in_request):
        request = context.request(CellRequest)
        count = sum(len(member.waypoints) for member in request.robots)
        if count > context.caps.max_waypoints:
            most = context.caps.max_waypoints
            raise invalid_at("/robots", f"must have at most {most} waypoints in all; got {count}")
        definitions = context.arguments.get("definitions", {})
        robots = [_robot(index, member.robot, definitions) for index, member in enumerate(request.robots)]
        members, scene = to_cell(request, robots)
    with context.stage("plan"), acceptable_remedies(context, request, 0), at_field(in_request):
        deadline = context.task.deadline
        planned = plan_cell(
            within_shares(members, deadline),
            scene=scene,
            budget=attempts_until(deadline),
            **rules_of(request),
        )
    joints = sum(plan.path.robot.dof for plan in planned.plans)  # one answer has the samples of all
    for index, (member, plan) in enumerate(zip(request.robots, planned.plans, strict=True)):
        field = f"/robots/{index}/sample_period"
        refuse_too_many_rows(plan.trajectory.duration, member.sample_period, joints, context, field)
    return context.reply(cell_as_dict(planned, options_of_plans(request, definitions)))


def _robot(index: int, name: str, definitions: dict[str, bytes]) -> Robot:
    """Find the robot of a member of a cell.

    Raises:
        UnknownRobot: There is none with this id.
    """
    try:
        return robot_of(name, definitions.get(name))
    except UnknownRobot as refusal:
        raise refusal.with_fields(robot=index) from None

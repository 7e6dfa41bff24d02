"""Plans run by a robot of ROS 2: the work of `planner ros`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson
import typer

from cli.work.local_plan import plan_request, read_request
from cli.work.runs.joint_columns import joint_columns, joint_value
from cli.work.shared import read, refusals, robot_named, write
from cli.work.terminal import plain_table, terminal
from planner.export import ExportOptions, render

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy.typing as npt
    from rich.table import Table

    from cli.work.robots.files import FileOptions
    from cli.work.runs.rosbridge import JointState
    from planner.plans.result import Plan

START_TOLERANCE = 0.01
"""The largest distance of a joint from the plan's first position at which the plan is sent, rad or m."""

RESULT_SECONDS = 10.0
"""The time after the plan's end in which the result must come, s."""

LARGEST_DELAY = 1.0
"""The largest delay of the recorded motion behind the plan that is looked for, s."""

DELAY_STEPS = 1001
"""Number of delays that are compared in each of two rounds."""


@dataclass(frozen=True)
class Execution:
    """A run of a plan by a robot, beside the plan."""

    plan: Plan
    delay: float
    """The delay of the recorded motion behind the plan: controller, drives and messages together, s."""
    time: npt.NDArray[np.float64]
    """The times (N,) of the recorded states since the start of the planned motion, s."""
    position: npt.NDArray[np.float64]
    """The recorded joint positions (N, joints), rad or m."""
    planned: npt.NDArray[np.float64]
    """The planned joint positions (N, joints) at these times, without the delay, rad or m."""
    controller_error: npt.NDArray[np.float64] | None
    """The largest error (joints,) of each joint in the controller's feedback, rad or m; None: it sent none."""


def run_file(
    request: str,
    bridge: tuple[str, int],
    action: str,
    states: str,
    output: Path | None,
    backend: str | None,
    robot: str | None,
    options: FileOptions,
) -> None:
    """Plan the request in a file, and let a robot of ROS 2 run the plan; see `planner ros`."""
    try:
        from cli.work.runs.rosbridge import RosError, connected
    except ModuleNotFoundError:
        raise typer.BadParameter('needs roslibpy: pip install "trajectory-planner[ros]"') from None
    if output is not None and output.suffix != ".csv":
        raise typer.BadParameter("the file's suffix must be .csv", param_hint="--output")
    text = read(request)
    with refusals():
        named = None if robot is None else robot_named(robot, options)
        read_in = read_request(text, backend, None if named is None else named.id)
        solved = plan_request(read_in, None if named is None else named.load())
        message = orjson.loads(render(solved, "ros2", ExportOptions(read_in.sample_period)))
    joints, duration = solved.path.robot.joint_names, solved.trajectory.duration
    console = terminal()
    try:
        with connected(*bridge, states, joints) as robot_side:
            _refuse_other_start(solved, robot_side.current_positions(), RosError)
            console.print(f"{action}: sent {len(message['points'])} points, {duration:.4g} s")
            recording = robot_side.run_trajectory(message, action, duration + RESULT_SECONDS)
    except RosError as error:
        terminal(stderr=True).print(str(error), markup=False)
        raise typer.Exit(1) from None
    errors = [_by_joint(each, joints) for each in recording.feedback]
    execution = compare(solved, recording.states, recording.sent, np.abs(errors).max(axis=0) if errors else None)
    console.print(execution_table(execution))
    if output is not None:
        columns = {"position": execution.position, "planned_position": execution.planned}
        write(output, joint_columns(execution.time, joints, columns), console)


def _refuse_other_start(solved: Plan, current: list[float], error: type[Exception]) -> None:
    """Refuse to send a plan to an arm that is elsewhere than the plan's start: it would jump there.

    Raises:
        error: A joint is elsewhere.
    """
    away = np.abs(np.subtract(current, solved.trajectory(0.0)))
    joint = int(away.argmax())
    if away[joint] > START_TOLERANCE:
        robot = solved.path.robot
        raise error(
            f"{robot.joint_names[joint]} is {joint_value(robot, joint, away[joint])} away from the start of the plan. "
            f"Start the request at the current position: {[round(value, 4) for value in current]}"
        )


def _by_joint(feedback: dict[str, Any], joints: Sequence[str]) -> list[float]:
    """Return the errors in a feedback message, in the order of the robot's joints; 0 for joints that it lacks."""
    errors = dict(zip(feedback["joint_names"], feedback["error"]["positions"], strict=False))
    return [errors.get(name, 0.0) for name in joints]


def compare(
    plan: Plan, states: Sequence[JointState], sent: float, controller_error: npt.NDArray[np.float64] | None = None
) -> Execution:
    """Compare recorded joint states with a plan, after the delay that fits them best.

    Args:
        plan: The plan that the robot ran.
        states: The states from the sending of the plan on; their clock has any origin.
        sent: The time at which the plan was sent, s, of the same clock.
        controller_error: The largest error (joints,) in the controller's feedback, rad or m.
    """
    clock = np.array([state.time for state in states])
    position = np.array([[state.positions[name] for name in plan.path.robot.joint_names] for state in states])
    clock -= sent
    delay, width = LARGEST_DELAY / 2.0, LARGEST_DELAY / 2.0
    for _ in range(2):
        delays = np.linspace(max(delay - width, 0.0), delay + width, DELAY_STEPS)
        costs = [np.square(position - _planned(plan, clock - each)).sum() for each in delays]
        delay, width = float(delays[np.argmin(costs)]), 2.0 * width / (DELAY_STEPS - 1)
    return Execution(plan, delay, clock - delay, position, _planned(plan, clock - delay), controller_error)


def _planned(plan: Plan, times: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return plan.trajectory(times.clip(0.0, plan.trajectory.duration))


def execution_table(execution: Execution) -> Table:
    """Show for each joint its largest following error, the one at the end, and the controller's own."""
    robot, trajectory = execution.plan.path.robot, execution.plan.trajectory
    columns = ("following error", "at the end", "by the controller")
    title = (
        f"{robot.id}   {execution.plan.backend.kind}   {trajectory.duration:.4g} s   run by ROS 2, "
        f"{execution.delay * 1e3:.0f} ms behind the plan, {len(execution.time)} states"
    )
    table = plain_table("joint", *columns, right=columns, title=title)
    errors = np.abs(execution.position - execution.planned)
    for joint, name in enumerate(robot.joint_names):
        own = None if execution.controller_error is None else execution.controller_error[joint]
        table.add_row(
            name,
            joint_value(robot, joint, errors[:, joint].max()),
            joint_value(robot, joint, errors[-1, joint]),
            "-" if own is None else joint_value(robot, joint, own),
        )
    return table

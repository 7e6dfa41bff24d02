"""URScript: a program that streams the joint positions to an arm of Universal Robots (`servoj`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format, sample

if TYPE_CHECKING:
    from planner.kinematics import FloatArray
    from planner.result import Plan

JOINTS = 6
"""The number of joints of an arm of Universal Robots."""

AT_START = 0.01
"""How far a joint may be from the start, rad; further away the program halts in place of jumping there."""

LOOKAHEAD = 0.03
"""The time by which the controller smooths what it is sent, s: the least that it takes."""

GAIN = 300
"""The controller's default gain towards the positions that it is sent."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program of joint positions at the sample period, which the controller follows.

    Raises:
        UnsupportedFormat: The arm has not six joints that turn.
    """
    robot, duration = plan.path.robot, plan.trajectory.duration
    if robot.dof != JOINTS or not robot.is_angle.all():
        raise UnsupportedFormat(f"URScript moves arms of {JOINTS} joints that turn, which {robot.id} is not")
    samples = sample(plan, options)
    positions, periods = list(map(_joints, samples.position)), (samples.time[1:] - samples.time[:-1]).tolist()
    lines = [
        f"# {robot.id}, {plan.backend.kind}, {duration!r} s: joint positions (rad) every {options.sample_period:g} s.",
        f"# The controller runs behind them by up to {LOOKAHEAD} s; velocities, torques and events are not carried.",
        "def planned_trajectory():",
        f"  start = {positions[0]}",
        "  actual = get_actual_joint_positions()",
        "  i = 0",
        f"  while i < {JOINTS}:",
        f"    if norm(actual[i] - start[i]) > {AT_START}:",
        '      popup("The robot is not at the start of the trajectory", title="Halted", error=True)',
        "      halt",
        "    end",
        "    i = i + 1",
        "  end",
        *(
            f"  servoj({position}, t={period!r}, lookahead_time={LOOKAHEAD}, gain={GAIN})"
            for position, period in zip(positions[1:], periods, strict=True)
        ),
        "  stopj(2.0)",
        "end",
        "planned_trajectory()",
    ]
    return ("\n".join(lines) + "\n").encode()


def _joints(position: FloatArray) -> str:
    return "[" + ", ".join(map(repr, position.tolist())) + "]"


FORMAT = Format("urscript", "text/x-urscript", ".script", render)
"""The form of programs for Universal Robots."""

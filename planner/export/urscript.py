"""URScript: a program that streams the joint positions to an arm of Universal Robots (`servoj`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format, sample
from planner.export.programs import AT_START, JOINTS

if TYPE_CHECKING:
    from planner.kinematics import FloatArray
    from planner.result import Plan

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
    positions, periods = list(map(joints, samples.position)), (samples.time[1:] - samples.time[:-1]).tolist()
    lines = [
        f"# {robot.id}, {plan.backend.kind}, {duration!r} s: joint positions (rad) every {options.sample_period:g} s.",
        f"# The controller runs behind them by up to {LOOKAHEAD} s; velocities, torques and events are not carried.",
        "def planned_trajectory():",
        *halt_away_from_start(samples.position[0]),
        *(
            f"  servoj({position}, t={period!r}, lookahead_time={LOOKAHEAD}, gain={GAIN})"
            for position, period in zip(positions[1:], periods, strict=True)
        ),
        "  stopj(2.0)",
        "end",
        "planned_trajectory()",
    ]
    return ("\n".join(lines) + "\n").encode()


def halt_away_from_start(position: FloatArray) -> list[str]:
    """Write what halts the program where the robot is not at its start."""
    return [
        f"  start = {joints(position)}",
        "  actual = get_actual_joint_positions()",
        "  i = 0",
        f"  while i < {JOINTS}:",
        f"    if norm(actual[i] - start[i]) > {AT_START}:",
        '      popup("The robot is not at the start of the trajectory", title="Halted", error=True)',
        "      halt",
        "    end",
        "    i = i + 1",
        "  end",
    ]


def joints(position: FloatArray) -> str:
    """Write a joint position (joints,), rad, as a list."""
    return "[" + ", ".join(map(repr, position.tolist())) + "]"


FORMAT = Format("urscript", "text/x-urscript", ".script", render)
"""The form of programs for Universal Robots."""

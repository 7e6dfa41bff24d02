"""URScript: a program that streams the joint positions to an arm of Universal Robots (`servoj`)."""

from __future__ import annotations

import numpy as np

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format
from planner.export.programs import APPROACH, AT_START, JOINTS, name_of, origin, stops
from planner.kinematics import FloatArray
from planner.plans.result import Plan
from planner.problems.actions import SetOutput

LOOKAHEAD = 0.03
"""The smoothing time of the controller, s: the shortest that it accepts."""

GAIN = 300
"""The controller's default gain towards the positions that it is sent."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as a program of joint positions at the sample period, which the controller follows.

    Raises:
        UnsupportedFormat: The arm does not have six revolute joints, the trajectory begins or ends in motion, or an
            output has an unknown name.
    """
    robot = plan.path.robot
    if robot.dof != JOINTS or not robot.is_angle.all():
        raise UnsupportedFormat(f"URScript moves arms of {JOINTS} joints that turn, which {robot.id} is not")
    stops(plan, "URScript")
    samples = plan.samples(options.sample_period, options.include)
    positions, periods = list(map(joints, samples.position)), (samples.time[1:] - samples.time[:-1]).tolist()
    outputs: dict[int, list[str]] = {}
    for timed in plan.actions:
        if isinstance(timed.action, SetOutput):
            nearest = int(np.abs(samples.time - timed.time).argmin())
            outputs.setdefault(nearest, []).append(f"  {set_output(timed.action)}")
    lines = [
        f"# {origin(plan)}: joint positions (rad) every {options.sample_period:g} s.",
        f"# The controller runs behind them by up to {LOOKAHEAD} s; outputs are set with the nearest point;",
        "# velocities and torques are not carried.",
        "def planned_trajectory():",
        *halt_away_from_start(samples.position[0]),
        *outputs.pop(0, ()),
        *(
            line
            for k, (position, period) in enumerate(zip(positions[1:], periods, strict=True), 1)
            for line in (
                f"  servoj({position}, t={period!r}, lookahead_time={LOOKAHEAD}, gain={GAIN})",
                *outputs.get(k, ()),
            )
        ),
        "  stopj(2.0)",
        "end",
        "planned_trajectory()",
    ]
    return ("\n".join(lines) + "\n").encode()


def halt_away_from_start(position: FloatArray) -> list[str]:
    """Write the lines that move the robot to its start from nearby, and otherwise halt the program."""
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
        f"  movej(start, t={APPROACH})",
    ]


def set_output(output: SetOutput) -> str:
    """Write what sets an output, which is called like standard_digital_out_3.

    Raises:
        UnsupportedFormat: It has another name.
    """
    if isinstance(output.value, bool):
        pattern = r"(standard|configurable|tool)_digital_out_(\d)"
        found = name_of(output, pattern, "URScript", "standard_digital_out_3")
        return f"set_{found[1]}_digital_out({found[2]}, {output.value})"
    found = name_of(output, r"standard_analog_out_([01])", "URScript", "standard_analog_out_0 where it takes a number")
    return f"set_standard_analog_out({found[1]}, {output.value!r})"


def joints(position: FloatArray) -> str:
    """Write a joint position (joints,), rad, as a list."""
    return "[" + ", ".join(map(repr, position.tolist())) + "]"


FORMAT = Format("urscript", "text/x-urscript", ".script", render)
"""The form of programs for Universal Robots."""

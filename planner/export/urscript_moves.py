"""URScript: a program of `movej` and `movel` from stop to stop for an arm of Universal Robots, with their times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions, Format
from planner.export.programs import moves, origin
from planner.export.urscript import halt_away_from_start, joints, set_output
from planner.guarantees import leaves_straight_motions
from planner.problems.problem import JointMotion, LinearMotion
from planner.problems.transitions import StopTransition
from planner.spatial import rotation_vector

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.export.programs import Move
    from planner.plans.result import Plan
    from planner.spatial import Pose


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as one statement a segment, which the controller plans for itself in the time of the segment.

    Raises:
        UnsupportedFormat: The plan passes a waypoint without a stop, or a motion is neither straight in joint space nor
            a line of the tool. Or the arm does not have six revolute joints.
    """
    motions = moves(plan, "URScript", options.sample_period)
    program = "\n".join(
        [
            f"# {origin(plan)}: joint positions in rad.",
            "# The controller plans each motion itself, in the given time: the certificate does not hold for it.",
            "# Lines are lines of the tool that is set there, which has to be the plan's at the start.",
            "def planned_trajectory():",
            *halt_away_from_start(plan.path.positions[0]),
            *(f"  {line}" for line in _statements(plan, motions)),
            "end",
            "planned_trajectory()",
        ]
    )
    return f"{program}\n".encode()


def _statements(plan: Plan, motions: list[Move]) -> Iterator[str]:
    last = len(plan.path.positions) - 1
    for i, (waypoint, move) in enumerate(zip(plan.problem.waypoints, motions, strict=False)):
        if 0 < i < last and not isinstance(waypoint.transition, StopTransition):
            raise UnsupportedFormat(f"this form stops at every waypoint; waypoint {i} is passed", waypoint=i)
        if waypoint.tool is not None:
            yield f"set_tcp({_pose(waypoint.tool)})"
        if len(move.time) > 1:
            position, duration = joints(plan.path.positions[i]), float(move.time[-1])
            match waypoint.motion:
                case JointMotion() if not leaves_straight_motions(plan.backend):
                    yield f"movej({position}, t={duration!r})"
                case LinearMotion():
                    yield f"movel({position}, t={duration!r})"
                case _:
                    message = f"this form has lines and straight joint motions only; the way to waypoint {i} is another"
                    raise UnsupportedFormat(message, waypoint=i)
        for step in move.steps_of_the_rest():
            yield f"sleep({step!r})" if isinstance(step, float) else set_output(step)


def _pose(pose: Pose) -> str:
    """Return a pose as URScript writes it: a position, m, and a rotation vector, rad."""
    turn = np.zeros(3) if pose.rotation is None else rotation_vector(pose.rotation)
    return f"p[{', '.join(repr(value) for value in [*pose.position.tolist(), *turn.tolist()])}]"


FORMAT = Format("urscript_moves", "text/x-urscript-moves", ".moves.script", render)
"""The form of programs for Universal Robots with a statement for each motion."""

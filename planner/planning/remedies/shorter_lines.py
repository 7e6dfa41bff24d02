"""A nearer end of a straight line whose end is out of reach; a longer search or a smaller margin of a detour."""

from __future__ import annotations

from collections.abc import Iterator

from planner.errors import NoPathFound, PlanningError, Remedy
from planner.kinematics import forward_kinematics, inverse_kinematics
from planner.planning.attempts import Attempt, Proposals, Refused
from planner.planning.proofs import QUICK_CHECKS, Change, first_proved, proved
from planner.planning.remedies.collisions import smaller_margin
from planner.problems.motion_around import MOST_CHECKS, FreeMotion
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.spatial import Pose
from planner.tool_motions.pose_paths import Line
from planner.waypoints.targets import pose_remedy

TRIED_SHARES_OF_REACH = (0.95, 0.8, 0.5)
"""Shares of the reachable part of a line that are tried: at its end the arm is stretched, and no line leads there."""

REACH_BISECTIONS = 8
"""The number of halvings that find the reachable part of a line."""


def shorter_line_remedies(attempt: Attempt, refusal: PlanningError) -> Proposals[list[Remedy]]:
    """Find a pose on a line to an unreachable pose that the same line reaches; none for other motions."""
    if refusal.waypoint is None:
        return []
    return (yield from first_proved(nearer_ends(attempt.problem, refusal.waypoint), attempt))


def nearer_ends(problem: PlanningProblem, index: int) -> Iterator[Change]:
    """Yield poses on the line to a waypoint as its goal, the farthest first."""
    waypoint, before = problem.waypoints[index], problem.waypoints[index - 1]
    if index == 0 or not isinstance(waypoint, PoseWaypoint) or not isinstance(waypoint.motion, LinearMotion):
        return
    robot, goal = problem.robots[index], waypoint.pose_in_base
    if isinstance(before, JointWaypoint):
        start = forward_kinematics(robot, before.position)
    elif isinstance(before, PoseWaypoint):
        start = before.pose_in_base
    else:
        return
    line = Line(start, goal)

    def at(share: float) -> Pose:
        """Return the pose at a share of the line; from any orientation on, with that of the goal."""
        pose = line.pose(share)
        return pose if pose.rotation is not None else Pose(pose.position, goal.rotation)

    reached, missed = 0.0, 1.0
    for _ in range(REACH_BISECTIONS):
        middle = (reached + missed) / 2.0
        if inverse_kinematics(robot, at(middle)).status == "solved":
            reached = middle
        else:
            missed = middle
    for share in TRIED_SHARES_OF_REACH:
        explanation = f"a pose within reach, after {share * reached:.0%} of the line"
        yield pose_remedy(index, waypoint, at(share * reached), None, None, explanation)


LONGER = 8
"""Factor on the motions that a longer search looks at, from `QUICK_CHECKS` up to the default."""


def detour_remedies(refused: Refused, refusal: NoPathFound) -> Proposals[list[Remedy]]:
    """Find changes with each of which the problem has been planned."""
    attempt, at = refused.attempt, (refusal.segment or 0) + 1
    motion = attempt.problem.waypoints[at].motion
    if not isinstance(motion, FreeMotion):
        return []
    field, helping = ("waypoints", at, "motion", "most_checks"), []
    more = min(max(LONGER * motion.most_checks, QUICK_CHECKS), MOST_CHECKS)
    if more > motion.most_checks and not refusal.enclosed_by:
        helping += yield from proved([Remedy(field, more, "a longer search finds a detour")], attempt, longer=True)
    scene = attempt.problem.scene
    if not helping and scene is not None and (scene.margin or any(thing.margin for thing in scene.objects)):
        helping += yield from smaller_margin(attempt, refusal.enclosed_by)
    return helping
